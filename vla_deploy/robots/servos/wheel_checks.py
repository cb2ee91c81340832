"""Find what contradicts itself where a robot file says how its base is driven."""

from collections.abc import Callable, Iterator
from math import cos, sin
from typing import Final

import numpy as np

from drivers.errors import UnknownModel
from drivers.servo.family import family_of
from vla_deploy.robots.consistency import Document, rows, table, wheels
from vla_deploy.runtime.table_schema import TableFault, is_number

_LEAST_LEVERAGE: Final = 0.1
"""Of bearings that steer poorly: three wheels at 120 degrees have 1.2, two in line have 0."""


def something_drives_the_base(document: Document) -> Iterator[TableFault]:
    """A base is driven by one bus, and wheels on the servo bus belong to a base."""
    turned, base = rows(table(document, "servo_bus"), "wheels"), "base" in document
    if turned and not base:
        expected = "a table: servo_bus.wheels needs it"
        yield TableFault(key="base", got="nothing", expected=expected)
    if turned and "can_bus" in document:
        expected = "nothing: drives of [can_bus] turn the wheels"
        yield TableFault(key="servo_bus.wheels", got=f"{len(turned)} servos", expected=expected)
    if base and not turned and "can_bus" not in document:
        expected = "a table with the drives of the wheels, or wheels in [servo_bus]"
        yield TableFault(key="can_bus", got="nothing", expected=expected)


def wheels_are_turned_by_servos_that_can(document: Document) -> Iterator[TableFault]:
    """The driver of a servo that turns a wheel has a velocity mode for it."""
    for i, row in enumerate(rows(table(document, "servo_bus"), "wheels")):
        model = row.get("model")
        try:
            turns = not isinstance(model, str) or family_of(model).facts(model).turns_wheels
        except UnknownModel:
            continue  # the check of all servos says so
        if not turns:
            yield TableFault(
                key=f"servo_bus.wheels[{i}].model",
                got=repr(model),
                expected="a servo whose driver has a velocity mode, such as STS3215-C018",
            )


def base_has_one_geometry(document: Document) -> Iterator[TableFault]:
    """Two wheels with a track, or omni wheels each at its bearing, of which three span the floor.

    What looks for people and things around a base knows no motion sideways.
    """
    if "base" not in document:
        return
    base, count = table(document, "base"), len(wheels(document))
    has_track, has_radius = "track_m" in base, "base_radius_m" in base
    if has_track == has_radius:
        got = "both track_m and base_radius_m" if has_track else "neither of the two"
        expected = "track_m of two wheels side by side, or base_radius_m of omni wheels"
        yield TableFault(key="base.track_m", got=got, expected=expected)
    elif has_track and count not in (0, 2):
        expected = "2 with track_m: left, then right"
        yield TableFault(key="base.track_m", got=f"{count} wheels", expected=expected)
    elif has_radius:
        yield from _bearings_span_the_floor(base.get("wheel_bearings_rad"), count)
        if "zones" in document:
            expected = "nothing: zones judge motion ahead and turns, and this base drives sideways"
            yield TableFault(key="zones", got="a table", expected=expected)


def _bearings_span_the_floor(bearings: object, count: int) -> Iterator[TableFault]:
    given = bearings if isinstance(bearings, list) and all(map(is_number, bearings)) else []
    if bearings is not None and not given:
        return  # the schema says so
    spanned = np.array([(-sin(one), cos(one), 1.0) for one in given]).reshape(-1, 3)
    is_spanned = len(given) >= 3 and np.linalg.svd(spanned)[1][-1] >= _LEAST_LEVERAGE
    if is_spanned and len(given) == count:
        return
    yield TableFault(
        key="base.wheel_bearings_rad",
        got=repr(bearings) if given else "nothing",
        expected=f"one for each of the {count} wheels, at least three that do not lie in line",
    )


CHECKS: Final[tuple[Callable[[Document], Iterator[TableFault]], ...]] = (
    something_drives_the_base,
    wheels_are_turned_by_servos_that_can,
    base_has_one_geometry,
)
