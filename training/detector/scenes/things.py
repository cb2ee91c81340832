"""Build the small household things in endless variety: one builder for each class."""

import itertools
import math
from collections.abc import Callable

from training.detector.scenes.parts import (
    ON_EDGE,
    ON_SIDE,
    UPRIGHT,
    UPSIDE_DOWN,
    Random,
    RestPose,
    SceneThing,
    SolidPart,
    about_y,
    about_z,
    between,
    lathe,
    product,
    rod,
)


def cup(random: Random) -> SceneThing:
    """Return a mug or tumbler, turned or made of staves as the flat's own."""
    height, rim = between(random, 0.07, 0.125), between(random, 0.03, 0.048)
    foot = rim * between(random, 0.7, 1.0)
    handle = random.random() < 0.85
    wall = _staves if random.random() < 0.4 else _turned
    parts = wall(height, rim, foot)
    if random.random() < 0.3:
        level = between(random, 0.1, 0.4) * height
        parts.append(_disc(0.85 * foot, 0.001, level, "accent"))
    if handle:
        parts += _handle(rim, foot, height, between(random, 0.018, 0.032))
    rests = (
        RestPose(quat=UPRIGHT, height_m=height / 2, weight=6),
        RestPose(quat=ON_SIDE, height_m=rim),
        RestPose(quat=UPSIDE_DOWN, height_m=height / 2, weight=0.5),
    )
    return SceneThing(
        class_name="cup", parts=tuple(parts), rests=rests, radius_m=rim + 0.02 * handle
    )


def _turned(height: float, rim: float, foot: float) -> list[SolidPart]:
    h, wall = height / 2, 0.004
    outline = [
        (0.0, -h), (foot, -h), (rim, h),
        (rim - wall, h), (foot - wall, -h + 0.006), (0.0, -h + 0.006),
    ]  # fmt: skip
    inside = _disc(foot - wall, 0.0008, -h + 0.008, "inner")
    return [SolidPart(kind="mesh", mesh=lathe(outline)), inside]


def _staves(height: float, rim: float, foot: float) -> list[SolidPart]:
    count, h = 14, height / 2
    mean, lean = (rim + foot) / 2, math.atan2(rim - foot, height)
    half = math.pi * mean / count * 1.1
    staves = []
    for k in range(count):
        angle = 2 * math.pi * k / count
        at = (mean * math.cos(angle), mean * math.sin(angle), 0.0)
        turn = product(about_z(angle), about_y(lean))
        staves.append(SolidPart(kind="box", size=(0.0025, half, h), at=at, quat=turn))
    return [
        *staves,
        _disc(foot, 0.004, -h + 0.004),
        _disc(foot - 0.003, 0.001, -h + 0.009, "inner"),
    ]


def _handle(rim: float, foot: float, height: float, out: float) -> list[SolidPart]:
    x, far, up = (rim + foot) / 2, (rim + foot) / 2 + out, 0.26 * height
    corners = [
        (x - 0.002, 0.0, up),
        (far, 0.0, up * 0.9),
        (far, 0.0, -up * 0.8),
        (x - 0.004, 0.0, -up),
    ]
    return [rod(a, b, 0.0045) for a, b in itertools.pairwise(corners)]


def _disc(radius: float, half: float, z: float, role: str = "main") -> SolidPart:
    return SolidPart(kind="cylinder", size=(radius, half, 0.0), at=(0.0, 0.0, z), role=role)


def ball(random: Random) -> SceneThing:
    """Return a ball from marble-run to football size."""
    radius = between(random, 0.02, 0.05) if random.random() < 0.7 else between(random, 0.05, 0.11)
    parts = [SolidPart(kind="sphere", size=(radius, 0.0, 0.0))]
    if random.random() < 0.25:
        parts.append(_disc(radius * 1.004, radius * between(random, 0.06, 0.2), 0.0, "accent"))
    rests = (RestPose(quat=UPRIGHT, height_m=radius), RestPose(quat=ON_SIDE, height_m=radius))
    return SceneThing(class_name="ball", parts=tuple(parts), rests=rests, radius_m=radius)


def book(random: Random) -> SceneThing:
    """Return a closed book with covers, back and leaves; it lies or stands."""
    length = between(random, 0.14, 0.29)
    width = length * between(random, 0.42, 0.8)
    thick = between(random, 0.012, 0.045)
    a, b, c, cover = length / 2, width / 2, thick / 2, 0.0025
    parts = [
        SolidPart(kind="box", size=(a, b, cover), at=(0, 0, c - cover)),
        SolidPart(kind="box", size=(a, b, cover), at=(0, 0, -c + cover)),
        SolidPart(kind="box", size=(a, cover, c), at=(0, -b + cover, 0)),
        SolidPart(
            kind="box", size=(a - 0.003, b - 0.003, c - cover), at=(0, 0.001, 0), role="paper"
        ),
    ]
    if random.random() < 0.6:
        size = (a * between(random, 0.2, 0.7), b * between(random, 0.2, 0.8), 0.0006)
        at = (between(random, -0.2, 0.2) * a, between(random, -0.15, 0.15) * b, c)
        parts.append(SolidPart(kind="box", size=size, at=at, role="accent"))
    rests = (
        RestPose(quat=UPRIGHT, height_m=c, weight=5),
        RestPose(quat=UPSIDE_DOWN, height_m=c, weight=2),
        RestPose(quat=ON_EDGE, height_m=b),
        RestPose(quat=ON_SIDE, height_m=a),
    )
    radius = 0.5 * math.hypot(a, b) + 0.25 * (a + b)
    return SceneThing(
        class_name="book", parts=tuple(parts), rests=rests, radius_m=radius, top_m=thick
    )


def bottle(random: Random) -> SceneThing:
    """Return a bottle with neck, cap and label; it stands or lies."""
    radius, body = between(random, 0.026, 0.045), between(random, 0.1, 0.2)
    neck, long = radius * between(random, 0.3, 0.5), between(random, 0.03, 0.08)
    shoulder = between(random, 0.012, 0.045)
    height = body + shoulder + long
    low = -height / 2
    if random.random() < 0.5:
        outline = [
            (0, low), (radius, low), (radius, low + body),
            (0.75 * radius, low + body + 0.6 * shoulder), (neck, low + body + shoulder),
            (neck, -low), (0, -low),
        ]  # fmt: skip
        parts = [SolidPart(kind="mesh", mesh=lathe(outline))]
    else:
        parts = [
            _disc(radius, body / 2, low + body / 2),
            SolidPart(kind="ellipsoid", size=(radius, radius, shoulder), at=(0, 0, low + body)),
            _disc(neck, (height - body) / 2, low + body + (height - body) / 2),
        ]
    cap = between(random, 0.006, 0.012)
    parts.append(_disc(neck * 1.12, cap, -low - cap + 0.001, "accent"))
    if random.random() < 0.7:
        half = body * between(random, 0.12, 0.35)
        parts.append(_disc(radius * 1.012, half, low + body * between(random, 0.4, 0.6), "label"))
    rests = (
        RestPose(quat=UPRIGHT, height_m=height / 2, weight=4),
        RestPose(quat=ON_SIDE, height_m=radius, weight=1.5),
    )
    return SceneThing(class_name="bottle", parts=tuple(parts), rests=rests, radius_m=radius)


def phone(random: Random) -> SceneThing:
    """Return a telephone, its face up or down."""
    a, b, c = (
        between(random, 0.065, 0.083),
        between(random, 0.031, 0.039),
        between(random, 0.004, 0.006),
    )
    edge = between(random, 0.002, 0.005)
    parts = [
        SolidPart(kind="box", size=(a, b, c), role="shell"),
        SolidPart(kind="box", size=(a - edge, b - edge, 0.0005), at=(0, 0, c), role="screen"),
    ]
    if random.random() < 0.8:
        x, y = a - 0.018, b - 0.013
        parts.append(SolidPart(kind="box", size=(0.013, 0.009, 0.001), at=(x, y, -c), role="dark"))
        parts.append(
            SolidPart(kind="cylinder", size=(0.004, 0.0016, 0), at=(x, y, -c), role="metal")
        )
    rests = (
        RestPose(quat=UPRIGHT, height_m=c, weight=4),
        RestPose(quat=UPSIDE_DOWN, height_m=c, weight=2),
        RestPose(quat=product(about_y(-1.15), UPRIGHT), height_m=0.92 * a, weight=0.6),
    )
    return SceneThing(class_name="phone", parts=tuple(parts), rests=rests, radius_m=a * 0.9)


def keys(random: Random) -> SceneThing:
    """Return a bunch of keys: a ring, one to four keys, often a fob."""
    ring = between(random, 0.011, 0.018)
    parts = [SolidPart(kind="cylinder", size=(ring, 0.002, 0), at=(0, 0, -0.003), role="metal")]
    if random.random() < 0.75:
        long = between(random, 0.015, 0.03)
        kind = "box" if random.random() < 0.7 else "ellipsoid"
        size = (long, between(random, 0.009, 0.016), between(random, 0.004, 0.008))
        parts.append(SolidPart(kind=kind, size=size, at=(ring + long - 0.004, 0, 0.002)))
    start = between(random, 2.2, 3.2)
    for k in range(int(random.integers(1, 5))):
        parts += _key(
            start + 0.45 * k + between(random, -0.1, 0.1), ring, 0.0016 * k - 0.005, random
        )
    rests = (
        RestPose(quat=UPRIGHT, height_m=0.007, weight=3),
        RestPose(quat=UPSIDE_DOWN, height_m=0.007),
    )
    return SceneThing(class_name="keys", parts=tuple(parts), rests=rests, radius_m=0.045)


def _key(angle: float, ring: float, z: float, random: Random) -> list[SolidPart]:
    x, y, turn = math.cos(angle), math.sin(angle), about_z(angle)
    head, blade = between(random, 0.008, 0.012), between(random, 0.012, 0.02)
    bow, tip = ring + head * 0.6, ring + head * 1.4 + blade
    return [
        SolidPart(kind="cylinder", size=(head, 0.0013, 0), at=(bow * x, bow * y, z), role="metal"),
        SolidPart(
            kind="box",
            size=(blade, 0.0038, 0.0012),
            at=(tip * x, tip * y, z),
            quat=turn,
            role="metal",
        ),
    ]


def box(random: Random) -> SceneThing:
    """Return an open storage box, or a closed one with tape."""
    a, b = between(random, 0.075, 0.19), between(random, 0.075, 0.16)
    half = between(random, 0.035, 0.11)
    if random.random() < 0.25:
        parts = [
            SolidPart(kind="box", size=(a, b, half)),
            SolidPart(kind="box", size=(a * 1.002, b * 0.12, half * 1.004), role="accent"),
        ]
        inside = None
    else:
        wall = between(random, 0.002, 0.006)
        parts = [SolidPart(kind="box", size=(a, b, 0.004), at=(0, 0, -half + 0.004), role="inner")]
        for sign in (-1, 1):
            side = (sign * (a - wall), 0.0, 0.0)
            end = (0.0, sign * (b - wall), 0.0)
            parts.append(SolidPart(kind="box", size=(wall, b, half), at=side))
            parts.append(SolidPart(kind="box", size=(a - 2 * wall, wall, half), at=end))
        inside = (min(a, b) - wall, 0.008)
    rests = (RestPose(quat=UPRIGHT, height_m=half, weight=9), RestPose(quat=ON_SIDE, height_m=a))
    return SceneThing(
        class_name="box", parts=tuple(parts), rests=rests, radius_m=math.hypot(a, b), inside=inside
    )


def bowl(random: Random) -> SceneThing:
    """Return a turned bowl, shallow or deep."""
    rim, height = between(random, 0.055, 0.13), between(random, 0.035, 0.075)
    height = min(height, rim)
    foot, wall = rim * between(random, 0.3, 0.55), between(random, 0.003, 0.006)
    h, belly = height / 2, between(random, 0.75, 0.95)
    outline = [
        (0, -h), (foot, -h), (foot, -h + 0.005), (rim * belly, -0.1 * h), (rim, h), (rim - wall, h),
        (rim * belly - wall, 0.0), (foot * 0.9, -h + 0.012), (0, -h + 0.011),
    ]  # fmt: skip
    parts = [SolidPart(kind="mesh", mesh=lathe(outline, sides=24))]
    parts.append(_disc(foot * 0.88, 0.0008, -h + 0.0135, "inner"))
    rests = (
        RestPose(quat=UPRIGHT, height_m=h, weight=8),
        RestPose(quat=UPSIDE_DOWN, height_m=h),
    )
    return SceneThing(
        class_name="bowl", parts=tuple(parts), rests=rests, radius_m=rim, inside=(rim * 0.6, 0.014)
    )


def can(random: Random) -> SceneThing:
    """Return a tin or a drinks can with metal ends; it stands or lies."""
    radius, half = between(random, 0.026, 0.042), between(random, 0.04, 0.068)
    end = between(random, 0.003, 0.007)
    parts = [
        _disc(radius, half - end, 0.0),
        _disc(radius * 0.94, half, 0.0, "metal"),
        _disc(radius * 0.82, 0.0006, half, "accent" if random.random() < 0.3 else "metal"),
    ]
    if random.random() < 0.85:
        z = between(random, -0.2, 0.2) * half
        parts.append(_disc(radius * 1.006, half * between(random, 0.25, 0.6), z, "label"))
    if random.random() < 0.5:
        tab = (0.009, 0.005, 0.001)
        parts.append(SolidPart(kind="box", size=tab, at=(0.006, 0, half + 0.001), role="metal"))
    rests = (
        RestPose(quat=UPRIGHT, height_m=half, weight=4),
        RestPose(quat=ON_SIDE, height_m=radius, weight=1.5),
    )
    return SceneThing(class_name="can", parts=tuple(parts), rests=rests, radius_m=radius)


def remote(random: Random) -> SceneThing:
    """Return a remote control: a slim bar with rows of buttons."""
    a, b, c = (
        between(random, 0.07, 0.11),
        between(random, 0.018, 0.027),
        between(random, 0.006, 0.012),
    )
    parts = [SolidPart(kind="box", size=(a, b, c), role="shell")]
    columns, rows = int(random.integers(2, 4)), int(random.integers(4, 9))
    size = 0.28 * b if columns == 3 else 0.36 * b
    kind = "box" if random.random() < 0.5 else "cylinder"
    for row in range(rows):
        for column in range(columns):
            x = a * (0.85 - 1.5 * row / (rows - 1))
            y = 0.62 * b * (2 * column / (columns - 1) - 1)
            role = "accent" if random.random() < 0.12 else "buttons"
            button = (size, size, 0.0012) if kind == "box" else (size, 0.0012, 0.0)
            parts.append(SolidPart(kind=kind, size=button, at=(x, y, c), role=role))
    rests = (
        RestPose(quat=UPRIGHT, height_m=c, weight=6),
        RestPose(quat=UPSIDE_DOWN, height_m=c),
    )
    return SceneThing(class_name="remote", parts=tuple(parts), rests=rests, radius_m=a * 0.9)


BUILDERS: dict[str, Callable[[Random], SceneThing]] = {
    "cup": cup,
    "ball": ball,
    "book": book,
    "bottle": bottle,
    "phone": phone,
    "keys": keys,
    "box": box,
    "bowl": bowl,
    "can": can,
    "remote": remote,
}
