"""Guide a person through the calibration of joints, and measure them; nothing is driven."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Protocol

from drivers.clock import NS_PER_S, Clock
from drivers.servo.joint_servo import JointServo
from drivers.servo.tools.bench import ServoBench
from drivers.servo.tools.travel import (
    JointRange,
    ServoMounting,
    TravelLog,
    held_position,
    judge_reach,
    judge_sweep,
    mounting_at,
    mounting_of_sweep,
)

_HELD_SAMPLES: Final = 12
_SAMPLE_PERIOD_NS: Final = NS_PER_S // 25


class Person(Protocol):
    """Move joints as asked, and confirm each step."""

    def tell(self, text: str) -> None:
        """Show a message."""
        ...

    def wait(self, text: str, meanwhile: Callable[[], None]) -> None:
        """Show what to do and return when it is done; call `meanwhile` repeatedly."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class GuidedJoint:
    """Describe a joint before its calibration; its limits are those of the robot file."""

    servo: JointServo
    range: JointRange
    limits: tuple[float, float]
    present: ServoMounting

    @property
    def name(self) -> str:
        """Return the joint's name."""
        return self.range.joint


class CalibrationGuide:
    """Measure joints of one bus; all its servos are watched, torque is off."""

    def __init__(
        self,
        bench: ServoBench,
        watched: Sequence[JointServo],
        person: Person,
        clock: Clock,
        *,
        accept_sign: bool = False,
    ) -> None:
        self._bench = bench
        self._watched = watched
        self._joints = {servo.id: servo.joint for servo in watched}
        self._person = person
        self._clock = clock
        self._accept_sign = accept_sign

    def by_ends(self, joint: GuidedJoint) -> ServoMounting:
        """Measure a joint that the person moves from its lower to its upper end.

        Raises:
            TravelRefused: the movement does not show the joint's mounting.
            LinkLost: the adapter is gone.
        """
        name, expected = joint.name, joint.range
        self._person.wait(
            f"{name}: move it to its LOWER end ({expected.low:g}), hold it", lambda: None
        )
        first = self._held(joint)
        log = TravelLog(self._positions())
        self._person.wait(
            f"{name}: move it to its UPPER end ({expected.high:g}), hold it",
            lambda: log.feed(self._positions()),
        )
        self._held(joint, log)
        travel, others = log.travel(joint.servo.id), log.others_moved(joint.servo.id)
        names = [self._joints[one] for one in others]
        judge_sweep(expected, travel, names, accept_sign=self._accept_sign)
        return _reaching(joint, mounting_of_sweep(expected, first, travel))

    def by_mark(self, joint: GuidedJoint, value: float) -> ServoMounting:
        """Measure a joint that the person moves to a mark whose value is known.

        Raises:
            TravelRefused: the joint was not held still.
            LinkLost: the adapter is gone.
        """
        self._person.wait(f"{joint.name}: move it to its mark for {value:g}, hold it", lambda: None)
        return self.as_it_stands({joint: value})[joint.name]

    def as_it_stands(self, values: Mapping[GuidedJoint, float]) -> dict[str, ServoMounting]:
        """Measure joints that stand at known values, all at once.

        Raises:
            TravelRefused: one of them is not still, or its turn would not cover its limits.
            LinkLost: the adapter is gone.
        """
        samples = self._samples()
        found = {}
        for joint, value in values.items():
            position = held_position(joint.name, _of(samples, joint.servo.id))
            found[joint.name] = _reaching(joint, mounting_at(joint.range, position, value))
        return found

    def _held(self, joint: GuidedJoint, log: TravelLog | None = None) -> int:
        samples = self._samples()
        if log is not None:
            for sample in samples:
                log.feed(sample)
        return held_position(joint.name, _of(samples, joint.servo.id))

    def _samples(self) -> list[dict[int, int]]:
        """Return the positions of half a second."""
        samples = []
        for _ in range(_HELD_SAMPLES):
            samples.append(self._positions())
            self._clock.sleep_until(self._clock.now_ns() + _SAMPLE_PERIOD_NS)
        return samples

    def _positions(self) -> dict[int, int]:
        return self._bench.positions(self._watched)


def _of(samples: Sequence[Mapping[int, int]], servo_id: int) -> list[int]:
    return [sample[servo_id] for sample in samples if servo_id in sample]


def _reaching(joint: GuidedJoint, mounting: ServoMounting) -> ServoMounting:
    judge_reach(joint.range, mounting, *joint.limits)
    return mounting
