"""Read how documents want a thing to be taken: from where, how carefully, how firmly, how fast."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Final

from vla_deploy.manipulation.grasps import GraspKind
from vla_deploy.plans.catalogue import FORCE_RATIOS, SPEED_RATIOS
from vla_deploy.plans.dialects import values
from vla_deploy.plans.dialects.values import NotMeant, ValueReading

GRASP_TYPES: Final[Mapping[str, GraspKind]] = MappingProxyType(
    {
        **dict.fromkeys(("top", "top down", "overhead", "from above", "vertical"), GraspKind.TOP),
        **dict.fromkeys(
            ("side", "from side", "from the side", "lateral", "horizontal", "cylindrical", "wrap"),
            GraspKind.SIDE,
        ),
    }
)
APPROACHES: Final[Mapping[str, GraspKind]] = MappingProxyType(
    {
        **dict.fromkeys(("top", "above", "from above", "down"), GraspKind.TOP),
        **dict.fromkeys(("side", "front", "left", "right", "from the side"), GraspKind.SIDE),
    }
)
_FLAGS: Final[Mapping[str, bool]] = MappingProxyType(
    {"true": True, "yes": True, "false": False, "no": False}
)
_LOW: Final = frozenset({"low", "slow", "slowly", "gentle", "light", "soft"})
_USUAL: Final = frozenset({"normal", "medium", "default"})
_HIGH: Final = frozenset({"high", "fast", "firm", "strong", "hard"})
LOW_RATIO: Final = 0.6
_MOST_SHARE: Final = 2.0
"""A larger number is no share: of a force it is taken for N, of a speed it cannot be meant."""


def kind_of_grasp(value: Any) -> ValueReading:
    """Read a kind of grasp: what says nothing of from where is chosen by the thing."""
    said = _said(value)
    if said in GRASP_TYPES:
        return ValueReading({"grasp": GRASP_TYPES[said].value})
    return ValueReading(
        {}, "not used, it says not from where; the grasp is chosen by the thing as it is seen"
    )


def way_in(value: Any) -> ValueReading:
    """Read from where the hand comes."""
    said = _said(value)
    if said not in APPROACHES:
        raise NotMeant(f"one of {', '.join(APPROACHES)}")
    kind = APPROACHES[said]
    is_named = said in ("front", "left", "right")
    note = "from the side that leaves most room and that the arm reaches" if is_named else ""
    return ValueReading({"grasp": kind.value}, note)


def careful(value: Any) -> ValueReading:
    """Read whether it is taken slower and less firmly."""
    found = _FLAGS.get(value.strip().lower()) if isinstance(value, str) else value
    if not isinstance(found, bool):
        raise NotMeant("true or false")
    return ValueReading({"careful": found})


def share_of_speed(value: Any) -> ValueReading:
    """Read how fast the hand goes there, as a share of how it does by itself."""
    reading = _share("speed_ratio", value, SPEED_RATIOS, "hands go no faster than by feel")
    if reading is None:
        raise NotMeant(f"a share of at most {_MOST_SHARE:g}")
    return reading


def share_of_force(value: Any) -> ValueReading:
    """Read how firm the grip is, as a share of what the table of grasps says."""
    reading = _share("force_ratio", value, FORCE_RATIOS, "a firmer grip would mark things")
    return reading or ValueReading({}, "not used, N are not known of a hand; write a share")


def _share(
    name: str, value: Any, bounds: tuple[float, float], why_bound: str
) -> ValueReading | None:
    """Read a share or a word for one; None for a number that is none."""
    word, (least, most) = _said(value) if isinstance(value, str) else "", bounds
    if word in _USUAL:
        return ValueReading({}, "as it is done anyway")
    if word in _LOW or word in _HIGH:
        ratio = LOW_RATIO if word in _LOW else most
    else:
        ratio = values.number_of(value, 'a share such as 0.5, or "low", "normal", "high"')
        if ratio <= 0.0:
            raise NotMeant('a share above 0, or "low", "normal", "high"')
        if ratio > _MOST_SHARE:
            return None
    taken = min(max(ratio, least), most)
    note = "" if taken == ratio and not word else f"{taken:g} of what is usual"
    if ratio > most:
        note = f"{taken:g} of what is usual: {why_bound}"
    return ValueReading({name: taken}, note)


def _said(value: Any) -> str:
    said = values.words(value).lower().replace("_", " ").replace("-", " ")
    return said.removesuffix(" grasp").removesuffix(" grip")
