"""Give an emulated drive a wheel to turn where no physics engine runs."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Generic, TypeVar

from drivers.clock import NS_PER_S
from sim_twin.can.bus.wire import CanWire
from sim_twin.can.emulated_drive import EmulatedDrive

STEP_NS: Final = 2_000_000


D_co = TypeVar("D_co", bound=EmulatedDrive, covariant=True)


@dataclass(slots=True)
class FreeWheel(Generic[D_co]):
    """Turn one wheel with nothing but inertia and viscous friction."""

    drive: D_co
    inertia_kg_m2: float = 0.05
    friction_nm_s: float = 0.05
    position_rad: float = 0.0
    velocity_rad_s: float = 0.0

    def step(self, now_ns: int, dt_s: float) -> None:
        """Let the drive act on the wheel for `dt_s`."""
        torque_nm = self.drive.advance(now_ns, self.position_rad, self.velocity_rad_s)
        torque_nm -= self.friction_nm_s * self.velocity_rad_s
        self.velocity_rad_s += torque_nm / self.inertia_kg_m2 * dt_s
        self.position_rad += self.velocity_rad_s * dt_s


class FreeWheelWorld(Generic[D_co]):
    """Be the smallest lock-step world: a clock whose waiting turns the wheels."""

    def __init__(self, wheels: Sequence[FreeWheel[D_co]], start_ns: int = NS_PER_S) -> None:
        self.wheels = tuple(wheels)
        self.wire = CanWire([wheel.drive for wheel in wheels])
        self._now_ns = start_ns

    def now_ns(self) -> int:
        """Return simulated time."""
        return self._now_ns

    def sleep_until(self, deadline_ns: int) -> None:
        """Step the wheels until simulated time reaches the deadline."""
        while self._now_ns < deadline_ns:
            self._now_ns += STEP_NS
            for wheel in self.wheels:
                wheel.step(self._now_ns, STEP_NS / NS_PER_S)
            self.wire.poll(self._now_ns)
