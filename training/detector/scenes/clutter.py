"""Build what lies around in homes and must not be taken for one of the classes."""

import itertools
import math
from collections.abc import Callable

from training.detector.classes import CLUTTER
from training.detector.scenes.parts import (
    ON_SIDE,
    UPRIGHT,
    Random,
    RestPose,
    SceneThing,
    SolidPart,
    between,
    lathe,
    rod,
)


def _thing(parts: list[SolidPart], rests: tuple[RestPose, ...], radius_m: float) -> SceneThing:
    return SceneThing(class_name=CLUTTER, parts=tuple(parts), rests=rests, radius_m=radius_m)


def block(random: Random) -> SceneThing:
    """Return a toy brick."""
    a, b, c = (between(random, 0.012, 0.03) for _ in range(3))
    parts = [SolidPart(kind="box", size=(a, b, c))]
    return _thing(parts, (RestPose(quat=UPRIGHT, height_m=c),), max(a, b) * 1.3)


def pen(random: Random) -> SceneThing:
    """Return a pen."""
    half, radius = between(random, 0.05, 0.08), between(random, 0.004, 0.007)
    parts = [
        rod((-half, 0, 0), (half, 0, 0), radius),
        rod((half * 0.7, 0, 0), (half, 0, 0), radius * 1.1, "accent"),
    ]
    return _thing(parts, (RestPose(quat=UPRIGHT, height_m=radius),), half * 0.7)


def plate(random: Random) -> SceneThing:
    """Return a flat plate."""
    rim, high = between(random, 0.07, 0.13), between(random, 0.008, 0.014)
    outline = [
        (0.0, 0.0),
        (rim * 0.6, 0.0),
        (rim, high),
        (rim * 0.98, high + 0.003),
        (rim * 0.6, 0.004),
        (0.0, 0.004),
    ]
    parts = [SolidPart(kind="mesh", mesh=lathe(outline, sides=24))]
    return _thing(parts, (RestPose(quat=UPRIGHT, height_m=0.001),), rim)


def banana(random: Random) -> SceneThing:
    """Return a bent fruit."""
    bend, long, radius = (
        between(random, 0.06, 0.1),
        between(random, 0.9, 1.4),
        between(random, 0.013, 0.018),
    )
    angles = [long * (k / 4 - 0.5) for k in range(5)]
    points = [(bend * math.cos(t) - bend, bend * math.sin(t), 0.0) for t in angles]
    parts = [rod(a, b, radius) for a, b in itertools.pairwise(points)]
    return _thing(parts, (RestPose(quat=UPRIGHT, height_m=radius),), 0.06)


def tool(random: Random) -> SceneThing:
    """Return a screwdriver."""
    grip, shaft = between(random, 0.04, 0.06), between(random, 0.05, 0.1)
    thick = between(random, 0.01, 0.016)
    parts = [
        rod((-grip, 0, 0), (grip * 0.6, 0, 0), thick),
        rod((grip * 0.6, 0, 0), (grip + shaft, 0, 0), 0.004, "metal"),
    ]
    return _thing(parts, (RestPose(quat=UPRIGHT, height_m=thick),), grip + shaft * 0.6)


def lamp(random: Random) -> SceneThing:
    """Return a table lamp."""
    high, shade = between(random, 0.2, 0.4), between(random, 0.07, 0.13)
    outline = [(0.0, 0.0), (shade, 0.0), (shade * 0.6, shade * 1.2), (0.0, shade * 1.2)]
    parts = [
        SolidPart(kind="cylinder", size=(shade * 0.6, 0.012, 0), at=(0, 0, 0.012)),
        rod((0, 0, 0.02), (0, 0, high), 0.01),
        SolidPart(kind="mesh", mesh=lathe(outline), at=(0, 0, high), role="label"),
    ]
    return _thing(parts, (RestPose(quat=UPRIGHT, height_m=0.0),), shade)


def plant(random: Random) -> SceneThing:
    """Return a plant in a pot."""
    pot, leaf = between(random, 0.04, 0.1), between(random, 0.08, 0.2)
    outline = [(0.0, 0.0), (pot * 0.75, 0.0), (pot, pot * 1.5), (0.0, pot * 1.5)]
    parts = [SolidPart(kind="mesh", mesh=lathe(outline))]
    for _ in range(int(random.integers(4, 9))):
        angle, out = between(random, 0, 6.28), between(random, 0.1, 0.8)
        tip = (
            leaf * out * math.cos(angle),
            leaf * out * math.sin(angle),
            pot * 1.5 + leaf * (1.1 - out * 0.5),
        )
        parts.append(
            SolidPart(
                kind="ellipsoid", size=(leaf * 0.3, leaf * 0.2, leaf * 0.4), at=tip, role="leaf"
            )
        )
    return _thing(parts, (RestPose(quat=UPRIGHT, height_m=0.0),), pot * 1.3)


def cushion(random: Random) -> SceneThing:
    """Return a cushion."""
    a, c = between(random, 0.12, 0.22), between(random, 0.05, 0.09)
    parts = [SolidPart(kind="ellipsoid", size=(a, a * between(random, 0.7, 1.0), c))]
    rests = (RestPose(quat=UPRIGHT, height_m=c), RestPose(quat=ON_SIDE, height_m=a))
    return _thing(parts, rests, a)


def slab(random: Random) -> SceneThing:
    """Return a flat cloth, mat or sheet of paper: thinner than any book."""
    a, b = between(random, 0.05, 0.2), between(random, 0.04, 0.15)
    parts = [SolidPart(kind="box", size=(a, b, 0.001))]
    return _thing(parts, (RestPose(quat=UPRIGHT, height_m=0.001),), max(a, b))


def frame(random: Random) -> SceneThing:
    """Return a picture or a screen on a foot."""
    a, b = between(random, 0.08, 0.3), between(random, 0.07, 0.2)
    parts = [
        SolidPart(kind="box", size=(0.012, a, b), at=(0, 0, b + 0.02), role="dark"),
        SolidPart(
            kind="box", size=(0.001, a * 0.93, b * 0.9), at=(0.012, 0, b + 0.02), role="label"
        ),
        SolidPart(kind="box", size=(0.06, a * 0.4, 0.006), at=(0, 0, 0.006), role="dark"),
    ]
    return _thing(parts, (RestPose(quat=UPRIGHT, height_m=0.0),), a)


BUILDERS: tuple[Callable[[Random], SceneThing], ...] = (
    block, pen, plate, banana, tool, lamp, plant, cushion, slab, frame
)  # fmt: skip
