"""React as a servo's firmware does where torque, mode, goals or the watchdog change.

- torque on: the goal position becomes the present one, unless it was written since torque went off;
- a hardware error that Shutdown (63) names cuts torque, and only a reboot lets it come back: until
  then torque_enable takes a 1 without an error and stays 0;
- a tripped bus watchdog makes the present position the goal (velocity mode brakes, current and PWM
  mode go limp), clears the profile and refuses goals until 0 is written to it; position and
  velocity modes brake with their own gains, so a heavy joint swings out first.
"""

from collections.abc import Callable
from typing import Final

from drivers.dynamixel.tables.control_table import WATCHDOG_TRIPPED, OperatingMode
from sim_twin.servos.firmware.columns import TableColumns
from sim_twin.servos.firmware.motion import ServoMotion
from sim_twin.servos.firmware.watchdog import BusWatchdog
from sim_twin.servos.protocol.register_file import RegisterFile

_TORQUE_ON_BY_GOAL: Final = 0x08


class Reactions:
    """Change registers and control loops from inside, servo by servo.

    `stale` tells that registers have changed which the loops have not taken over.
    """

    def __init__(
        self,
        registers: RegisterFile,
        columns: TableColumns,
        motion: ServoMotion,
        *,
        trip_holds_present: bool,
    ) -> None:
        self.watchdog = BusWatchdog(columns)
        self.stale = True
        self._registers = registers
        self._columns = columns
        self._motion = motion
        self._trip_holds_present = trip_holds_present
        self._goal_is_fresh = [False] * len(registers)
        self._now_ns = 0
        self._on_change: dict[str, Callable[[int], None]] = {
            "torque_enable": self._on_torque,
            "operating_mode": self._on_mode,
        }
        self._on_write: dict[str, Callable[[int], None]] = {
            "bus_watchdog": self._on_watchdog,
            "goal_position": self._on_goal_position,
        }

    def set_time(self, now_ns: int) -> None:
        """Take over the time, and trip the watchdogs that ran out."""
        self._now_ns = now_ns
        if now_ns >= self.watchdog.earliest_ns:
            for row in self.watchdog.expired(now_ns):
                self._trip(row)

    def boot(self, row: int) -> None:
        """Begin with the present pose, whatever the goal was."""
        self._motion.home(row)
        self._goal_is_fresh[row] = False

    def start_watchdog(self, row: int) -> None:
        """Start, restart or stop the timer as the registers say."""
        self.watchdog.reload(row, self._now_ns)
        self.stale = True

    def follow_write(self, row: int, name: str, *, changed: bool) -> None:
        """Do what follows from a host's write."""
        if changed and name in self._on_change:
            self._on_change[name](row)
        if name in self._on_write:
            self._on_write[name](row)
        if changed and name != "goal_position":
            self.stale = True

    def raise_errors(self, row: int, bits: int) -> None:
        """Set hardware error bits, and cut torque where Shutdown names one of them."""
        columns = self._columns
        columns.hardware_error[row] |= bits
        if columns.hardware_error[row] & columns.shutdown[row] and columns.torque_enable[row]:
            self.cut_torque(row)

    def cut_torque(self, row: int) -> None:
        """Take the torque away; a goal from before no longer counts."""
        self._columns.torque_enable[row] = 0
        self._goal_is_fresh[row] = False
        self.watchdog.reload(row, self._now_ns)
        self.stale = True

    def _trip(self, row: int) -> None:
        columns = self._columns
        columns.bus_watchdog[row] = WATCHDOG_TRIPPED
        columns.profile_acceleration[row] = 0
        columns.profile_velocity[row] = 0
        if self._trip_holds_present:
            columns.goal_position[row] = self._motion.pulses[row]
            self._motion.restart(row)
        else:
            columns.goal_position[row] = round(float(self._motion.profile.position[row]))
            self._motion.profile.restart(row, float(columns.goal_position[row]))
        columns.goal_velocity[row] = 0
        mode = columns.operating_mode[row]
        if mode == OperatingMode.PWM:
            columns.goal_pwm[row] = 0
        if mode == OperatingMode.CURRENT:
            columns.goal_current[row] = 0
        self.stale = True

    def _on_torque(self, row: int) -> None:
        columns = self._columns
        if not columns.torque_enable[row] or columns.hardware_error[row] & columns.shutdown[row]:
            self.cut_torque(row)
            return
        if not self._goal_is_fresh[row]:
            columns.goal_position[row] = self._motion.pulses[row]
        self._motion.restart(row)
        self._motion.profile.on_goal(row)
        self.watchdog.reload(row, self._now_ns)

    def _on_mode(self, row: int) -> None:
        self._registers.tables[row].reset_motion_settings()
        self._goal_is_fresh[row] = False
        self._motion.home(row)

    def _on_watchdog(self, row: int) -> None:
        self.watchdog.reload(row, self._now_ns)

    def _on_goal_position(self, row: int) -> None:
        self._motion.goals_moved = True
        self._motion.profile.on_goal(row)
        if self._columns.torque_enable[row]:
            return
        self._goal_is_fresh[row] = True
        if self._columns.drive_mode[row] & _TORQUE_ON_BY_GOAL:
            self._columns.torque_enable[row] = 1
            self._on_torque(row)
            self.stale = True
