"""Write a robot as URDF: the frames of `FrameTree`, with the masses and shapes of the MJCF.

Needs no simulator and no pinocchio: the robot description is published by a process without them.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Final, NamedTuple
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from vla_deploy.robots.description import RobotDescription
from vla_deploy.robots.kinematics.frame_tree import (
    BASE_FRAME,
    FIXED,
    FrameJoint,
    JointCoupling,
    joints_of,
)
from vla_deploy.robots.kinematics.inertia import LinkInertia, inertia_of
from vla_deploy.robots.kinematics.kinematic_tree import Shape, Vector
from vla_deploy.robots.kinematics.mjcf_document import (
    BodyElement,
    MjcfDocument,
    read_document,
    vector,
)
from vla_deploy.robots.kinematics.orientation import Attributes, along, matrix, numbers, product
from vla_deploy.robots.kinematics.tree_reader import tree_of

Array = NDArray[np.float64]
Element = ElementTree.Element

_TENSOR: Final = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
_COLLIDES: Final = "1"
_ROUND_M: Final = 1e-6


class _Form(NamedTuple):
    """Hold a shape that URDF has, at a height on the z axis of the MJCF shape it stands for."""

    tag: str
    attributes: Mapping[str, str]
    height_m: float = 0.0


def urdf_of(robot: RobotDescription) -> str:
    """Return a robot as a URDF document: links, inertias, shapes, joints, limits, sensor frames.

    Raises:
        RobotFileError: the MJCF has something that URDF has no form for.
        OSError: the MJCF cannot be read.
    """
    document = read_document(robot.mjcf_path)
    joints = joints_of(robot, document)
    top = Element("robot", name=robot.name)
    source = f"Made from {robot.mjcf_path.name} by `vla-deploy robot urdf`: change that file."
    top.append(ElementTree.Comment(f" {source} "))
    drawn = {link.name: link.shapes for link in tree_of(document).links}
    colours = dict.fromkeys(shape.rgba for shapes in drawn.values() for shape in shapes)
    paints = {rgba: f"colour_{i}" for i, rgba in enumerate(filter(None, colours), 1)}
    for rgba, name in paints.items():
        paint = ElementTree.SubElement(top, "material", name=name)
        ElementTree.SubElement(paint, "color", rgba=_text(rgba))
    bodies = {BASE_FRAME: document.bodies[0], **{body.name: body for body in document.bodies[1:]}}
    for frame in (BASE_FRAME, *(joint.child for joint in joints)):
        link = ElementTree.SubElement(top, "link", name=frame)
        if body := bodies.get(frame):
            _fill(link, document, body, drawn[body.name], paints)
    dynamics = _joint_attributes(document)
    top.extend(_joint(robot, joint, dynamics.get(joint.name, {})) for joint in joints)
    ElementTree.indent(top)
    return '<?xml version="1.0"?>\n' + ElementTree.tostring(top, encoding="unicode") + "\n"


def _fill(
    link: Element,
    document: MjcfDocument,
    body: BodyElement,
    drawn: Sequence[Shape],
    paints: Mapping[Vector, str],
) -> None:
    inertia = inertia_of(document, body)
    if inertia is not None:
        link.append(_inertial(inertia))
    for shape in drawn:
        for visual in _parts(link, "visual", shape):
            if shape.rgba is not None:
                ElementTree.SubElement(visual, "material", name=paints[shape.rgba])
    for shape in _colliding(document, body):
        _parts(link, "collision", shape)


def _inertial(inertia: LinkInertia) -> Element:
    element = Element("inertial")
    ElementTree.SubElement(element, "origin", xyz=_text(inertia.centre_m), rpy="0 0 0")
    ElementTree.SubElement(element, "mass", value=_text((inertia.mass_kg,)))
    upper = inertia.tensor_kg_m2[np.triu_indices(3)]
    values = {name: _text((value,)) for name, value in zip(_TENSOR, upper, strict=True)}
    ElementTree.SubElement(element, "inertia", values)
    return element


def _colliding(document: MjcfDocument, body: BodyElement) -> Iterator[Shape]:
    for geom in body.element.findall("geom"):
        attributes = document.attributes(geom, body.child_class)
        if int(attributes.get("contype", _COLLIDES)) or int(
            attributes.get("conaffinity", _COLLIDES)
        ):
            yield document.shape(attributes)


def _parts(link: Element, use: str, shape: Shape) -> list[Element]:
    """Append a shape to a link as visual or collision elements, one or several; return them."""
    if shape.kind == "ellipsoid":
        shape = _around(shape) if use == "collision" else _like(shape)
    forms = _forms(shape)
    if not forms:
        link.append(ElementTree.Comment(f" a {shape.kind} is left out here ({use}) "))
    turned, parts = np.array(shape.quaternion), []
    for form in forms:
        place = np.array(shape.position_m) + matrix(turned) @ np.array((0.0, 0.0, form.height_m))
        part = ElementTree.SubElement(link, use)
        part.append(_origin(place, turned))
        geometry = ElementTree.SubElement(part, "geometry")
        ElementTree.SubElement(geometry, form.tag, dict(form.attributes))
        parts.append(part)
    return parts


def _forms(shape: Shape) -> list[_Form]:
    size = shape.size_m
    if shape.kind == "box":
        return [_Form("box", {"size": _text([2 * half for half in size])})]
    if shape.kind == "sphere":
        return [_sphere(size[0])]
    if shape.kind == "cylinder":
        return [_cylinder(*size)]
    if shape.kind == "capsule":
        radius, half = size
        return [_cylinder(radius, half), _sphere(radius, half), _sphere(radius, -half)]
    return []


def _sphere(radius: float, height: float = 0.0) -> _Form:
    return _Form("sphere", {"radius": _text((radius,))}, height)


def _cylinder(radius: float, half: float) -> _Form:
    return _Form("cylinder", {"radius": _text((radius,)), "length": _text((2 * half,))})


def _around(ellipsoid: Shape) -> Shape:
    """Return the smaller one of the sphere and the box that hold an ellipsoid."""
    half = ellipsoid.size_m
    if 4 / 3 * math.pi * max(half) ** 3 < 8 * math.prod(half):
        return replace(ellipsoid, kind="sphere", size_m=(max(half),))
    return replace(ellipsoid, kind="box")


def _like(ellipsoid: Shape) -> Shape:
    """Return a capsule as long as an ellipsoid, and as thick as it is on average across."""
    half = ellipsoid.size_m
    longest = int(np.argmax(half))
    radius = math.sqrt(math.prod(half) / half[longest])
    if half[longest] - radius < _ROUND_M:
        return replace(ellipsoid, kind="sphere", size_m=(radius,))
    turned = product(np.array(ellipsoid.quaternion), along(np.eye(3)[longest]))
    size = (radius, half[longest] - radius)
    return replace(ellipsoid, kind="capsule", size_m=size, quaternion=vector(turned))


def _joint_attributes(document: MjcfDocument) -> dict[str, Attributes]:
    found = {}
    for body in document.bodies:
        for joint in body.element.findall("joint"):
            attributes = document.attributes(joint, body.child_class)
            found[attributes.get("name", "")] = attributes
    return found


def _joint(robot: RobotDescription, joint: FrameJoint, attributes: Attributes) -> Element:
    element = Element("joint", name=joint.name, type=joint.kind)
    element.append(_origin(np.array(joint.xyz), np.array(joint.quaternion)))
    ElementTree.SubElement(element, "parent", link=joint.parent)
    ElementTree.SubElement(element, "child", link=joint.child)
    if joint.kind == FIXED:
        return element
    ElementTree.SubElement(element, "axis", xyz=_text(joint.axis))
    limit = _limit(robot, joint, attributes)
    if limit is not None:
        ElementTree.SubElement(element, "limit", limit)
    damping, friction = (_first(attributes, name) for name in ("damping", "frictionloss"))
    if damping or friction:
        values = {"damping": _text((damping,)), "friction": _text((friction,))}
        ElementTree.SubElement(element, "dynamics", values)
    if joint.coupling is not None:
        multiplier, offset = _text((joint.coupling.multiplier,)), _text((joint.coupling.offset,))
        leader = joint.coupling.leader
        ElementTree.SubElement(element, "mimic", joint=leader, multiplier=multiplier, offset=offset)
    return element


def _first(attributes: Attributes, name: str) -> float:
    """Return a coefficient; MuJoCo takes further ones for terms that URDF does not have."""
    return float(numbers(attributes.get(name, "0"))[0])


def _limit(
    robot: RobotDescription, joint: FrameJoint, attributes: Attributes
) -> dict[str, str] | None:
    """Return a joint's bounds; a follower's are what its leader's make of it."""
    coupling = joint.coupling or JointCoupling(leader=joint.name)
    if coupling.leader not in robot.joint_names:
        return _wheel_limit(robot, attributes)
    limits, factor = robot.limits[coupling.leader], coupling.multiplier
    ends = sorted(coupling.offset + factor * end for end in (limits.min, limits.max))
    return {
        "lower": _text(ends[:1]),
        "upper": _text(ends[1:]),
        "velocity": _text((abs(factor) * limits.velocity,)),
        "effort": _text((robot.stall_effort(coupling.leader),)),
    }


def _wheel_limit(robot: RobotDescription, attributes: Attributes) -> dict[str, str] | None:
    """Return a wheel's bounds, or None where the MJCF does not bound its torque."""
    if "actuatorfrcrange" not in attributes:
        return None
    base = robot.base
    speed = base.max_speed_m_s + base.max_turn_rad_s * base.lever_m
    effort = np.abs(numbers(attributes["actuatorfrcrange"])).max()
    return {"velocity": _text((speed / base.wheel_radius_m,)), "effort": _text((effort,))}


def _origin(xyz: Array, quaternion: Array) -> Element:
    return Element("origin", xyz=_text(xyz), rpy=_text(roll_pitch_yaw(matrix(quaternion))))


def roll_pitch_yaw(rotation: Array) -> tuple[float, float, float]:
    """Return URDF's angles of a rotation, in rad: about the fixed axes x, then y, then z."""
    yaw = math.atan2(rotation[1, 0], rotation[0, 0])
    pitch = math.atan2(-rotation[2, 0], math.hypot(rotation[0, 0], rotation[1, 0]))
    # Where x points straight up or down, any yaw will do: the roll belongs to the one chosen.
    sine, cosine = math.sin(yaw), math.cos(yaw)
    roll = math.atan2(
        sine * rotation[0, 2] - cosine * rotation[1, 2],
        cosine * rotation[1, 1] - sine * rotation[0, 1],
    )
    return roll, pitch, yaw


def _text(values: Iterable[float]) -> str:
    """Return numbers as URDF has them, exact to 15 digits; what is less than 1e-15 is zero."""
    return " ".join(f"{0.0 if abs(value) < 1e-15 else value:.15g}" for value in values)
