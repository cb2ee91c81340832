"""Read a robot's kinematic tree from its MJCF, as text: no simulator is needed to draw it.

Geoms of group 3 and above are left out, as viewers of MJCF hide them, unless there are no others.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from vla_deploy.robots.kinematics.kinematic_tree import Joint, KinematicTree, Link, Site
from vla_deploy.robots.kinematics.mjcf_document import (
    BodyElement,
    Element,
    MjcfDocument,
    read_document,
    vector,
)
from vla_deploy.robots.kinematics.orientation import numbers

Array = NDArray[np.float64]

HIDDEN_GROUP: Final = 3
MOVING: Final = ("hinge", "slide")


def read_tree(path: Path) -> KinematicTree:
    """Return the tree of the first body of an MJCF file.

    Raises:
        OSError: the file cannot be read.
        ElementTree.ParseError: it is not XML.
    """
    return tree_of(read_document(path))


def tree_of(document: MjcfDocument) -> KinematicTree:
    """Return the tree of a document that has been read."""
    hide = any(
        _is_shown(document, geom, body.child_class)
        for body in document.bodies
        for geom in body.element.findall("geom")
    )
    links = [_link(document, body, hide=hide) for body in document.bodies]
    sites = [
        _site(document, site, body)
        for body in document.bodies
        for site in body.element.findall("site")
    ]
    return KinematicTree(links=tuple(links), sites=tuple(sites))


def _link(document: MjcfDocument, body: BodyElement, *, hide: bool) -> Link:
    element, child_class = body.element, body.child_class
    leaders = document.leaders
    joints = [_joint(document, joint, child_class, leaders) for joint in element.findall("joint")]
    shapes = [
        document.shape(document.attributes(geom, child_class))
        for geom in element.findall("geom")
        if not hide or _is_shown(document, geom, child_class)
    ]
    return Link(
        name=body.name,
        parent=body.parent,
        position_m=vector(numbers(element.get("pos", "0 0 0"))),
        quaternion=vector(document.turned(element.attrib)),
        joints=tuple(joint for joint in joints if joint.kind in MOVING),
        shapes=tuple(shapes),
    )


def _joint(
    document: MjcfDocument, joint: Element, child_class: str, leaders: Mapping[str, str]
) -> Joint:
    attributes = document.attributes(joint, child_class)
    kind, name = attributes.get("type", "hinge"), attributes.get("name", "")
    axis = numbers(attributes.get("axis", "0 0 1"))
    unit = document.radian if kind == "hinge" else 1.0
    return Joint(
        name=name,
        kind=kind,
        axis=vector(axis / np.linalg.norm(axis)),
        range=vector(numbers(attributes["range"]) * unit) if "range" in attributes else None,
        position_m=vector(numbers(attributes.get("pos", "0 0 0"))),
        follows=leaders.get(name),
    )


def _is_shown(document: MjcfDocument, geom: Element, child_class: str) -> bool:
    return int(document.attributes(geom, child_class).get("group", "0")) < HIDDEN_GROUP


def _site(document: MjcfDocument, site: Element, body: BodyElement) -> Site:
    attributes = document.attributes(site, body.child_class)
    return Site(
        name=attributes.get("name", ""),
        link=body.name,
        position_m=vector(numbers(attributes.get("pos", "0 0 0"))),
        quaternion=vector(document.turned(attributes)),
    )
