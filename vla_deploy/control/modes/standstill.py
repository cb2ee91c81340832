"""Tell when a stop has ended, also when the wheels turn on though nothing tells them to."""

from typing import Final

from drivers.clock import NS_PER_S

TURN_ON_NS: Final = 2 * NS_PER_S  # longer than any wheel brakes after its setpoint rests


class Standstill:
    """Follow how long nothing has been told to move.

    Wheels that still turn two seconds later do not keep a stop from ending: from then on their
    standstill is judged, power that has to go goes, and a person may reset.
    """

    def __init__(self) -> None:
        self._since_ns: int | None = None

    def reached(self, now_ns: int, *, setpoints_rest: bool, wheels_still: bool) -> bool:
        """Return whether the robot counts as at rest; call it in every tick."""
        if not setpoints_rest:
            self._since_ns = None
            return False
        if self._since_ns is None:
            self._since_ns = now_ns
        return wheels_still or now_ns - self._since_ns >= TURN_ON_NS
