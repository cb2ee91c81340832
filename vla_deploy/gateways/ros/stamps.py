"""Turn the run's monotonic stamps into ROS time, and back.

On a robot ROS time is the computer's wall clock; on the twin it is the twin's time, which goes out
on /clock. Where the wall clock is set meanwhile, later stamps follow it.
"""

import time
from typing import Final

from builtin_interfaces.msg import Time

from drivers.clock import NS_PER_S, Clock
from drivers.twin_clock import TwinClock


class RosTime:
    """Convert times of one run's clock."""

    def __init__(self, clock: Clock) -> None:
        self.clock: Final = clock
        self.is_simulated: Final = isinstance(clock, TwinClock)
        self._offset_ns = 0
        self.refresh()

    def refresh(self) -> None:
        """Follow the wall clock."""
        if not self.is_simulated:
            self._offset_ns = time.time_ns() - self.clock.now_ns()

    def stamp(self, run_ns: int) -> Time:
        """Return a moment of the run as a message's stamp."""
        seconds, nanoseconds = divmod(max(run_ns + self._offset_ns, 0), NS_PER_S)
        return Time(sec=seconds, nanosec=nanoseconds)

    def now(self) -> Time:
        """Return the present as a message's stamp."""
        return self.stamp(self.clock.now_ns())

    def now_ns(self) -> int:
        """Return the present in nanoseconds of ROS time."""
        return self.clock.now_ns() + self._offset_ns

    def run_ns(self, stamp: Time) -> int:
        """Return a message's stamp as a moment of the run."""
        return int(stamp.sec) * NS_PER_S + int(stamp.nanosec) - self._offset_ns

    def is_unset(self, stamp: Time) -> bool:
        """Return whether a sender has left the stamp out."""
        return not (stamp.sec or stamp.nanosec)
