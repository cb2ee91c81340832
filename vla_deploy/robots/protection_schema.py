"""Declare what a robot file may say of zones and margins; find its faults, and build the values."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import Any

from vla_deploy.robots.consistency import rows, subtables, table, unknown_name
from vla_deploy.robots.protection import (
    ClearanceLimits,
    ContactLimits,
    Protection,
    TipOver,
    Workspace,
    Zone,
    ZoneKind,
    ZoneSource,
)
from vla_deploy.robots.schema import POLYGON
from vla_deploy.runtime.table_schema import (
    POSITIVE,
    TABLE,
    TEXTS,
    Shape,
    TableFault,
    ValueCheck,
    build,
    integer,
    is_number,
    number,
    numbers,
    one_of,
)

Document = Mapping[str, Any]


COUNT = integer(1, 1000).optional
NOT_NEGATIVE = ValueCheck(
    expected="a number, 0 or above", holds=lambda v: is_number(v) and v >= 0
).optional
RATIO = ValueCheck(
    expected="a number above 0 and below 1", holds=lambda v: is_number(v) and 0 < v < 1
).optional
LEAN = number(0.01, 0.8, "rad", kind="an angle")
POINT_3 = replace(numbers(3), expected="[x, y, z]")
SOURCES = ValueCheck(
    expected=f"a list with one or more of {', '.join(ZoneSource)}",
    holds=lambda v: (
        isinstance(v, list) and len(v) > 0 and all(one in list(ZoneSource) for one in v)
    ),
)
PAIRS = ValueCheck(
    expected="a list of pairs of geom names",
    holds=lambda v: isinstance(v, list) and all(TEXTS.holds(pair) and len(pair) == 2 for pair in v),
).optional

ZONE: Shape = {
    "kind": one_of(*ZoneKind),
    "sources": SOURCES,
    "polygon_m": POLYGON.optional,
    "min_points": COUNT,
    "trigger_count": COUNT,
    "release_count": COUNT,
    "reaction_s": NOT_NEGATIVE,
    "speed_ratio": RATIO,
    "speed_m_s": POSITIVE.optional,
    "turn_rad_s": POSITIVE.optional,
    "time_before_collision_s": POSITIVE.optional,
}
WORKSPACE: Shape = {"min_m": POINT_3, "max_m": POINT_3}
CLEARANCE: Shape = {"self_m": NOT_NEGATIVE, "floor_m": NOT_NEGATIVE, "allow": PAIRS}
TIP_OVER: Shape = {
    "support_m": POLYGON,
    "max_lean_rad": LEAN,
    "min_ratio": RATIO,
    "slow_below_ratio": RATIO.optional,
}
CONTACT: Shape = {"torque_nm": TABLE}

# What a kind of zone cannot do without, and what it has no use for.
_NEEDS: Mapping[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    ZoneKind.STOP: (
        ("polygon_m",),
        ("speed_ratio", "speed_m_s", "turn_rad_s", "time_before_collision_s"),
    ),
    ZoneKind.SLOW: (
        ("polygon_m", "speed_ratio"),
        ("speed_m_s", "turn_rad_s", "time_before_collision_s"),
    ),
    ZoneKind.LIMIT: (("polygon_m",), ("speed_ratio", "time_before_collision_s")),
    ZoneKind.APPROACH: (
        ("time_before_collision_s",),
        ("polygon_m", "reaction_s", "speed_ratio", "speed_m_s", "turn_rad_s", "min_points"),
    ),
}


def zones_fit_their_kind(document: Document) -> Iterator[TableFault]:
    """Each zone has what its kind needs and nothing that its kind does not use."""
    for name, row in subtables(document, "zones").items():
        kind = row.get("kind")
        needed, unused = _NEEDS.get(kind, ((), ())) if isinstance(kind, str) else ((), ())
        for key in needed:
            if key not in row:
                yield TableFault(
                    key=f"zones.{name}.{key}",
                    got="nothing",
                    expected=f"a value: it is a {kind} zone",
                )
        for key in unused:
            if key in row:
                expected = f"no such key: a {kind} zone has no use for it"
                yield TableFault(key=f"zones.{name}.{key}", got=repr(row[key]), expected=expected)
        if kind == ZoneKind.LIMIT and not {"speed_m_s", "turn_rad_s"} & row.keys():
            expected = "speed_m_s, turn_rad_s or both: it is a limit zone"
            yield TableFault(key=f"zones.{name}", got="neither", expected=expected)


def workspaces_bound_hands(document: Document) -> Iterator[TableFault]:
    """A workspace is that of a hand, and its lower corner lies below the upper one."""
    hands = subtables(document, "hands")
    for name, row in subtables(document, "workspace").items():
        if name not in hands:
            yield unknown_name(f"workspace.{name}", name, "a hand", hands)
        low, high = row.get("min_m"), row.get("max_m")
        if POINT_3.holds(low) and POINT_3.holds(high):
            assert isinstance(low, list)
            assert isinstance(high, list)
            if not all(a < b for a, b in zip(low, high, strict=True)):
                key = f"workspace.{name}.min_m"
                yield TableFault(
                    key=key, got=repr(low), expected=f"below max_m {high} on every axis"
                )


def it_slows_before_it_stops(document: Document) -> Iterator[TableFault]:
    """What slows a leaning base comes before what stops it."""
    row = table(document, "tip_over")
    slow, stop = row.get("slow_below_ratio"), row.get("min_ratio")
    if is_number(slow) and is_number(stop) and slow <= stop:
        key, expected = "tip_over.slow_below_ratio", f"more than min_ratio {stop}"
        yield TableFault(key=key, got=repr(slow), expected=expected)


def contact_torques_fit_servos(document: Document) -> Iterator[TableFault]:
    """A contact threshold is that of a servo joint, and below what the servo can give."""
    models = subtables(document, "servo_models")
    servos = {row.get("joint"): row for row in rows(table(document, "servo_bus"), "servos")}
    names = [name for name in servos if isinstance(name, str)]
    for joint, value in table(table(document, "contact"), "torque_nm").items():
        key = f"contact.torque_nm.{joint}"
        if joint not in servos:
            yield unknown_name(key, joint, "a servo's joint", names)
            continue
        stall = table(models, servos[joint].get("model")).get("stall_torque_nm")
        limit = stall if is_number(stall) else float("inf")
        if not (is_number(value) and 0 < value < limit):
            below = f"a number above 0 and below the stall torque {stall}"
            yield TableFault(key=key, got=repr(value), expected=below)


def support_holds_centre(document: Document) -> Iterator[TableFault]:
    """The support polygon is convex, counter-clockwise, and the base's centre is inside."""
    corners = table(document, "tip_over").get("support_m")
    if not POLYGON.holds(corners):
        return
    assert isinstance(corners, list)
    pairs = zip(corners, (*corners[1:], corners[0]), strict=True)
    if not all(a[0] * b[1] - a[1] * b[0] > 0 for a, b in pairs):
        expected = "corners counter-clockwise around the base's centre [0, 0]"
        yield TableFault(key="tip_over.support_m", got=repr(corners), expected=expected)


CHECKS: tuple[Callable[[Document], Iterator[TableFault]], ...] = (
    zones_fit_their_kind,
    workspaces_bound_hands,
    contact_torques_fit_servos,
    it_slows_before_it_stops,
    support_holds_centre,
)


def build_protection(document: Document) -> Protection:
    """Return the values of a robot file without faults."""
    return Protection(
        zones=tuple(
            _zone(name, row, document["base"]) for name, row in subtables(document, "zones").items()
        ),
        workspaces={
            name: build(Workspace, row) for name, row in subtables(document, "workspace").items()
        },
        clearance=build(ClearanceLimits, table(document, "clearance")),
        tip_over=build(TipOver, document["tip_over"]) if "tip_over" in document else None,
        contact=build(ContactLimits, document["contact"]) if "contact" in document else None,
    )


def _zone(name: str, row: Document, base: Document) -> Zone:
    """Return a zone; one that bounds speeds bounds them by the least ratio of them."""
    speed_m_s = row.get("speed_m_s", base["max_speed_m_s"])
    turn_rad_s = row.get("turn_rad_s", base["max_turn_rad_s"])
    ratio = min(1.0, speed_m_s / base["max_speed_m_s"], turn_rad_s / base["max_turn_rad_s"])
    return build(Zone, {"name": name, "speed_ratio": ratio, **row})
