"""Bring power on in small steps, one servo a tick, so that the bus cycle never waits for it."""

from drivers.clock import NS_PER_S, Clock
from vla_deploy.control.output.base_drive import BaseDrive
from vla_deploy.control.output.servos import ServoLine

CLEAR_NS = NS_PER_S // 2
ENABLE_NS = NS_PER_S


class Arming:
    """Clear what the last stop left behind, hold every servo where it is, then power the wheels.

    Each servo's Bus Watchdog is armed before its torque comes on; servos that hold already, under
    an armed watchdog, are left alone.
    """

    def __init__(self, servos: ServoLine, wheels: BaseDrive, clock: Clock) -> None:
        self.failure = ""
        self._servos = servos
        self._wheels = wheels
        self._clock = clock
        self._queue: list[int] = []
        self._cleared = False
        self._driving = False
        self._deadline_ns = 0

    def begin(self) -> None:
        """Start from the beginning."""
        self.failure = ""
        self._cleared = self._driving = False
        self._deadline_ns = self._clock.now_ns() + CLEAR_NS
        if self._servos.watchdog_tripped.any() and not self._servos.clear_watchdogs():
            self.failure = self._servos.failure
        self._wheels.reset_fault()

    def step(self) -> bool | None:
        """Do one tick's share: True when all is powered, False with `failure`, None before."""
        if self.failure:
            return False
        if not self._cleared:
            return self._wait_for_clear()
        if self._queue:
            if self._servos.energise(self._queue.pop(0)):
                return None
            self.failure = self._servos.failure
            return False
        return self._power_wheels()

    def _wait_for_clear(self) -> bool | None:
        if self._wheels.faulted:
            return self._unless_late(
                f"{self._wheels.name}: {self._wheels.failure or 'a drive does not leave its fault'}"
            )
        self._cleared = True
        self._queue = self._servos.unguarded.tolist()
        return None

    def _power_wheels(self) -> bool | None:
        if not self._wheels.has_wheels:
            return True
        if not self._driving:
            self._driving = True
            self._deadline_ns = self._clock.now_ns() + ENABLE_NS
            self._wheels.enable()
        if self._wheels.enabled:
            return True
        return self._unless_late(f"{self._wheels.name}: the drives do not enable")

    def _unless_late(self, failure: str) -> bool | None:
        if self._clock.now_ns() < self._deadline_ns:
            return None
        self.failure = failure
        return False
