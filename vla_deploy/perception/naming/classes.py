"""Classify a thing by its measures: what it is, what it may also be, and what it cannot be.

Of the table of rules, the first that names and holds gives the name. A second table bounds what a
thing of a class can measure at all, however it lies.
"""

from collections.abc import Callable
from dataclasses import dataclass

from vla_deploy.perception.geometry.shapes import MeasuredShape

Range = tuple[float, float]
Measure = Callable[[MeasuredShape], float]

SPHERE_RESIDUAL = 0.06
SPHERE_SIZE = (0.75, 1.3)


def _ratio(length_m: float, other_m: float) -> float:
    return length_m / max(other_m, 1e-6)


def _roundness(shape: MeasuredShape) -> float:
    """Return 1 for the visible part of a ball, 0 for anything else."""
    sphere = shape.sphere
    if sphere is None or sphere.residual_ratio > SPHERE_RESIDUAL:
        return 0.0
    agrees = all(
        SPHERE_SIZE[0] < size / (2.0 * sphere.radius_m) < SPHERE_SIZE[1]
        for size in (shape.height_m, shape.across_m)
    )
    return 1.0 if agrees else 0.0


MEASURES: dict[str, Measure] = {
    "height_m": lambda shape: shape.height_m,
    "longest_m": lambda shape: max(shape.height_m, shape.across_m, shape.footprint.length_m),
    "across_m": lambda shape: shape.across_m,
    "length_m": lambda shape: shape.footprint.length_m,
    "width_m": lambda shape: shape.footprint.width_m,
    "hole_m": lambda shape: shape.hole_m,
    "flatness": lambda shape: _ratio(shape.height_m, shape.footprint.width_m),
    "slenderness": lambda shape: _ratio(shape.height_m, shape.across_m),
    "squareness": lambda shape: _ratio(shape.footprint.width_m, shape.footprint.length_m),
    "top_ratio": lambda shape: _ratio(shape.top.width_m, shape.across_m),
    "rim_m": lambda shape: shape.top.width_m,
    "rim_ratio": lambda shape: _ratio(shape.top.width_m, shape.footprint.width_m),
    "rim_share": lambda shape: shape.rim_share,
    "roundness": _roundness,
}


@dataclass(frozen=True, slots=True)
class ClassRule:
    """Name a class and bound the measures that it must meet, bounds included.

    A rule that does not give the name only says what a thing may be: a can looks like a cup, too.
    """

    name: str
    bounds: dict[str, Range]
    names: bool = True


@dataclass(frozen=True, slots=True, kw_only=True)
class Form:
    """Hold what a thing's measures say: its `name`, what it `fits`, what it is `impossible` for."""

    name: str
    fits: frozenset[str]
    impossible: frozenset[str]


OTHER = "object"
RULES: tuple[ClassRule, ...] = (
    ClassRule(
        "box",
        {
            "hole_m": (0.04, 0.4),
            "rim_m": (0.13, 0.45),
            "rim_ratio": (0.75, 1.2),
            "rim_share": (0.5, 1.0),
            "length_m": (0.13, 0.55),
            "height_m": (0.05, 0.4),
        },
    ),
    ClassRule(
        "bowl",
        {
            "hole_m": (0.015, 0.1),
            "rim_m": (0.08, 0.26),
            "rim_share": (0.5, 1.0),
            "height_m": (0.03, 0.11),
            "across_m": (0.09, 0.26),
            "slenderness": (0.2, 0.75),
            "squareness": (0.85, 1.0),
        },
    ),
    ClassRule("ball", {"roundness": (1.0, 1.0), "across_m": (0.025, 0.3)}),
    ClassRule(
        "bottle",
        {
            "height_m": (0.13, 0.36),
            "across_m": (0.04, 0.11),
            "slenderness": (1.9, 6.0),
            "squareness": (0.55, 1.0),
        },
    ),
    ClassRule(
        "cup",
        {
            "height_m": (0.06, 0.14),
            "across_m": (0.05, 0.13),
            "slenderness": (0.7, 1.9),
            "top_ratio": (0.5, 1.2),
        },
    ),
    ClassRule(
        "block",
        {
            "height_m": (0.015, 0.06),
            "length_m": (0.015, 0.06),
            "flatness": (0.7, 1.4),
            "squareness": (0.75, 1.0),
        },
    ),
    ClassRule(
        "phone", {"height_m": (0.004, 0.017), "length_m": (0.1, 0.18), "width_m": (0.05, 0.1)}
    ),
    ClassRule(
        "keys", {"height_m": (0.004, 0.025), "length_m": (0.03, 0.13), "width_m": (0.012, 0.06)}
    ),
    ClassRule(
        "book",
        {
            "height_m": (0.01, 0.07),
            "length_m": (0.11, 0.33),
            "width_m": (0.05, 0.26),
            "flatness": (0.04, 0.8),
        },
    ),
    ClassRule(
        "can",
        {
            "height_m": (0.08, 0.18),
            "across_m": (0.045, 0.1),
            "slenderness": (1.1, 2.8),
            "squareness": (0.55, 1.0),
        },
        names=False,
    ),
    ClassRule(
        "bowl",
        {"height_m": (0.03, 0.11), "across_m": (0.09, 0.26), "slenderness": (0.2, 0.75)},
        names=False,
    ),
    ClassRule(
        "remote",
        {"height_m": (0.006, 0.035), "length_m": (0.1, 0.26), "width_m": (0.025, 0.075)},
        names=False,
    ),
)

# However it stands or lies: its height, and the longest of its measures.
POSSIBLE: dict[str, dict[str, Range]] = {
    "cup": {"height_m": (0.03, 0.18), "longest_m": (0.04, 0.22)},
    "ball": {"height_m": (0.02, 0.35), "longest_m": (0.02, 0.4)},
    "book": {"height_m": (0.004, 0.35), "longest_m": (0.08, 0.42)},
    "bottle": {"height_m": (0.03, 0.4), "longest_m": (0.1, 0.42)},
    "phone": {"height_m": (0.003, 0.18), "longest_m": (0.09, 0.2)},
    "keys": {"height_m": (0.003, 0.05), "longest_m": (0.02, 0.16)},
    "box": {"height_m": (0.03, 0.45), "longest_m": (0.08, 0.6), "hole_m": (0.02, 0.5)},
    "bowl": {"height_m": (0.03, 0.16), "longest_m": (0.08, 0.36)},
    "can": {"height_m": (0.04, 0.2), "longest_m": (0.06, 0.22)},
    "remote": {"height_m": (0.004, 0.06), "longest_m": (0.08, 0.3)},
    "block": {"height_m": (0.01, 0.08), "longest_m": (0.01, 0.1)},
}
BYSTANDERS: frozenset[str] = frozenset({"person", "chair"})
"""Obstacles that are never things to take: no thing's form is possible for them."""
FURNITURE = "furniture"
"""Tables, sofas and the like: a detector's vote for it names nothing to take."""


def judge_form(shape: MeasuredShape, *, whole: bool = True) -> Form:
    """Return what a shape may be; of a half-hidden one, only what is too large is certain."""
    fits = [rule for rule in RULES if _holds(rule.bounds, shape)]
    return Form(
        name=next((rule.name for rule in fits if rule.names), OTHER),
        fits=frozenset(rule.name for rule in fits),
        impossible=BYSTANDERS
        | {FURNITURE}
        | {name for name, bounds in POSSIBLE.items() if not _can_be(bounds, shape, whole)},
    )


def _holds(bounds: dict[str, Range], shape: MeasuredShape) -> bool:
    return all(low <= MEASURES[name](shape) <= high for name, (low, high) in bounds.items())


def _can_be(bounds: dict[str, Range], shape: MeasuredShape, whole: bool) -> bool:
    return all(
        (low <= MEASURES[name](shape) or not whole) and MEASURES[name](shape) <= high
        for name, (low, high) in bounds.items()
    )
