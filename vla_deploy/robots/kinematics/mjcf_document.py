"""Parse an MJCF file as text: bodies in order, attributes with their defaults, angles in radians.

Only what the first body of the world holds is read, as pinocchio does.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from vla_deploy.robots.kinematics.kinematic_tree import Shape, Vector
from vla_deploy.robots.kinematics.orientation import Attributes, along, numbers, orientation

Element = ElementTree.Element
Array = NDArray[np.float64]

_MAIN: Final = "main"
_SIZES: Final = {"sphere": 1, "capsule": 2, "cylinder": 2, "ellipsoid": 3, "box": 3}
_ROUND: Final = ("capsule", "cylinder")


@dataclass(frozen=True, slots=True, kw_only=True)
class BodyElement:
    """Hold a body's element, its parent's name, and the default class of what is in it."""

    element: Element
    parent: str
    child_class: str

    @property
    def name(self) -> str:
        """Return the body's name, empty if it has none."""
        return self.element.get("name", "")


@dataclass(frozen=True, slots=True, kw_only=True)
class MjcfDocument:
    """Hold an MJCF file: its root element, its bodies from the root outwards, its defaults."""

    path: Path
    root: Element
    bodies: tuple[BodyElement, ...]
    defaults: Mapping[str, Mapping[str, Attributes]]
    colours: Mapping[str, str]
    compiler: Attributes
    radian: float

    @property
    def leaders(self) -> Mapping[str, str]:
        """Return the joint that each coupled joint follows."""
        couples = self.root.findall("equality/joint")
        return {one.get("joint1", ""): one.get("joint2", "") for one in couples}

    def attributes(self, element: Element, child_class: str) -> Attributes:
        """Return an element's attributes, and below them those of its default class."""
        name = element.get("class", child_class)
        return {**self.defaults.get(name, {}).get(element.tag, {}), **element.attrib}

    def turned(self, attributes: Attributes) -> Array:
        """Return how an element is turned in its parent, as a quaternion x, y, z, w."""
        return orientation(attributes, self.radian, self.compiler.get("eulerseq", "xyz"))

    def shape(self, attributes: Attributes) -> Shape:
        """Return the shape that a geom's attributes describe, in its body's frame."""
        kind = attributes.get("type", "mesh" if "mesh" in attributes else "sphere")
        size = numbers(attributes.get("size", ""))
        position, quaternion = numbers(attributes.get("pos", "0 0 0")), self.turned(attributes)
        if "fromto" in attributes:
            begin, end = np.split(numbers(attributes["fromto"]), 2)
            # MuJoCo lets z point from the second end to the first one.
            position, quaternion = (begin + end) / 2, along(begin - end)
            width = size[:1] if kind in _ROUND else np.repeat(size[:1], 2)
            size = np.append(width, np.linalg.norm(end - begin) / 2)
        rgba = self.colours.get(attributes.get("material", ""), "") or attributes.get("rgba", "")
        return Shape(
            kind=kind,
            size_m=vector(size[: _SIZES.get(kind, 3)]),
            position_m=vector(position),
            quaternion=vector(quaternion),
            rgba=vector(numbers(rgba)) if rgba else None,
        )


def read_document(path: Path) -> MjcfDocument:
    """Return an MJCF file's document.

    Raises:
        OSError: the file cannot be read.
        ElementTree.ParseError: it is not XML.
    """
    root = ElementTree.parse(path).getroot()
    compiler = root.find("compiler")
    attributes: Attributes = {} if compiler is None else dict(compiler.attrib)
    first = root.findall("worldbody/body")[:1]
    return MjcfDocument(
        path=path,
        root=root,
        bodies=tuple(found for body in first for found in _walk(body, "", _MAIN)),
        defaults=_defaults(root),
        colours={one.get("name", ""): one.get("rgba", "") for one in root.iter("material")},
        compiler=attributes,
        radian=1.0 if attributes.get("angle") == "radian" else math.pi / 180.0,
    )


def vector(values: Array) -> Vector:
    """Return an array's numbers as a tuple of floats."""
    return tuple(float(value) for value in values)


def _walk(body: Element, parent: str, child_class: str) -> Iterator[BodyElement]:
    """Yield each body behind its parent."""
    child_class = body.get("childclass", child_class)
    yield BodyElement(element=body, parent=parent, child_class=child_class)
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
