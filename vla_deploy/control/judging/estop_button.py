"""Watch the robot's emergency-stop button, where it has one."""

from typing import Final

from drivers.clock import NS_PER_S, Clock
from drivers.estop.base import ButtonState, EstopInput
from drivers.estop.open_estop import open_estop
from drivers.estop.reopening import ReopeningEstop
from drivers.opener import DeviceOpener
from vla_deploy.robots import RobotDescription

SOURCE: Final = "button"
_SETTLE_NS: Final = NS_PER_S // 2
_POLL_NS: Final = 5_000_000


class EstopButton:
    """Name the button as the source of an emergency stop as long as it is not surely released."""

    def __init__(self, robot: RobotDescription, devices: DeviceOpener, clock: Clock) -> None:
        self._declared = robot.estop
        self._devices = devices
        self._clock = clock
        self._input: ReopeningEstop | None = None

    def open(self) -> None:
        """Open the button, and give it half a second to tell its state.

        Raises:
            DriverError: the robot file declares a button that is not there.
        """
        if self._declared is None:
            return
        button = self._input = ReopeningEstop(self._connect, self._clock)
        deadline_ns = self._clock.now_ns() + _SETTLE_NS
        while button.poll().state is ButtonState.UNKNOWN and self._clock.now_ns() < deadline_ns:
            self._clock.sleep_until(self._clock.now_ns() + _POLL_NS)

    def source(self) -> str | None:
        """Return who asks for an emergency stop and why, or None while the button is released."""
        if self._input is None:
            return None
        reading = self._input.poll()
        if not reading.pressed:
            return None
        if reading.state is ButtonState.PRESSED:
            return SOURCE
        return f"{SOURCE}: {reading.reason}"

    def close(self) -> None:
        """Release the button; closing twice is allowed."""
        if self._input is not None:
            self._input.close()
        self._input = None

    def _connect(self) -> EstopInput:
        assert self._declared is not None
        declared = self._declared
        return open_estop(
            declared.model, self._devices, declared.device, self._clock, number=declared.number
        )
