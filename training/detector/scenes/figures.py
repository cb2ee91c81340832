"""Build people and chairs, the obstacles that the robot must know."""

import math
from collections.abc import Callable

from training.detector.scenes.parts import (
    UPRIGHT,
    Random,
    RestPose,
    SceneThing,
    SolidPart,
    Vector,
    about_x,
    between,
    rod,
)


def person(random: Random) -> SceneThing:
    """Return a standing or sitting person of 1.5 to 1.95 m; the origin is on the floor."""
    tall = between(random, 1.5, 1.95)
    sitting = random.random() < 0.3
    hip = 0.47 if sitting else 0.5 * tall
    parts: list[SolidPart] = []
    for side in (-1, 1):
        parts += _leg(side, hip, tall, sitting, random)
        parts += _arm(side, hip, tall, random)
    parts += _trunk(hip, tall, random)
    rests = (RestPose(quat=UPRIGHT, height_m=0.0),)
    return SceneThing(class_name="person", parts=tuple(parts), rests=rests, radius_m=0.4)


def _leg(side: int, hip: float, tall: float, sitting: bool, random: Random) -> list[SolidPart]:
    thick, y = between(random, 0.055, 0.085), side * 0.05 * tall
    step = 0.0 if sitting else between(random, -0.2, 0.2)
    knee: Vector = (0.42, y * 1.2, hip) if sitting else (step * 0.6, y, 0.27 * tall)
    ankle: Vector = (knee[0] + between(random, -0.1, 0.15) * sitting + step * 0.3, y, 0.07)
    toe: Vector = (ankle[0] + 0.16, y * 1.15, 0.04)
    return [
        rod((0.0, y, hip), knee, thick, "trousers"),
        rod(knee, ankle, thick * 0.8, "trousers"),
        rod((ankle[0] - 0.03, y, 0.04), toe, 0.042, "dark"),
    ]


def _arm(side: int, hip: float, tall: float, random: Random) -> list[SolidPart]:
    shoulder: Vector = (0.0, side * 0.115 * tall, hip + 0.28 * tall)
    swing, out = between(random, -0.4, 1.0), between(random, 0.0, 0.35)
    upper, lower = 0.165 * tall, 0.15 * tall
    elbow = _along(shoulder, upper, swing, side * out)
    hand = _along(elbow, lower, swing + between(random, 0.0, 1.4), side * out * 0.5)
    sleeve = "main" if random.random() < 0.6 else "skin"
    ball = SolidPart(kind="sphere", size=(0.045, 0, 0), at=hand, role="skin")
    return [rod(shoulder, elbow, 0.045, "main"), rod(elbow, hand, 0.036, sleeve), ball]


def _along(start: Vector, length: float, swing: float, out: float) -> Vector:
    x, y, z = math.sin(swing), math.sin(out) * math.cos(swing), -math.cos(out) * math.cos(swing)
    return (start[0] + length * x, start[1] + length * y, start[2] + length * z)


def _trunk(hip: float, tall: float, random: Random) -> list[SolidPart]:
    wide, deep = between(random, 0.15, 0.21), between(random, 0.1, 0.15)
    chest, head = hip + 0.17 * tall, hip + 0.43 * tall
    hair = between(random, 0.0, 0.03)
    return [
        SolidPart(
            kind="ellipsoid", size=(deep, wide * 0.95, 0.11), at=(0, 0, hip + 0.04), role="trousers"
        ),
        SolidPart(kind="ellipsoid", size=(deep, wide, 0.17 * tall), at=(0, 0, chest)),
        SolidPart(kind="capsule", size=(0.05, 0.05, 0), at=(0, 0, hip + 0.34 * tall), role="skin"),
        SolidPart(kind="ellipsoid", size=(0.095, 0.078, 0.115), at=(0.01, 0, head), role="skin"),
        SolidPart(
            kind="ellipsoid", size=(0.1, 0.086, 0.1), at=(-0.02, 0, head + 0.02 + hair), role="hair"
        ),
    ]


def chair(random: Random) -> SceneThing:
    """Return a chair with legs, an office chair, or a stool; the origin is on the floor."""
    builder = CHAIRS[int(random.choice(len(CHAIRS), p=(0.55, 0.25, 0.2)))]
    return SceneThing(
        class_name="chair",
        parts=tuple(builder(random)),
        rests=(RestPose(quat=UPRIGHT, height_m=0.0),),
        radius_m=0.35,
    )


def _dining(random: Random) -> list[SolidPart]:
    a, seat, thick = (
        between(random, 0.18, 0.24),
        between(random, 0.4, 0.48),
        between(random, 0.012, 0.035),
    )
    leg = between(random, 0.012, 0.022)
    top = seat + between(random, 0.32, 0.5)
    parts = [SolidPart(kind="box", size=(a, a, thick), at=(0, 0, seat), role="seat")]
    for x in (-1, 1):
        for y in (-1, 1):
            foot = (x * a * between(random, 0.95, 1.1), y * (a - leg), 0.0)
            parts.append(rod((x * (a - leg), y * (a - leg), seat), foot, leg))
    back = [
        rod((-a + leg, y * (a - leg), seat), (-a - 0.04, y * (a - leg), top), leg) for y in (-1, 1)
    ]
    return parts + back + _back(a, seat, top, random)


def _back(a: float, seat: float, top: float, random: Random) -> list[SolidPart]:
    lean = about_x(0.0)
    if random.random() < 0.5:
        half, z = (top - seat) * between(random, 0.2, 0.42), (top - seat) * 0.55 + seat
        return [
            SolidPart(
                kind="box", size=(0.012, a, half), at=(-a - 0.02, 0, z), quat=lean, role="seat"
            )
        ]
    rows = int(random.integers(2, 5))
    heights = [seat + (top - seat) * (0.35 + 0.6 * k / rows) for k in range(rows + 1)]
    return [SolidPart(kind="box", size=(0.009, a, 0.018), at=(-a - 0.02, 0, z)) for z in heights]


def _office(random: Random) -> list[SolidPart]:
    a, seat = between(random, 0.2, 0.26), between(random, 0.42, 0.52)
    high = between(random, 0.2, 0.34)
    parts = [
        SolidPart(kind="box", size=(a, a, 0.04), at=(0, 0, seat), role="seat"),
        SolidPart(
            kind="box", size=(0.035, a * 0.9, high), at=(-a, 0, seat + 0.1 + high), role="seat"
        ),
        rod((0, 0, 0.08), (0, 0, seat), 0.028),
    ]
    for k in range(5):
        angle = 2 * math.pi * k / 5
        end = (0.28 * math.cos(angle), 0.28 * math.sin(angle), 0.05)
        parts.append(rod((0, 0, 0.09), end, 0.02))
        parts.append(
            SolidPart(kind="sphere", size=(0.03, 0, 0), at=(end[0], end[1], 0.03), role="dark")
        )
    return parts


def _stool(random: Random) -> list[SolidPart]:
    radius, seat = between(random, 0.14, 0.2), between(random, 0.36, 0.5)
    parts = [SolidPart(kind="cylinder", size=(radius, 0.025, 0), at=(0, 0, seat), role="seat")]
    if random.random() < 0.5:
        return [*parts, SolidPart(kind="cylinder", size=(0.03, seat / 2, 0), at=(0, 0, seat / 2))]
    for k in range(4):
        angle = math.pi / 4 + math.pi / 2 * k
        x, y = radius * math.cos(angle), radius * math.sin(angle)
        parts.append(rod((0.7 * x, 0.7 * y, seat), (x, y, 0.0), 0.015))
    return parts


CHAIRS: tuple[Callable[[Random], list[SolidPart]], ...] = (_dining, _office, _stool)
BUILDERS: dict[str, Callable[[Random], SceneThing]] = {"person": person, "chair": chair}
