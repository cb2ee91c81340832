"""Drive a joint gently against both of its stops, and measure how its servo sits on it.

The goal creeps ahead of the servo by a bounded lead, so a servo whose host dies goes no further
than that, and presses with no more than its torque limit. A stop is where the servo stands for a
while although it gives what it may. Both stops are pressed alike, so what gives way there cancels
out in their middle. What the stops cannot show is the sign: that of the robot file is taken.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from statistics import median_low
from typing import Final

from drivers.clock import NS_PER_S, Clock
from drivers.errors import DriverError
from drivers.servo.joint_servo import JointServo
from drivers.servo.tools.bench import ServoBench
from drivers.servo.tools.calibration_guide import GuidedJoint, Person
from drivers.servo.tools.gentle_drive import DrivenSample, GentleDrive
from drivers.servo.tools.travel import (
    PULSE_RAD,
    ServoMounting,
    StopApproach,
    TravelLog,
    TravelRefused,
    judge_reach,
    judge_stops,
    mounting_at,
)

_PERIOD_S: Final = 0.02
_LEAD_PULSES: Final = 60
"""The goal is ahead by 5 degrees at most: more than puts the full duty on a servo of any family."""
_EDGE_PULSES: Final = 20
"""As far the goal stays off the ends of the turn: beyond them the count starts over."""
_STAND_SAMPLES: Final = 20
_STAND_PULSES: Final = 3
"""A servo stands that moved by less in 0.4 s; the slowest search goes ten times as far."""
_PRESSING_SHARE: Final = 0.7
"""Of the torque limit: a servo that stands and gives so much presses against something."""
_SPARE_S: Final = 5.0
_LONGEST_RATIO: Final = 1.3
_ARRIVED_PULSES: Final = 12


class StopSearch:
    """Measure joints of one bus, one at a time; the other servos are watched and not touched."""

    def __init__(
        self, bench: ServoBench, watched: Sequence[JointServo], person: Person, clock: Clock
    ) -> None:
        self._bench = bench
        self._watched = watched
        self._names = {servo.id: servo.joint for servo in watched}
        self._person = person
        self._clock = clock

    def mounting_of(self, joint: GuidedJoint, approach: StopApproach) -> ServoMounting:
        """Drive a joint to its lower stop, its upper stop, and back; return how its servo sits.

        However it ends, the servo has its own limits again, and torque only if it had it before.

        Raises:
            TravelRefused: what stopped the joint are not its stops.
            DriverError: the servo is silent, refuses, or reports an error; or the bus is lost.
        """
        with self._driven(joint, approach) as drive:
            start = drive.sense().pulse
            log = TravelLog(self._bench.positions(self._watched))
            down = -joint.range.sign
            first = self._stop(joint, approach, drive, down, log)
            last = self._stop(joint, approach, drive, -down, log)
            self._return(approach, drive, start)
        judge_stops(joint.range, last - first, approach.tolerance_rad)
        mounting = mounting_at(joint.range, (first + last) / 2, joint.range.middle)
        judge_reach(joint.range, mounting, *joint.limits)
        return mounting

    @contextmanager
    def _driven(self, joint: GuidedJoint, approach: StopApproach) -> Iterator[GentleDrive]:
        drive = self._bench.drive(joint.servo, approach.torque_ratio)
        try:
            drive.hold()
            yield drive
        finally:
            try:
                drive.let_go()
            except DriverError:
                self._person.tell(
                    f"{joint.name}: it may still press with {approach.torque_ratio:.0%} of its "
                    "torque: cut the servos' supply"
                )
                raise

    def _stop(
        self,
        joint: GuidedJoint,
        approach: StopApproach,
        drive: GentleDrive,
        direction: int,
        log: TravelLog,
    ) -> int:
        """Creep in one direction of the encoder until something stops the servo; return where.

        Raises:
            TravelRefused: it went too far, too long, ended at the end of its goals, or moved
                another joint.
        """
        low, high = drive.pulse_range[0] + _EDGE_PULSES, drive.pulse_range[1] - _EDGE_PULSES
        longest = joint.range.pulses * _LONGEST_RATIO
        deadline_ns = self._in(longest * PULSE_RAD / approach.speed_rad_s + _SPARE_S)
        pressing = _PRESSING_SHARE * approach.torque_ratio
        goal, samples = float(drive.sense().pulse), list[DrivenSample]()
        while True:
            sample = self._step(drive, goal)
            samples = [*samples[1 - _STAND_SAMPLES :], sample]
            self._watch(joint, log)
            if _stand(samples):
                if min(abs(one.duty_ratio) for one in samples) >= pressing:
                    return median_low([one.pulse for one in samples])
                if goal in (low, high):
                    raise TravelRefused(
                        f"{joint.name}: its servo takes goals from pulse {low} to {high} only, and "
                        "no stop was met before: see its position limits, or mount the horn anew"
                    )
            if abs(log.travel(joint.servo.id)) > longest or self._clock.now_ns() > deadline_ns:
                raise TravelRefused(f"{joint.name}: no stop was met; is the MJCF's range right?")
            goal += direction * _pulses_per_step(approach)
            goal = min(max(goal, sample.pulse - _LEAD_PULSES), sample.pulse + _LEAD_PULSES)
            goal = float(min(max(goal, low), high))

    def _return(self, approach: StopApproach, drive: GentleDrive, start: int) -> None:
        """Go back to where the joint was; where it does not get there, it stays."""
        sample = drive.sense()
        goal = float(sample.pulse)
        end_ns = self._in(abs(start - goal) * PULSE_RAD / approach.speed_rad_s + 1.0)
        step = _pulses_per_step(approach)
        while abs(sample.pulse - start) > _ARRIVED_PULSES and self._clock.now_ns() < end_ns:
            goal += min(max(start - goal, -step), step)
            sample = self._step(drive, goal)

    def _step(self, drive: GentleDrive, goal: float) -> DrivenSample:
        drive.go_to(round(goal))
        self._clock.sleep_until(self._in(_PERIOD_S))
        return drive.sense()

    def _watch(self, joint: GuidedJoint, log: TravelLog) -> None:
        log.feed(self._bench.positions(self._watched))
        if others := log.others_moved(joint.servo.id):
            names = ", ".join(self._names[one] for one in others)
            raise TravelRefused(
                f"{joint.name}: {names} moved too: put the arm into another pose, or hold it"
            )

    def _in(self, seconds: float) -> int:
        return self._clock.now_ns() + round(seconds * NS_PER_S)


def _pulses_per_step(approach: StopApproach) -> float:
    return approach.speed_rad_s / PULSE_RAD * _PERIOD_S


def _stand(samples: Sequence[DrivenSample]) -> bool:
    pulses = [one.pulse for one in samples]
    return len(pulses) == _STAND_SAMPLES and max(pulses) - min(pulses) < _STAND_PULSES
