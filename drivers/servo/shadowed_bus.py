"""Drive joints that two servos of one bus turn together: a leader, and a shadow beside it."""

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from drivers.errors import DriverError
from drivers.servo.bus import ServoBusDriver
from drivers.servo.bus_view import BusView
from drivers.servo.errors import WrongServo
from drivers.servo.joint_servo import JointServo
from drivers.servo.state import BusState

MOST_APART_RAD: Final = 0.1
"""Further apart two servos of a joint are not held (chosen): at 1600 P that is all their torque."""

Floats = NDArray[np.float64]


class ShadowedBus(BusView):
    """Show each joint once: shadows get their leader's goals, and what they sense is joined to it.

    Both are commanded by their own ids, and their directions and offsets are the robot file's, so
    that no secondary id and no drive mode is needed. What is left of their distance is measured
    before they hold, and kept: one does not push against the other.
    """

    def __init__(self, bus: ServoBusDriver, leaders: Sequence[int]) -> None:
        """Take over a bus whose last servos are shadows; `leaders` are the places of theirs."""
        count = len(bus.servos) - len(leaders)
        super().__init__(bus, count)
        self._leaders = list(leaders)
        self._joint_of = [*range(count), *leaders]
        """The joint of each servo of the bus."""
        self._state = BusState.of(count)
        self._seen = BusState.of(len(bus.servos))
        self._apart: Floats = np.zeros(len(leaders))
        self._apart_known = False
        self._share = 1.0 / np.bincount(self._joint_of, minlength=count)
        self._servos_of: dict[int, list[int]] = {}
        for place, servo in enumerate(bus.servos):
            joint = self._joint_of[place]
            self._servos_of[servo.id] = [n for n, one in enumerate(self._joint_of) if one == joint]

    def read_state(self) -> BusState:
        """Refresh and return the state of all joints; of two servos the worse value counts.

        Raises:
            LinkLost: the adapter is gone.
        """
        self._seen = self._bus.read_state()
        if not self._apart_known:
            self._measure()
        self._join(self._seen)
        return self._state

    def write_goals(self, position_rad: Floats) -> None:
        """Send each joint's goal to its servos.

        Raises:
            ValueError: a goal is not finite, or there is not one per joint.
            LinkLost: the adapter is gone.
        """
        if position_rad.shape != (self._count,):
            raise ValueError(f"expected {self._count} goals, got shape {position_rad.shape}")
        goals = position_rad[self._joint_of]
        goals[self._count :] += self._apart
        self._bus.write_goals(goals)

    def limit_effort(self, ratios: Mapping[int, float]) -> dict[int, DriverError]:
        """Limit the servos of joints, by the id of one; return those that did not take it.

        Raises:
            LinkLost: the adapter is gone.
        """
        return self._bus.limit_effort(
            {one: ratio for servo_id, ratio in ratios.items() for one in self._ids([servo_id])}
        )

    def enable_torque(self, ids: Sequence[int] | None = None) -> None:
        """Hold joints, by the id of one of their servos, where they are.

        Raises:
            WrongServo: the servos of a joint are too far apart to hold it together.
            DriverError: a servo is silent, reports an error or refuses.
        """
        chosen = self._ids(ids)
        self._measure()
        for apart, leader, shadow in self._pairs():
            if shadow.id in chosen and not abs(apart) <= MOST_APART_RAD * shadow.travel_per_rad:
                raise WrongServo(
                    f"{shadow} stands {apart:+.3f} beside {leader}, expected at most "
                    f"{MOST_APART_RAD}: they would push against each other; seat its horn anew, or "
                    f"set its offset in the robot file to {shadow.offset_rad - apart:.4f}"
                )
        self._bus.enable_torque(chosen)

    def disable_torque(self, ids: Sequence[int] | None = None) -> dict[int, DriverError]:
        """Switch joints off, by the id of one of their servos; failures are returned by id.

        Raises:
            LinkLost: the adapter is gone.
        """
        return self._bus.disable_torque(self._ids(ids))

    def reboot(self, servo_id: int) -> None:
        """Restart those servos of a joint that report an error, or both where none does.

        Raises:
            DriverError: one does not answer.
        """
        places = self._servos_of[servo_id]
        errors = self._seen.error
        for place in [n for n in places if errors[n]] or places:
            self._bus.reboot(self._bus.servos[place].id)

    def _ids(self, ids: Sequence[int] | None) -> list[int]:
        """Return the ids of all servos of the joints that these ids belong to."""
        servos = self._bus.servos
        places = (
            range(len(servos)) if ids is None else [n for one in ids for n in self._servos_of[one]]
        )
        return [servos[place].id for place in dict.fromkeys(places)]

    def _pairs(self) -> list[tuple[float, JointServo, JointServo]]:
        """Return how far each shadow stands beside its leader, with both."""
        servos = self._bus.servos
        shadows = zip(self._apart, self._leaders, servos[self._count :], strict=True)
        return [(float(apart), servos[leader], shadow) for apart, leader, shadow in shadows]

    def _measure(self) -> None:
        """Take over how far shadows stand beside their leaders, where both have told."""
        position = self._seen.position_rad
        apart = position[self._count :] - position[self._leaders]
        if np.isfinite(apart).all():
            self._apart, self._apart_known = apart, True

    def _join(self, seen: BusState) -> None:
        state, count, leaders = self._state, self._count, self._leaders
        state.stamp_ns = seen.stamp_ns
        state.position_rad[:] = seen.position_rad[:count]
        state.velocity_rad_s[:] = seen.velocity_rad_s[:count]
        effort = np.bincount(self._joint_of, seen.effort_ratio, count) * self._share
        state.effort_ratio[:] = effort
        for name, worse in _WORSE:
            joined, all_of = getattr(state, name), getattr(seen, name)
            joined[:] = all_of[:count]
            worse.at(joined, leaders, all_of[count:])


_WORSE: Final[tuple[tuple[str, np.ufunc], ...]] = (
    ("voltage_v", np.minimum),
    ("temperature_c", np.maximum),
    ("climate_stamp_ns", np.minimum),
    ("age_s", np.maximum),
    ("valid", np.logical_and),
    ("alert", np.logical_or),
    ("error", np.bitwise_or),
    ("torque_on", np.logical_and),
    ("watchdog", np.minimum),
)
"""Which value of two servos counts for their joint."""
