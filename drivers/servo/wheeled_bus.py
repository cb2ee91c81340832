"""Show the joints of a bus whose last servos turn wheels, and the wheels beside them."""

from collections.abc import Sequence

from drivers.servo.bus import ServoBusDriver
from drivers.servo.bus_view import BusView
from drivers.servo.state import BusState


class WheeledBus(BusView):
    """Leave the wheels out of all that is told of joints; `wheels` is the state of theirs."""

    def __init__(self, bus: ServoBusDriver, wheel_count: int) -> None:
        """Take over a bus whose last servos turn wheels."""
        super().__init__(bus, len(bus.servos) - wheel_count)
        self._seen = BusState.of(len(bus.servos))
        self._show()

    def read_state(self) -> BusState:
        """Refresh the state of all servos and return that of joints.

        Raises:
            LinkLost: the adapter is gone.
        """
        seen = self._bus.read_state()
        if seen is not self._seen:
            self._seen = seen
            self._show()
        self._joints.stamp_ns = self.wheels.stamp_ns = seen.stamp_ns
        return self._joints

    def enable_torque(self, ids: Sequence[int] | None = None) -> None:
        """Hold servos, by default all but the wheels', where they are; wheels begin at rest.

        Raises:
            DriverError: a servo is silent, reports an error or refuses.
        """
        self._bus.enable_torque([servo.id for servo in self.servos] if ids is None else ids)

    def _show(self) -> None:
        self._joints = self._seen.part(slice(self._count))
        self.wheels = self._seen.part(slice(self._count, None))
