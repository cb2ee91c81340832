"""Read names and joint ranges from an MJCF file as text, and hold a robot file against them."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from vla_deploy.robots.consistency import rows, subtables, table, unknown_name
from vla_deploy.runtime.table_schema import TableFault, is_number

Document = Mapping[str, Any]
_ROOT = "base"


@dataclass(frozen=True, slots=True, kw_only=True)
class MjcfNames:
    """List what an MJCF file offers to a robot file; `mimics` gives each follower its leader.

    `is_free` says that the root body has a free joint.
    """

    root_bodies: tuple[str, ...]
    joint_ranges: Mapping[str, tuple[float, float] | None]
    sites: frozenset[str]
    geoms: frozenset[str]
    actuators: frozenset[str]
    is_free: bool
    mimics: Mapping[str, str]


def read_mjcf_names(path: Path) -> MjcfNames:
    """Return the root bodies, joints with their ranges, and sites of an MJCF file.

    Raises:
        OSError: the file cannot be read.
        ElementTree.ParseError: it is not XML.
    """
    root = ElementTree.parse(path).getroot()
    return MjcfNames(
        root_bodies=tuple(body.get("name", "") for body in root.findall("worldbody/body")),
        joint_ranges={
            joint.get("name", ""): _range_of(joint) for joint in root.findall("worldbody//joint")
        },
        sites=frozenset(site.get("name", "") for site in root.findall("worldbody//site")),
        actuators=frozenset(one.get("name", "") for one in root.findall("actuator/*")),
        is_free=any(
            root.find(f"worldbody/body/{one}") is not None
            for one in ("freejoint", "joint[@type='free']")
        ),
        geoms=frozenset(geom.get("name", "") for geom in root.findall("worldbody//geom")),
        mimics={
            couple.get("joint1", ""): couple.get("joint2", "")
            for couple in root.findall("equality/joint")
        },
    )


def _range_of(joint: ElementTree.Element) -> tuple[float, float] | None:
    text = joint.get("range")
    if text is None:
        return None
    low, high = map(float, text.split())
    return low, high


def mjcf_faults(document: Document, mjcf: MjcfNames) -> Iterator[TableFault]:
    """Yield what the robot file says and the MJCF does not bear out."""
    yield from _one_root_body(mjcf)
    yield from _root_moves_as_declared(document, mjcf)
    yield from _named(_motor_names(document), "an actuator of the MJCF", mjcf.actuators)
    yield from _named(_joint_names(document), "a joint of the MJCF", mjcf.joint_ranges)
    yield from _named(_site_names(document), "a site of the MJCF", mjcf.sites)
    yield from _named(_geom_names(document), "a geom of the MJCF", mjcf.geoms)
    yield from _limits_inside_stops(document, mjcf)


def _one_root_body(mjcf: MjcfNames) -> Iterator[TableFault]:
    # Pinocchio reads the first body of the world and drops the others without a word.
    if len(mjcf.root_bodies) != 1:
        got = f"{len(mjcf.root_bodies)} root bodies ({', '.join(mjcf.root_bodies)})"
        yield TableFault(key="mjcf", got=got, expected="a file with exactly one root body")


def _root_moves_as_declared(document: Document, mjcf: MjcfNames) -> Iterator[TableFault]:
    """The twin places a root body of this name, which moves where the robot drives."""
    if len(mjcf.root_bodies) == 1 and mjcf.root_bodies[0] != _ROOT:
        got = f"a root body {mjcf.root_bodies[0]!r}"
        yield TableFault(key="mjcf", got=got, expected=f"one named {_ROOT!r}")
    if mjcf.is_free != ("base" in document):
        got = "a root body with a free joint" if mjcf.is_free else "a root body that stands fast"
        expected = "none, of a robot without [base]" if mjcf.is_free else "a free joint for [base]"
        yield TableFault(key="mjcf", got=got, expected=expected)


def _motor_names(document: Document) -> Iterator[tuple[str, object]]:
    for kind in ("servos", "wheels"):
        for i, row in enumerate(rows(table(document, "servo_bus"), kind)):
            yield f"servo_bus.{kind}[{i}].joint", row.get("joint")


def _named(
    used: Iterable[tuple[str, object]], kind: str, known: Iterable[str]
) -> Iterator[TableFault]:
    names = frozenset(known)
    for key, name in used:
        if isinstance(name, str) and name not in names:
            yield unknown_name(key, name, kind, names)


def _joint_names(document: Document) -> Iterator[tuple[str, object]]:
    turning = (("servo_bus", "servos"), ("servo_bus", "wheels"), ("can_bus", "drives"))
    for outer, inner in turning:
        for i, row in enumerate(rows(table(document, outer), inner)):
            yield f"{outer}.{inner}[{i}].joint", row.get("joint")


def _site_names(document: Document) -> Iterator[tuple[str, object]]:
    for sensor in ("lidar", "imu", "camera"):
        yield f"{sensor}.site", table(document, sensor).get("site")
    for name, row in subtables(document, "hands").items():
        yield f"hands.{name}.grip_site", row.get("grip_site")


def _geom_names(document: Document) -> Iterator[tuple[str, object]]:
    allow = table(document, "clearance").get("allow")
    for i, pair in enumerate(allow if isinstance(allow, list) else []):
        for name in pair if isinstance(pair, list) else []:
            yield f"clearance.allow[{i}]", name


def _limits_inside_stops(document: Document, mjcf: MjcfNames) -> Iterator[TableFault]:
    for joint, row in subtables(document, "limits").items():
        stops = mjcf.joint_ranges.get(joint)
        low, high = row.get("min"), row.get("max")
        if stops is None or not (is_number(low) and is_number(high)):
            continue
        if low < stops[0] or high > stops[1]:
            expected = f"inside the MJCF range {stops[0]}..{stops[1]}"
            yield TableFault(key=f"limits.{joint}", got=f"{low}..{high}", expected=expected)
