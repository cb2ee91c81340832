"""Read a robot's kinematic tree from its MJCF, as text: no simulator is needed to draw it.

Geoms of group 3 and above are left out, as viewers of MJCF hide them, unless there are no others.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from vla_deploy.robots.kinematic_tree import Joint, KinematicTree, Link, Shape, Site, Vector
from vla_deploy.robots.mjcf import read_mjcf_names
from vla_deploy.robots.orientation import Attributes, along, numbers, orientation

Element = ElementTree.Element
Array = NDArray[np.float64]

HIDDEN_GROUP: Final = 3
MOVING: Final = ("hinge", "slide")
DIGITS: Final = 6
_MAIN: Final = "main"
_SIZES: Final = {"sphere": 1, "capsule": 2, "cylinder": 2, "ellipsoid": 3, "box": 3}


@dataclass(frozen=True, slots=True)
class _File:
    """Hold what applies to the whole file."""

    defaults: Mapping[str, Mapping[str, Attributes]]
    colours: Mapping[str, str]
    followed: Mapping[str, str]
    radian: float
    euler_order: str

    def turned(self, attributes: Attributes) -> Array:
        return orientation(attributes, self.radian, self.euler_order)

    def attributes(self, element: Element, child_class: str) -> Attributes:
        """Return an element's attributes, and below them those of its default class."""
        name = element.get("class", child_class)
        return {**self.defaults.get(name, {}).get(element.tag, {}), **element.attrib}


def read_tree(path: Path) -> KinematicTree:
    """Return the tree of the first body of an MJCF file.

    Raises:
        OSError: the file cannot be read.
        ElementTree.ParseError: it is not XML.
    """
    root = ElementTree.parse(path).getroot()
    compiler = root.find("compiler")
    told: Attributes = {} if compiler is None else compiler.attrib
    file = _File(
        defaults=_defaults(root),
        colours={one.get("name", ""): one.get("rgba", "") for one in root.iter("material")},
        followed=read_mjcf_names(path).mimics,
        radian=1.0 if told.get("angle") == "radian" else math.pi / 180.0,
        euler_order=told.get("eulerseq", "xyz"),
    )
    bodies = root.findall("worldbody/body")[:1]
    found = [one for body in bodies for one in _walk(body, "", _MAIN)]
    drawn = [_is_shown(file, geom, cls) for body, _, cls in found for geom in body.findall("geom")]
    links = [
        _link(file, body, parent, child_class, hide=any(drawn))
        for body, parent, child_class in found
    ]
    sites = [
        _site(file, site, body, cls) for body, _, cls in found for site in body.findall("site")
    ]
    return KinematicTree(links=tuple(links), sites=tuple(sites))


def _walk(body: Element, parent: str, child_class: str) -> Iterator[tuple[Element, str, str]]:
    """Yield each body behind its parent, with the default class of what is in it."""
    child_class = body.get("childclass", child_class)
    yield body, parent, child_class
    for child in body.findall("body"):
        yield from _walk(child, body.get("name", ""), child_class)


def _defaults(root: Element) -> dict[str, dict[str, Attributes]]:
    """Return the attributes of each default class by tag, those of outer classes included."""
    classes: dict[str, dict[str, Attributes]] = {}

    def read(element: Element, outer: Mapping[str, Attributes]) -> None:
        own = {tag: dict(attributes) for tag, attributes in outer.items()}
        for child in element:
            if child.tag != "default":
                own[child.tag] = {**own.get(child.tag, {}), **child.attrib}
        classes[element.get("class", _MAIN)] = dict(own)
        for child in element.findall("default"):
            read(child, own)

    for element in root.findall("default"):
        read(element, {})
    return classes


def _link(file: _File, body: Element, parent: str, child_class: str, *, hide: bool) -> Link:
    joints = [_joint(file, joint, child_class) for joint in body.findall("joint")]
    shapes = [
        _shape(file, geom, child_class)
        for geom in body.findall("geom")
        if not hide or _is_shown(file, geom, child_class)
    ]
    return Link(
        name=body.get("name", ""),
        parent=parent,
        position_m=_vector(numbers(body.get("pos", "0 0 0"))),
        quaternion=_vector(file.turned(body.attrib)),
        joints=tuple(joint for joint in joints if joint.kind in MOVING),
        shapes=tuple(shapes),
    )


def _joint(file: _File, joint: Element, child_class: str) -> Joint:
    told = file.attributes(joint, child_class)
    kind, name = told.get("type", "hinge"), told.get("name", "")
    axis = numbers(told.get("axis", "0 0 1"))
    unit = file.radian if kind == "hinge" else 1.0
    return Joint(
        name=name,
        kind=kind,
        axis=_vector(axis / np.linalg.norm(axis)),
        range=_vector(numbers(told["range"]) * unit) if "range" in told else None,
        follows=file.followed.get(name),
    )


def _is_shown(file: _File, geom: Element, child_class: str) -> bool:
    return int(file.attributes(geom, child_class).get("group", "0")) < HIDDEN_GROUP


def _shape(file: _File, geom: Element, child_class: str) -> Shape:
    told = file.attributes(geom, child_class)
    kind = told.get("type", "mesh" if "mesh" in told else "sphere")
    size = numbers(told.get("size", ""))
    position, quaternion = numbers(told.get("pos", "0 0 0")), file.turned(told)
    if "fromto" in told:
        begin, end = np.split(numbers(told["fromto"]), 2)
        # MuJoCo lets z point from the second end to the first one.
        position, quaternion = (begin + end) / 2, along(begin - end)
        size = np.append(size[:1], np.linalg.norm(end - begin) / 2)
    rgba = file.colours.get(told.get("material", ""), "") or told.get("rgba", "")
    return Shape(
        kind=kind,
        size_m=_vector(size[: _SIZES.get(kind, 3)]),
        position_m=_vector(position),
        quaternion=_vector(quaternion),
        rgba=_vector(numbers(rgba)) if rgba else None,
    )


def _site(file: _File, site: Element, body: Element, child_class: str) -> Site:
    told = file.attributes(site, child_class)
    return Site(
        name=told.get("name", ""),
        link=body.get("name", ""),
        position_m=_vector(numbers(told.get("pos", "0 0 0"))),
        quaternion=_vector(file.turned(told)),
    )


def _vector(values: Array) -> Vector:
    return tuple(round(float(value), DIGITS) for value in values)
