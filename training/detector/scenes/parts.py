"""Hold a thing as a list of solids, independent of the simulator."""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
Random = np.random.Generator

UPRIGHT: Quaternion = (1.0, 0.0, 0.0, 0.0)
_HALF = math.sqrt(0.5)
ON_SIDE: Quaternion = (_HALF, 0.0, _HALF, 0.0)
"""The thing's z axis points along x."""
ON_EDGE: Quaternion = (_HALF, _HALF, 0.0, 0.0)
"""The thing's y axis points up."""
UPSIDE_DOWN: Quaternion = (0.0, 1.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Mesh:
    """Hold a closed surface: vertices in metres and triangles, counter-clockwise from outside."""

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]


@dataclass(frozen=True, slots=True, kw_only=True)
class SolidPart:
    """Place one solid in the frame of its thing; `size` as MuJoCo wants it for `kind`."""

    kind: str
    size: Vector = (0.0, 0.0, 0.0)
    at: Vector = (0.0, 0.0, 0.0)
    quat: Quaternion = UPRIGHT
    role: str = "main"
    mesh: Mesh | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class RestPose:
    """Say how a thing may lie: its turn and its origin's height above the support."""

    quat: Quaternion
    height_m: float
    weight: float = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class SceneThing:
    """Describe one thing: its solids, how it rests, how much room it takes.

    `inside` is the radius and height of a floor on which something smaller may lie; `top_m` the
    height of a flat top on which something may lie, both when it rests in its first way.
    """

    class_name: str
    parts: tuple[SolidPart, ...]
    rests: tuple[RestPose, ...]
    radius_m: float
    inside: tuple[float, float] | None = None
    top_m: float | None = None
    extra: dict[str, float] = field(default_factory=dict)


def about_z(angle_rad: float) -> Quaternion:
    """Return a turn about the vertical."""
    return (math.cos(angle_rad / 2), 0.0, 0.0, math.sin(angle_rad / 2))


def about_y(angle_rad: float) -> Quaternion:
    """Return a turn about the y axis."""
    return (math.cos(angle_rad / 2), 0.0, math.sin(angle_rad / 2), 0.0)


def about_x(angle_rad: float) -> Quaternion:
    """Return a turn about the x axis."""
    return (math.cos(angle_rad / 2), math.sin(angle_rad / 2), 0.0, 0.0)


def product(first: Quaternion, second: Quaternion) -> Quaternion:
    """Return the turn that applies `second`, then `first`."""
    a, b, c, d = first
    e, f, g, h = second
    return (
        a * e - b * f - c * g - d * h,
        a * f + b * e + c * h - d * g,
        a * g - b * h + c * e + d * f,
        a * h + b * g - c * f + d * e,
    )


def between(random: Random, low: float, high: float) -> float:
    """Return a number drawn evenly from the range."""
    return float(random.uniform(low, high))


def rod(start: Vector, end: Vector, radius_m: float, role: str = "main") -> SolidPart:
    """Return a capsule from one point to another."""
    a, b = np.array(start), np.array(end)
    along = b - a
    length = float(np.linalg.norm(along))
    x, y, z = along / max(length, 1e-9)
    turn = (1.0 + z, -y, x, 0.0) if z > -0.999 else (0.0, 1.0, 0.0, 0.0)
    norm = math.sqrt(sum(value * value for value in turn))
    middle = (a + b) / 2
    return SolidPart(
        kind="capsule",
        size=(radius_m, length / 2, 0.0),
        at=(float(middle[0]), float(middle[1]), float(middle[2])),
        quat=(turn[0] / norm, turn[1] / norm, turn[2] / norm, 0.0),
        role=role,
    )


def lathe(profile: list[tuple[float, float]], sides: int = 20) -> Mesh:
    """Turn a closed outline (radius, height) about the vertical into a surface.

    The outline runs from the axis at the bottom, outside upwards, back to the axis.
    """
    angles = np.linspace(0.0, 2 * math.pi, sides, endpoint=False)
    rings = [
        np.column_stack([r * np.cos(angles), r * np.sin(angles), np.full(sides, z)])
        for r, z in profile[1:-1]
    ]
    bottom, top = [0.0, 0.0, profile[0][1]], [0.0, 0.0, profile[-1][1]]
    vertices = np.vstack([bottom, *rings, top])
    last = len(vertices) - 1
    faces: list[tuple[int, int, int]] = []
    for k in range(sides):
        n = (k + 1) % sides
        faces.append((0, 1 + n, 1 + k))
        for ring in range(len(rings) - 1):
            a, b = 1 + ring * sides + k, 1 + ring * sides + n
            c, d = a + sides, b + sides
            faces += [(a, b, d), (a, d, c)]
        base = 1 + (len(rings) - 1) * sides
        faces.append((base + k, base + n, last))
    return Mesh(vertices=vertices, faces=np.array(faces, np.int32))
