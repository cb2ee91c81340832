"""Declare the contract that every bus of wheel drives keeps, whatever protocol it speaks."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock
from drivers.error_budget import BudgetLimits, BudgetState, BusBudget

NODE_LIMITS: Final = BudgetLimits(window_s=1.0, degraded_at=10, lost_at=125, recover_at=2)
"""At 250 Hz, 4 % of a second's answers missing degrade a node, half of them lose it."""
CONNECT_POLL_NS: Final = 500_000


class PowerState(Enum):
    """Name the states of the CiA 402 power drive system; other protocols map theirs to them."""

    UNKNOWN = "unknown"
    NOT_READY = "not ready to switch on"
    SWITCH_ON_DISABLED = "switch on disabled"
    READY_TO_SWITCH_ON = "ready to switch on"
    SWITCHED_ON = "switched on"
    OPERATION_ENABLED = "operation enabled"
    QUICK_STOP_ACTIVE = "quick stop active"
    FAULT_REACTION_ACTIVE = "fault reaction active"
    FAULT = "fault"


class Goal(Enum):
    """Name what the host wants of all its drives."""

    DISABLED = "disabled"
    ENABLED = "enabled"
    QUICK_STOP = "quick stop"
    FAULT_RESET = "fault reset"


class ResetRule(Enum):
    """Name who may take a fault back."""

    AUTOMATIC = "with the next connection"
    OPERATOR = "by the operator's reset"
    NEVER = "only after repair, by switching the supply off and on"


class DriveFault(Protocol):
    """Tell what a drive complains about."""

    @property
    def code(self) -> int:
        """Return the drive's own number for it."""
        ...

    @property
    def text(self) -> str:
        """Return it in words."""
        ...

    @property
    def rule(self) -> ResetRule:
        """Return who may take it back."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveState:
    """Hold what is known of all drives at one tick, in the order of their specs.

    `age_s` is the time since the values were sampled. `lost` marks a drive that has gone silent,
    rebooted or left its operational state; `faulted` one in a fault state; `fault` is the latest
    complaint that was not taken back. A torque that the drive does not tell is NaN.
    """

    position_rad: NDArray[np.float64]
    velocity_rad_s: NDArray[np.float64]
    torque_nm: NDArray[np.float64]
    age_s: NDArray[np.float64]
    power_state: tuple[PowerState, ...]
    lost: tuple[bool, ...]
    faulted: tuple[bool, ...]
    fault: tuple[DriveFault | None, ...]
    enabled: bool

    @property
    def healthy(self) -> bool:
        """Tell whether no drive is lost or faulted."""
        return not any(self.lost) and not any(self.faulted)


class DriveBus(Protocol):
    """Command all wheel drives of one CAN bus; nothing but `connect` waits.

    Every drive stops by itself when the calls of `cycle` stop.
    """

    @property
    def enabled(self) -> bool:
        """Tell whether all drives follow their velocities."""
        ...

    @property
    def counters(self) -> dict[str, int]:
        """Return what the link and the drives have counted since the start."""
        ...

    @property
    def notes(self) -> tuple[str, ...]:
        """Return what the drives cannot do, in words; complete after connecting."""
        ...

    def connecting(self) -> Iterator[None]:
        """Check and configure every drive step by step; all end up disabled.

        A step never waits: it yields where it would, for the caller to step on later.

        Raises:
            NoReply: a drive does not answer in time.
            WrongDevice: a drive is not the one declared, or refuses a value.
            DeviceFault: a drive has a fault that no reset may take back.
            LinkLost: the bus has gone.
        """
        ...

    def connect(self) -> None:
        """Do all of `connecting`, waiting in between.

        Raises:
            DriverError: as `connecting` does.
        """
        ...

    def cycle(self, velocity_rad_s: NDArray[np.float64] | None) -> DriveState:
        """Read what has arrived, send setpoints and return the drives' state.

        Velocities are the joints', in the order of the specs; None, or drives that are not all
        enabled, sends zero.

        Raises:
            LinkLost: the bus has gone.
            ValueError: a velocity is not finite.
        """
        ...

    def enable(self) -> None:
        """Begin to power all drives; `enabled` tells when they follow."""
        ...

    def disable(self) -> None:
        """Take the power off all drives."""
        ...

    def quick_stop(self) -> None:
        """Let all drives brake on their ramp and then take their power off."""
        ...

    def reset_fault(self) -> tuple[str, ...]:
        """Take back what faults may be taken back, and return why the others may not."""
        ...

    def close(self) -> None:
        """Leave the drives without power and leave the bus; closing twice is allowed."""
        ...


class NodeBudget:
    """Count the cycles in which a node's answer was missing, and judge node and bus by them."""

    def __init__(self, names: Sequence[str]) -> None:
        self._budget = BusBudget(names, member=NODE_LIMITS)

    @property
    def lost(self) -> tuple[bool, ...]:
        """Tell of each node whether it answers too seldom to be driven."""
        return tuple(state is BudgetState.LOST for state in self._budget.members)

    @property
    def counters(self) -> dict[str, int]:
        """Return how many nodes are in trouble, and 1 where the bus itself is."""
        members = self._budget.members
        return {
            "degraded_nodes": members.count(BudgetState.DEGRADED),
            "lost_nodes": members.count(BudgetState.LOST),
            "bus_degraded": int(self._budget.bus is not BudgetState.OK),
        }

    def note_cycle(self, missing: Sequence[int], now_ns: int) -> None:
        """Note which nodes, by row, did not answer in the last cycle."""
        self._budget.note_cycle(missing, now_ns)

    def forget(self) -> None:
        """Start over, as with a new connection."""
        for row in range(len(self._budget.names)):
            self._budget.reset(row)


def wait_for(steps: Iterator[None], clock: Clock) -> None:
    """Run steps to their end, waiting a little between them."""
    for _ in steps:
        clock.sleep_until(clock.now_ns() + CONNECT_POLL_NS)


def side_by_side(runs: Sequence[Iterator[None]]) -> Iterator[None]:
    """Step several runs in turn until all have ended."""
    going = list(runs)
    while going:
        going = [run for run in going if _goes_on(run)]
        if going:
            yield


def _goes_on(run: Iterator[None]) -> bool:
    return next(run, _ENDED) is not _ENDED


_ENDED: Final = object()


def until(done: Callable[[], bool], clock: Clock, timeout_ns: int) -> Iterator[None]:
    """Yield until `done()` or the time is up; the caller judges which."""
    deadline_ns = clock.now_ns() + timeout_ns
    while not done() and clock.now_ns() <= deadline_ns:
        yield


FRAMES_BEFORE_YIELD: Final = 4


def listening(steps: Iterator[None], take_frames: Callable[[], bool]) -> Iterator[None]:
    """Hand steps what has arrived between any two of them; yield where nothing has.

    It yields now and then anyway, so that a chattering bus does not hold the caller up.
    """
    in_a_row = 0
    for _ in steps:
        in_a_row += 1
        if not take_frames() or in_a_row >= FRAMES_BEFORE_YIELD:
            in_a_row = 0
            yield
            take_frames()


def finite(velocity_rad_s: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the velocities.

    Raises:
        ValueError: one of them is NaN or infinite.
    """
    if not np.isfinite(velocity_rad_s).all():
        raise ValueError(f"velocities {velocity_rad_s.tolist()} rad/s: NaN or infinite")
    return velocity_rad_s
