"""Keep what the host wants of all its drives, and give it up where the drives do not follow."""

from dataclasses import dataclass
from typing import Final

from drivers.clock import NS_PER_S
from drivers.wheel_drives.bus import DriveGoal

FAULT_RESET_NS: Final = NS_PER_S // 2
BRAKE_TIMEOUT_NS: Final = 5 * NS_PER_S


@dataclass(frozen=True, slots=True, kw_only=True)
class DrivesSeen:
    """Say how all drives are at one tick; `braking` are those that have power and move."""

    all_enabled: bool
    any_lost: bool
    any_faulted: bool
    any_braking: bool


class GoalKeeper:
    """Hold the goal: enabled drives that fail are braked, braked drives lose their power."""

    def __init__(self) -> None:
        self.goal = DriveGoal.DISABLED
        self._was_enabled = False
        self._until_ns = 0

    def enable(self) -> None:
        """Want all drives to follow."""
        self.goal = DriveGoal.ENABLED
        self._was_enabled = False

    def disable(self) -> None:
        """Want all drives without power."""
        self.goal = DriveGoal.DISABLED

    def quick_stop(self, now_ns: int) -> None:
        """Want all drives to brake, and then to be without power."""
        if self.goal is not DriveGoal.QUICK_STOP:
            self.goal = DriveGoal.QUICK_STOP
            self._until_ns = now_ns + BRAKE_TIMEOUT_NS

    def reset_fault(self, now_ns: int) -> None:
        """Want all drives out of their faults for a while, and then without power."""
        self.goal = DriveGoal.FAULT_RESET
        self._until_ns = now_ns + FAULT_RESET_NS

    def advance(self, seen: DrivesSeen, now_ns: int) -> None:
        """Change the goal where it is reached, out of reach or out of time."""
        late = now_ns > self._until_ns
        if self.goal is DriveGoal.ENABLED:
            fell_out = self._was_enabled and not seen.all_enabled
            self._was_enabled = seen.all_enabled
            if fell_out or seen.any_lost or seen.any_faulted:
                self.quick_stop(now_ns)
        elif (self.goal is DriveGoal.QUICK_STOP and (late or not seen.any_braking)) or (
            self.goal is DriveGoal.FAULT_RESET and (late or not seen.any_faulted)
        ):
            self.disable()
