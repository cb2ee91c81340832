"""Judge what a person did to a joint by hand, and work out its sign and offset.

Positions are pulses. While a joint is swept the servo's count may pass 0 or 4095 and start over, or
go on into another turn; only differences between neighbouring samples are used, so both are the
same here.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import degrees, pi
from statistics import median_low
from typing import Final

PULSES_PER_REV: Final = 4096
"""Of every servo that can be calibrated so: Dynamixel X, FEETECH STS and SMS."""
CENTRE_PULSE: Final = 2048
PULSE_RAD: Final = 2 * pi / PULSES_PER_REV
STILL_PULSES: Final = 6
"""Spread of a held joint: half a degree."""
MOVED_PULSES: Final = 40
"""Less than this, 3.5 degrees, is no movement."""
OTHER_MOVED_PULSES: Final = 170
"""How far another joint may swing along, 15 degrees, while one is swept."""
SHORTEST_RATIO: Final = 0.85
LONGEST_RATIO: Final = 1.10
"""Bounds of the swept travel over the joint's range; nobody hits both ends exactly."""


class TravelRefused(Exception):
    """Say why a movement tells nothing about a joint, and how to do it again."""


@dataclass(frozen=True, slots=True, kw_only=True)
class JointRange:
    """Say what the robot file and the MJCF know of a joint, in the joint's unit."""

    joint: str
    low: float
    high: float
    sign: int
    travel_per_rad: float

    @property
    def middle(self) -> float:
        """Return the middle of the travel."""
        return (self.low + self.high) / 2

    @property
    def pulses(self) -> float:
        """Return how many pulses the travel is."""
        return (self.high - self.low) / (self.travel_per_rad * PULSE_RAD)


@dataclass(frozen=True, slots=True, kw_only=True)
class ServoMounting:
    """Hold how a servo sits on its joint, as in the robot file."""

    sign: int
    offset: float


@dataclass(frozen=True, slots=True, kw_only=True)
class StopApproach:
    """Say how a joint is driven against its stops; all values are of the servo's shaft.

    `torque_ratio` is of the full duty. The travel may differ from the MJCF's by `tolerance_rad`,
    half of which is the most that the middle is then off.
    """

    torque_ratio: float
    speed_rad_s: float
    tolerance_rad: float = 0.06


class TravelLog:
    """Follow the servos of a bus through a sweep, over the ends of their turns."""

    def __init__(self, positions: Mapping[int, int]) -> None:
        self._last = dict(positions)
        self._total = dict.fromkeys(positions, 0)
        self._least = dict.fromkeys(positions, 0)
        self._most = dict.fromkeys(positions, 0)

    def feed(self, positions: Mapping[int, int]) -> None:
        """Take the next sample; a servo that is missing from it has its turn in the next one."""
        for servo_id, position in positions.items():
            if servo_id not in self._last:
                continue
            step = position - self._last[servo_id] + PULSES_PER_REV // 2
            total = self._total[servo_id] + step % PULSES_PER_REV - PULSES_PER_REV // 2
            self._last[servo_id] = position
            self._total[servo_id] = total
            self._least[servo_id] = min(self._least[servo_id], total)
            self._most[servo_id] = max(self._most[servo_id], total)

    def travel(self, servo_id: int) -> int:
        """Return how far a servo is from where it started, signed."""
        return self._total[servo_id]

    def others_moved(self, servo_id: int) -> list[int]:
        """Return the other servos that moved by more than they may swing along."""
        return [
            one
            for one in self._total
            if one != servo_id and self._most[one] - self._least[one] > OTHER_MOVED_PULSES
        ]


def held_position(joint: str, samples: Sequence[int]) -> int:
    """Return the position of a joint that is held still.

    Raises:
        TravelRefused: it moved meanwhile, or gave no position.
    """
    if not samples:
        raise TravelRefused(f"{joint}: the servo gave no position; check its power and cable")
    log = TravelLog({0: samples[0]})
    totals = []
    for sample in samples:
        log.feed({0: sample})
        totals.append(log.travel(0))
    if max(totals) - min(totals) > STILL_PULSES:
        raise TravelRefused(
            f"{joint}: it moved by {_degrees(max(totals) - min(totals))} while it was measured; "
            "hold it still until the next message"
        )
    return samples[0] + median_low(totals)


def judge_sweep(
    expected: JointRange, travel: int, others: Iterable[str], *, accept_sign: bool = False
) -> None:
    """Refuse a sweep from the lower to the upper end that cannot be the joint's.

    Raises:
        TravelRefused: the joint did not move, others moved, the travel does not fit the joint's
            range, or it went against the declared sign.
    """
    joint, moved = expected.joint, sorted(others)
    if abs(travel) < MOVED_PULSES:
        instead = f"; {', '.join(moved)} moved instead" if moved else ""
        raise TravelRefused(f"{joint}: it did not move{instead}; move {joint} from end to end")
    if moved:
        raise TravelRefused(
            f"{joint}: {', '.join(moved)} moved too; hold the others and move {joint} alone"
        )
    ratio = abs(travel) / expected.pulses
    if not SHORTEST_RATIO <= ratio <= LONGEST_RATIO:
        raise TravelRefused(
            f"{joint}: it moved by {_degrees(travel)}, its range "
            f"{expected.low:g}..{expected.high:g} is {_degrees(expected.pulses)}; move it from "
            "stop to stop, or correct the MJCF"
        )
    if (travel > 0) != (expected.sign > 0) and not accept_sign:
        raise TravelRefused(
            f"{joint}: it went against its declared sign {expected.sign}: begin at the lower end "
            f"({expected.low:g}); if the servo is mounted the other way round now, say "
            "--accept-sign"
        )


def judge_stops(expected: JointRange, travel: int, tolerance_rad: float) -> None:
    """Refuse a travel between two stops that are not the joint's.

    Raises:
        TravelRefused: it differs from the joint's range by more than the tolerance.
    """
    off_rad = (abs(travel) - expected.pulses) * PULSE_RAD
    if abs(off_rad) > tolerance_rad:
        raise TravelRefused(
            f"{expected.joint}: it was stopped at both ends of {_degrees(travel)}, its range "
            f"{expected.low:g}..{expected.high:g} is {_degrees(expected.pulses)}: "
            + ("something is in the way" if off_rad < 0 else "a stop gives way, or is not there")
            + ", or the MJCF is wrong"
        )


def mounting_of_sweep(expected: JointRange, first: int, travel: int) -> ServoMounting:
    """Return the mounting of a joint swept from its lower to its upper end."""
    return mounting_at(expected, first + travel / 2, expected.middle, sign=1 if travel > 0 else -1)


def mounting_at(
    expected: JointRange, position: float, value: float, *, sign: int | None = None
) -> ServoMounting:
    """Return the mounting of a joint that has a known value at a position.

    A servo knows its position within one turn only: of all offsets a turn apart, the one that is
    nearest to the middle of the range is taken.
    """
    sign = sign or expected.sign
    turn = 2 * pi * expected.travel_per_rad
    angle = (position - CENTRE_PULSE) * PULSE_RAD
    offset = value - sign * expected.travel_per_rad * angle
    offset += round((expected.middle - offset) / turn) * turn
    return ServoMounting(sign=sign, offset=offset)


def judge_reach(expected: JointRange, mounting: ServoMounting, low: float, high: float) -> None:
    """Refuse a mounting with which one turn of the servo does not cover the limits `low`..`high`.

    Raises:
        TravelRefused: the joint would cross the end of the encoder's turn.
    """
    half_turn = pi * expected.travel_per_rad
    if max(abs(low - mounting.offset), abs(high - mounting.offset)) <= half_turn:
        return
    angle = mounting.sign * (expected.middle - mounting.offset) / expected.travel_per_rad
    raise TravelRefused(
        f"{expected.joint}: its travel crosses the end of the servo's turn: its middle is at pulse "
        f"{CENTRE_PULSE + angle / PULSE_RAD:.0f}; mount the horn so that it is near {CENTRE_PULSE}"
    )


def _degrees(pulses: float) -> str:
    return f"{degrees(abs(pulses) * PULSE_RAD):.1f} degrees"
