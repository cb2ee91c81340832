"""Read the values of parameters: numbers with or without a unit, points, names, words for speed.

A number without a unit is in m, s and m/s; angles are in degrees where the key does not say rad.
"""

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, Final

Json = dict[str, Any]


class NotMeant(Exception):
    """Say what a value should be; who reads the action adds which action and key, and what came."""


@dataclass(frozen=True, slots=True)
class ValueReading:
    """Hold what a value became, and what of it is not used, "" where all is."""

    parameters: Mapping[str, Any] = field(default_factory=dict)
    note: str = ""


Read = Callable[[Any], ValueReading]
"""Return what a value means, or raise NotMeant."""

POINT: Final = "(point)"
"""The parameter under which a point is kept until it is known whether the goal has a name, too."""
LENGTHS_M: Final = MappingProxyType({"m": 1.0, "meter": 1.0, "metre": 1.0, "cm": 0.01, "mm": 0.001})
DURATIONS_S: Final = MappingProxyType(
    {"s": 1.0, "sec": 1.0, "second": 1.0, "min": 60.0, "minute": 60.0}
)
SPEEDS_M_S: Final = MappingProxyType({"m/s": 1.0, "cm/s": 0.01, "km/h": 1.0 / 3.6})
DEGREES: Final = MappingProxyType(
    {"deg": 1.0, "°": 1.0, "degree": 1.0, "rad": 180.0 / math.pi, "radian": 180.0 / math.pi}
)
SLOW_M_S: Final = 0.15
_CRUISE: Final = frozenset({"normal", "medium", "default", "fast"})
_NUMBER: Final = re.compile(r"\s*(-?\d{1,9}(?:\.\d{1,9})?)\s*([a-z/°]*)\s*", re.IGNORECASE)
_HERE: Final = frozenset({"current location", "current position", "current place"})
_AXES: Final[Mapping[str, str]] = MappingProxyType(
    {"x": "x_m", "x_m": "x_m", "y": "y_m", "y_m": "y_m", "z": "z_m", "z_m": "z_m",
     "yaw": "yaw_rad", "theta": "yaw_rad", "yaw_rad": "yaw_rad"}
)  # fmt: skip


def number_of(value: Any, expected: str, units: Mapping[str, float] | None = None) -> float:
    """Return a finite number, also of a text with one of the units behind it.

    Raises:
        NotMeant: it is none.
    """
    if isinstance(value, str):
        found = _NUMBER.fullmatch(value)
        factor = None if found is None else _factor(found[2].lower(), units or {})
        if found is not None and factor is not None:
            return float(found[1]) * factor
    elif isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e9:
        return float(value)  # neither infinite, nor none, nor too long for a float
    raise NotMeant(expected)


def _factor(unit: str, units: Mapping[str, float]) -> float | None:
    return 1.0 if not unit else units.get(unit, units.get(unit.removesuffix("s")))


def number(name: str, expected: str, units: Mapping[str, float] | None = None) -> Read:
    """Return what reads a number."""
    return lambda value: ValueReading({name: number_of(value, expected, units)})


def distance(value: Any) -> ValueReading:
    """Read how far to drive, forward or (negative) backward."""
    return ValueReading(
        {"distance_m": number_of(value, 'a number of m, such as 1.5 or "50 cm"', LENGTHS_M)}
    )


def distance_ahead(sign: float, opposite: str) -> Read:
    """Return what reads how far to drive in a direction that the action names."""
    expected = f"more than 0 m; the other way is {opposite}"
    return lambda value: ValueReading(
        {"distance_m": sign * _above_zero(value, expected, LENGTHS_M)}
    )


def angle(value: Any) -> ValueReading:
    """Read by how many degrees to turn, counter-clockwise."""
    degrees = number_of(value, "a number of degrees, such as 90; radians are angle_rad", DEGREES)
    return ValueReading({"angle_rad": math.radians(degrees)})


def angle_towards(sign: float, opposite: str) -> Read:
    """Return what reads by how many degrees to turn to the side that the action names."""
    expected = f"more than 0 degrees; the other way is {opposite}"
    return lambda value: ValueReading(
        {"angle_rad": sign * math.radians(_above_zero(value, expected, DEGREES))}
    )


def radians(sign: float = 1.0) -> Read:
    """Return what reads an angle in rad."""
    return lambda value: ValueReading({"angle_rad": sign * number_of(value, "a number of rad")})


def _above_zero(value: Any, expected: str, units: Mapping[str, float]) -> float:
    found = number_of(value, expected, units)
    if found <= 0.0:
        raise NotMeant(expected)
    return found


def yaw(value: Any) -> ValueReading:
    """Read a heading in rad, of any number of turns."""
    return ValueReading({"yaw_rad": math.remainder(number_of(value, "a heading in rad"), math.tau)})


def duration(value: Any) -> ValueReading:
    """Read for how long."""
    return ValueReading(
        {"duration_s": number_of(value, 'a number of s, such as 5 or "2 min"', DURATIONS_S)}
    )


def speed(value: Any) -> ValueReading:
    """Read a speed in m/s, or in words."""
    word = value.strip().lower() if isinstance(value, str) else ""
    if word in ("slow", "slowly"):
        return ValueReading({"speed_m_s": SLOW_M_S}, f"{SLOW_M_S:g} m/s")
    if word in _CRUISE:
        return ValueReading({}, "as fast as the base cruises by its robot file")
    expected = 'a number of m/s, or "slow", "normal", "fast"'
    return ValueReading({"speed_m_s": _above_zero(value, expected, SPEEDS_M_S)})


# --- names --------------------------------------------------------------------------------------


def words(value: Any, expected: str = "a text") -> str:
    """Return a text of at least one letter.

    Raises:
        NotMeant: it is none.
    """
    if not isinstance(value, str) or not value.strip():
        raise NotMeant(expected)
    return value.strip()


def text(name: str) -> Read:
    """Return what reads a text as it is written."""
    return lambda value: ValueReading({name: words(value)})


def spoken(value: Any, expected: str) -> str:
    """Return a name as one says it: "red_cup" is the red cup, "cup_1" stays an id."""
    said = re.sub(r"_(?!\d)", " ", words(value, expected))
    return "here" if said.lower() in _HERE else said


def thing(name: str = "object") -> Read:
    """Return what reads the name of a thing."""
    expected = 'the name of one thing, such as "red cup"'
    return lambda value: ValueReading({name: spoken(value, expected)})


def goal(name: str) -> Read:
    """Return what reads a name or a point."""
    expected = 'a name such as "kitchen", or a point [x, y] or [x, y, 0] in m of the map'

    def read(value: Any) -> ValueReading:
        if isinstance(value, list | Mapping):
            return point(value)
        return ValueReading({name: spoken(value, expected)})

    return read


def point(value: Any) -> ValueReading:
    """Read a point of the map: [x, y], [x, y, z] in m, or x, y, z and yaw by their names."""
    expected = 'a point [x, y] or [x, y, z], or {"x": ..., "y": ...}, in m of the map'
    if isinstance(value, Mapping):
        unknown = [one for one in value if one not in _AXES]
        if unknown or not {"x_m", "y_m"} <= {_AXES[one] for one in value}:
            raise NotMeant(expected)
        named = {_AXES[one]: number_of(axis, expected) for one, axis in value.items()}
    else:
        if not isinstance(value, list) or len(value) not in (2, 3):
            raise NotMeant(expected)
        axes = [number_of(axis, expected) for axis in value]
        named = dict(zip(("x_m", "y_m", "z_m"), axes, strict=False))
    if "yaw_rad" in named:
        named["yaw_rad"] = math.remainder(named["yaw_rad"], math.tau)
    return ValueReading({POINT: named})


def pose(value: Any) -> ValueReading:
    """Read a pose on the floor: [x, y] or [x, y, yaw], in m and rad."""
    if isinstance(value, Mapping):
        return point(value)
    if not isinstance(value, list) or len(value) not in (2, 3):
        raise NotMeant("a pose [x, y, yaw] in m and rad")
    axes = [number_of(axis, "a pose [x, y, yaw] in m and rad") for axis in value]
    return point(dict(zip(("x", "y", "yaw"), axes, strict=False)))


# --- what a robot of this kind does by itself ---------------------------------------------------


def unused(why: str) -> Read:
    """Return what takes any value, and says why it changes nothing."""
    return lambda _: ValueReading({}, f"not used, {why}")


def margin(value: Any) -> ValueReading:
    """Read a distance to keep; whatever it is, the robot's own stay in force."""
    if number_of(value, "a number of m, 0 or more", LENGTHS_M) < 0.0:
        raise NotMeant("a number of m, 0 or more")
    return ValueReading({}, "not taken, the clearances of the robot file stay in force")
