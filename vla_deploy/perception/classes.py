"""Tell what a thing is by its measures: one table of rules, the first that holds wins."""

from collections.abc import Callable
from dataclasses import dataclass

from vla_deploy.perception.shapes import Shape

Range = tuple[float, float]
Measure = Callable[[Shape], float]

SPHERE_RESIDUAL = 0.06
SPHERE_SIZE = (0.75, 1.3)


def _flatness(shape: Shape) -> float:
    return shape.height_m / max(shape.footprint.width_m, 1e-6)


def _slenderness(shape: Shape) -> float:
    return shape.height_m / max(shape.across_m, 1e-6)


def _top_ratio(shape: Shape) -> float:
    return shape.top.width_m / max(shape.across_m, 1e-6)


def _rim_ratio(shape: Shape) -> float:
    return shape.top.width_m / max(shape.footprint.width_m, 1e-6)


def _squareness(shape: Shape) -> float:
    return shape.footprint.width_m / max(shape.footprint.length_m, 1e-6)


def _roundness(shape: Shape) -> float:
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
    "across_m": lambda shape: shape.across_m,
    "length_m": lambda shape: shape.footprint.length_m,
    "width_m": lambda shape: shape.footprint.width_m,
    "hole_m": lambda shape: shape.hole_m,
    "flatness": _flatness,
    "slenderness": _slenderness,
    "squareness": _squareness,
    "top_ratio": _top_ratio,
    "rim_m": lambda shape: shape.top.width_m,
    "rim_ratio": _rim_ratio,
    "rim_share": lambda shape: shape.rim_share,
    "roundness": _roundness,
}


@dataclass(frozen=True, slots=True)
class Rule:
    """Name a class and bound the measures that it must meet, bounds included."""

    name: str
    bounds: dict[str, Range]


OTHER = "object"
RULES: tuple[Rule, ...] = (
    Rule(
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
    Rule("ball", {"roundness": (1.0, 1.0), "across_m": (0.025, 0.3)}),
    Rule(
        "bottle",
        {
            "height_m": (0.13, 0.36),
            "across_m": (0.04, 0.11),
            "slenderness": (1.9, 6.0),
            "squareness": (0.55, 1.0),
        },
    ),
    Rule(
        "cup",
        {
            "height_m": (0.06, 0.14),
            "across_m": (0.05, 0.13),
            "slenderness": (0.7, 1.9),
            "top_ratio": (0.5, 1.2),
        },
    ),
    Rule("phone", {"height_m": (0.004, 0.017), "length_m": (0.1, 0.18), "width_m": (0.05, 0.1)}),
    Rule("keys", {"height_m": (0.004, 0.025), "length_m": (0.03, 0.13), "width_m": (0.012, 0.06)}),
    Rule(
        "book",
        {
            "height_m": (0.01, 0.07),
            "length_m": (0.11, 0.33),
            "width_m": (0.05, 0.26),
            "flatness": (0.04, 0.8),
        },
    ),
)


def classify(shape: Shape) -> str:
    """Return the class of the first rule whose every bound holds, or "object"."""
    for rule in RULES:
        if all(low <= MEASURES[name](shape) <= high for name, (low, high) in rule.bounds.items()):
            return rule.name
    return OTHER
