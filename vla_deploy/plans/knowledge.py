"""Know what plans may refer to: things by their words, places, poses, hands, and all limits."""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from types import MappingProxyType
from typing import Final

from vla_deploy.manipulation.grasps import takes_from_side
from vla_deploy.plans.catalogue import SKILLS
from vla_deploy.plans.errors import DependsOnView, UnknownObject
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.description import KeepOutZone, Place
from vla_deploy.robots.home_devices import DeviceKind
from vla_deploy.robots.plan_bounds import NOT_BOUNDED, PlanBounds
from vla_deploy.robots.reach import Reach
from vla_deploy.world import Query, UnknownWord, parse_query
from vla_deploy.world.access import IsFree
from vla_deploy.world.query import FROM_A_VIEW
from vla_deploy.world.vocabulary import ARTICLES, OBJECT_CLASSES

NOTHING_KNOWN: Final[Mapping[str, bool]] = MappingProxyType({})


def words_of(text: str) -> list[str]:
    """Return lower-case words without articles and punctuation."""
    words = re.findall(r"[a-z0-9_]+", text.lower())
    return [word for word in words if word not in ARTICLES]


@lru_cache(maxsize=512)
def parse_object(text: str) -> Query:
    """Read "the red cup", "mug", "the small cup next to the book", or an id such as "cup_1".

    Its kind is known of an id, too; an empty colour means any.

    Raises:
        UnknownObject: no word of it, or one word too many, is a kind or colour the robot knows.
        DependsOnView: it says left, right, in front or behind.
    """
    try:
        asked = parse_query(text)
    except UnknownWord as error:
        raise UnknownObject(text.strip(), OBJECT_CLASSES) from error
    if asked.relation in FROM_A_VIEW:
        raise DependsOnView(text.strip())
    kind = asked.thing_id.rpartition("_")[0] or asked.kind
    if kind not in OBJECT_CLASSES or not asked.is_named:
        raise UnknownObject(text.strip(), OBJECT_CLASSES)
    return replace(asked, kind=kind)


def object_or_none(text: object) -> Query | None:
    """Return what a text names, None where it names a place, or nothing known."""
    if not isinstance(text, str):
        return None
    try:
        return parse_object(text)
    except UnknownObject:
        return None


def match_place(text: str, places: Mapping[str, str]) -> str | None:
    """Return the place that `text` names, or None; `places` maps every spoken name to a place."""
    return places.get(_said(text))


@dataclass(frozen=True, slots=True, kw_only=True)
class World:
    """Say what a plan may refer to, and what bounds it.

    `devices` maps every spoken name to its device of the home, `devices_on` those that answer to
    whether they are on, `device_kinds` each to what it is, and
    `places` maps every spoken name to its place, `sites` each place to where one stands for it, and
    `furniture` names the places that have something to put things on. `poses` are the robot file's
    named poses; `holding` is which kind of object each hand holds, and is empty where that is not
    known. `is_free` returns whether the base fits on a point of the map; None means that no map is
    at hand. A gripper opens `opening_max_m` wide and takes things within `reach`; None where that
    is not known; from the side, too, where an arm has the joints for it. The robot charges at the
    place `station`, where it has one. `skills` are those that its body is able to; `lacks` says of
    each other one which parts it would need.
    """

    places: Mapping[str, str]
    poses: frozenset[str]
    holding: Mapping[str, str | None]
    sites: Mapping[str, Place] = field(default_factory=dict)
    furniture: frozenset[str] = frozenset()
    zones: tuple[KeepOutZone, ...] = ()
    footprint_radius_m: float = 0.0
    max_speed_m_s: float | None = None
    opening_max_m: float | None = None
    takes_from_side: bool = True
    reach: Reach | None = None
    bounds: PlanBounds = NOT_BOUNDED
    is_free: IsFree | None = None
    station: str = ""
    devices: Mapping[str, str] = field(default_factory=dict)
    devices_on: Mapping[str, bool] = field(default_factory=dict)
    device_kinds: Mapping[str, DeviceKind] = field(default_factory=dict)
    lacks: Mapping[str, str] = field(default_factory=dict)

    @property
    def skills(self) -> frozenset[str]:
        """Return the skills for which the robot has all parts."""
        return frozenset(SKILLS).difference(self.lacks)

    def is_surface(self, name: str) -> bool:
        """Return whether one stands before furniture at a place, not elsewhere in the room."""
        site = self.sites.get(name)
        return site is not None and site.pose in site.viewpoints

    def surface_of(self, name: str) -> str:
        """Return the furniture that putting something "in the kitchen" means, or the place."""
        site = self.sites.get(name)
        if site is None or not site.viewpoints or self.is_surface(name):
            return name
        first = site.viewpoints[0]
        return next((one for one, other in self.sites.items() if other.pose == first), name)

    def surfaces_of(self, name: str) -> frozenset[str]:
        """Return a place, and the furniture that one looks at there."""
        views = self.sites[name].viewpoints if name in self.sites else ()
        return frozenset({name, *(one for one, site in self.sites.items() if site.pose in views)})

    def nearest_surface(self, spot: tuple[float, float] | None) -> str | None:
        """Return the place with something to put things on that is nearest, or None."""
        poses = {name: site.pose for name, site in self.sites.items() if self.is_surface(name)}
        if spot is None:
            return next(iter(poses), None)
        return min(
            poses,
            key=lambda name: math.dist(spot, (poses[name].x_m, poses[name].y_m)),
            default=None,
        )


def spoken_places(places: Mapping[str, Place]) -> dict[str, str]:
    """Map every name by which a place may be called, in lower case, to the place."""
    return {
        _said(spoken): place.name
        for place in places.values()
        for spoken in (place.name, *place.aliases)
    }


def spoken_devices(robot: RobotDescription) -> dict[str, str]:
    """Map every name by which a device of the home may be called, in lower case, to the device.

    A lamp of the kitchen is "the kitchen lamp" and "the lamp in the kitchen", too.
    """
    names = {
        _said(spoken): device.name
        for device in robot.devices.values()
        for spoken in (device.name, *device.aliases)
    }
    with_place = {
        _said(words.format(spoken, place)): name
        for spoken, name in names.items()
        for place, where in spoken_places(robot.places).items()
        if where == robot.devices[name].place
        for words in ("{1} {0}", "{0} in the {1}")
    }
    return with_place | names


def _said(name: str) -> str:
    return " ".join(words_of(name.replace("_", " ")))


def match_device(text: object, devices: Mapping[str, str]) -> str | None:
    """Return the device that `text` names, or None; `devices` maps spoken names to devices."""
    if not isinstance(text, str):
        return None
    return devices.get(_said(text))


_SEVERAL: Final = re.compile(r"(?P<every>everything)|(?:all |both |every )?(?P<kind>[a-z]+)")
_KIND_WORDS: Final[Mapping[str, DeviceKind]] = {
    "lamp": DeviceKind.LAMP, "light": DeviceKind.LAMP, "socket": DeviceKind.SOCKET,
    "plug": DeviceKind.SOCKET, "outlet": DeviceKind.SOCKET, "switch": DeviceKind.SWITCH,
    "switche": DeviceKind.SWITCH, "fan": DeviceKind.FAN,
}  # fmt: skip


def match_devices(text: str, world: "World") -> tuple[str, ...]:
    """Return the devices that a text names: one, or all of a kind: "the lights", "all sockets"."""
    one = match_device(text, world.devices)
    if one is not None:
        return (one,)
    said = " ".join(word for word in words_of(text) if word != "of")
    found = _SEVERAL.fullmatch(said)
    if found is None:
        return ()
    if found["every"] or found["kind"] == "devices":
        return tuple(world.device_kinds)
    word = found["kind"]
    is_several = word.endswith("s") or said.startswith("every ")
    kind = _KIND_WORDS.get(word.removesuffix("s")) if is_several else None
    return tuple(name for name, other in world.device_kinds.items() if other is kind)


def world_of(
    robot: RobotDescription,
    holding: Mapping[str, str | None],
    is_free: IsFree | None = None,
    devices_on: Mapping[str, bool] = NOTHING_KNOWN,
) -> World:
    """Return what plans for this robot may refer to; `is_free` is its map, where one is at hand."""
    openings_m = [robot.widest_m(hand) for hand in robot.hands]
    base, home = robot.parts.base, robot.parts.home
    return World(
        places=spoken_places(robot.places),
        poses=frozenset(robot.poses),
        holding=dict(holding),
        sites=robot.places,
        furniture=frozenset(name for name, one in robot.places.items() if one.viewpoints),
        zones=home.zones if home else (),
        footprint_radius_m=base.footprint_radius_m if base else 0.0,
        max_speed_m_s=base.max_speed_m_s if base else 0.0,
        opening_max_m=max(openings_m, default=None),
        takes_from_side=any(takes_from_side(robot, hand) for hand in robot.hands),
        reach=robot.parts.reach,
        bounds=robot.planning,
        is_free=is_free,
        station="" if robot.battery is None else robot.battery.station,
        devices=spoken_devices(robot),
        devices_on=devices_on,
        device_kinds={name: one.kind for name, one in robot.devices.items()},
        lacks=_lacks_of(robot),
    )


def _lacks_of(robot: RobotDescription) -> dict[str, str]:
    """Return why the robot cannot do a skill, for each of which it lacks a part."""
    parts = {
        *robot.groups,
        "speaker",  # without one it shows what it would say
        *(("camera",) if robot.parts.camera else ()),
        *(("arm", "arms") if robot.hands else ()),
        *(("device",) if robot.devices else ()),
    }
    missing = {
        name: [part for part in spec.resources if part not in parts | spec.may_lack]
        for name, spec in SKILLS.items()
    }
    if robot.parts.lidar is None:
        for name, spec in SKILLS.items():
            if spec.finds_way and "base" not in missing[name]:
                missing[name] = ["lidar"]
    lacks = {
        name: f"{robot.name} has no {' and no '.join(lacked)}"
        for name, lacked in missing.items()
        if lacked
    }
    if robot.parts.base is None and robot.parts.reach is None:
        lacks.setdefault(
            "hand_over", f"{robot.name} has no [reach], in which it would hold things out"
        )
    return lacks
