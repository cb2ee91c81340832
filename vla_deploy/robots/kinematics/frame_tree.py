"""Hold a robot's frames as ROS names them, and compute where each is in its parent.

`base_link` is the MJCF's root body (REP 105: x forward, z up); every other body keeps its name.
Positions are metres, quaternions x, y, z, w.
"""

from collections import Counter
from collections.abc import Collection, Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vla_deploy.robots.description import RobotDescription
from vla_deploy.robots.errors import RobotFileError
from vla_deploy.robots.kinematics.kinematic_tree import Joint, KinematicTree, Link
from vla_deploy.robots.kinematics.mjcf_document import Element, MjcfDocument, read_document, vector
from vla_deploy.robots.kinematics.orientation import (
    UNTURNED,
    matrix,
    numbers,
    product,
    quaternion_of,
)
from vla_deploy.robots.kinematics.tree_reader import MOVING, tree_of
from vla_deploy.runtime.table_schema import TableFault

Array = NDArray[np.float64]

BASE_FRAME: Final = "base_link"
LIDAR_FRAME: Final = "lidar_link"
IMU_FRAME: Final = "imu_link"
CAMERA_FRAME: Final = "camera_link"
OPTICAL_FRAME: Final = "camera_color_optical_frame"
# REP 103: from x forward, y left, z up to z forward, x right, y down.
BODY_TO_OPTICAL: Final = (-0.5, 0.5, -0.5, 0.5)
FIXED: Final = "fixed"
_ORIGIN: Final = (0.0, 0.0, 0.0)
_NOT_READ: Final = ("include", "frame", "replicate", "composite", "flexcomp", "attach")
_LOOPS: Final = ("connect", "weld")


class FrameTransform(NamedTuple):
    """Give where a frame is in its parent."""

    parent: str
    child: str
    xyz: tuple[float, ...]
    quaternion: tuple[float, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class JointCoupling:
    """Give a joint's value: `offset + multiplier * value` of the joint `leader`."""

    leader: str
    multiplier: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class FrameJoint:
    """Join a frame to its parent, as URDF does.

    `kind` is "revolute", "continuous", "prismatic" or "fixed". The axis is in the child's frame;
    the child is at `xyz`, `quaternion` in its parent while the joint is at zero.
    """

    name: str
    kind: str
    parent: str
    child: str
    xyz: tuple[float, ...] = _ORIGIN
    quaternion: tuple[float, ...] = UNTURNED
    axis: tuple[float, ...] = _ORIGIN
    coupling: JointCoupling | None = None


class FrameTree:
    """Answer where all frames are for given joint values; reads no file after `of`."""

    def __init__(self, joints: tuple[FrameJoint, ...]) -> None:
        """Keep the joints, each behind the one that its parent frame hangs on."""
        self.joints = joints
        self.moving = tuple(joint for joint in joints if joint.kind != FIXED)
        self.fixed = tuple(
            FrameTransform(joint.parent, joint.child, joint.xyz, joint.quaternion)
            for joint in joints
            if joint.kind == FIXED
        )
        count = len(self.moving)
        coupled = [joint.coupling or JointCoupling(leader=joint.name) for joint in self.moving]
        self._leaders = [one.leader for one in coupled]
        self._multipliers = np.array([one.multiplier for one in coupled])
        self._offsets = np.array([one.offset for one in coupled])
        self._names = [(joint.parent, joint.child) for joint in self.moving]
        self._places = np.array([joint.xyz for joint in self.moving]).reshape(count, 3)
        self._stand = np.array([joint.quaternion for joint in self.moving]).reshape(count, 4)
        axes = np.array([joint.axis for joint in self.moving]).reshape(count, 3)
        self._slides = np.array([joint.kind == "prismatic" for joint in self.moving], dtype=bool)
        slides = self._slides[:, None]
        self._turns = np.where(slides, 0.0, axes)
        along = [matrix(stand) @ axis for stand, axis in zip(self._stand, axes, strict=True)]
        self._shifts = np.where(slides, np.array(along).reshape(count, 3), 0.0)

    @classmethod
    def of(cls, robot: RobotDescription) -> "FrameTree":
        """Return the tree of a robot: its bodies, the sensors' frames and the grips.

        What no servo and no drive moves is fixed where it is at zero.

        Raises:
            RobotFileError: the MJCF has something that URDF has no form for; all faults are listed.
        """
        return cls(joints_of(robot, read_document(robot.mjcf_path)))

    def transforms(self, positions: Mapping[str, float]) -> list[FrameTransform]:
        """Return where each moving frame is in its parent; followers take their leaders' values.

        `positions` are in rad, or in m for a finger; joints that it does not name are at zero, and
        names of other joints do not count.
        """
        leading = np.array([positions.get(name, 0.0) for name in self._leaders])
        values = (self._offsets + self._multipliers * leading)[:, None]
        places = self._places + self._shifts * values
        turns = np.hstack((self._turns * np.sin(values / 2), np.cos(values / 2)))
        turns[self._slides, 3] = 1.0
        turned = _products(self._stand, turns)
        return [
            FrameTransform(parent, child, tuple(xyz), tuple(quaternion))
            for (parent, child), xyz, quaternion in zip(
                self._names, places.tolist(), turned.tolist(), strict=True
            )
        ]


def joints_of(robot: RobotDescription, document: MjcfDocument) -> tuple[FrameJoint, ...]:
    """Return the joints between a robot's frames, each behind the one that its parent hangs on.

    Raises:
        RobotFileError: the MJCF has something that URDF has no form for; all faults are listed.
    """
    tree, leads = tree_of(document), {*robot.joint_names, *_wheels(robot)}
    faults = [
        *_unread(document),
        *_coupling_faults(document, leads),
        *_joint_faults(document, leads),
    ]
    _refuse(document, faults)
    couplings = {leader: JointCoupling(leader=leader) for leader in leads} | _couplings(document)
    root = tree.links[0].name
    found = [one for link in tree.links[1:] for one in _body_joints(link, couplings, robot)]
    found += _device_frames(robot, tree)
    joints = [replace(one, parent=BASE_FRAME) if one.parent == root else one for one in found]
    _refuse(document, _name_faults(joints))
    return tuple(joints)


def _wheels(robot: RobotDescription) -> tuple[str, ...]:
    return tuple(drive.joint for drive in robot.parts.can_bus.drives) if robot.parts.can_bus else ()


def _refuse(document: MjcfDocument, faults: Iterable[TableFault]) -> None:
    if listed := tuple(faults):
        raise RobotFileError(document.path, listed)


def _unread(document: MjcfDocument) -> Iterator[TableFault]:
    for tag in _NOT_READ:
        if document.root.find(f".//{tag}") is not None:
            yield TableFault(
                key=tag, got=f"a <{tag}>", expected="bodies, joints and geoms written out"
            )
    for tag in _LOOPS:
        if document.root.find(f"equality/{tag}") is not None:
            expected = "a tree of bodies: URDF has no closed loops"
            yield TableFault(key=f"equality.{tag}", got=f"a <{tag}>", expected=expected)


def _coupling_faults(document: MjcfDocument, leads: Container[str]) -> Iterator[TableFault]:
    for couple in document.root.findall("equality/joint"):
        key, leader = f"equality.joint {couple.get('joint1', '')}", couple.get("joint2", "")
        if leader not in leads:
            got = f"joint2 {leader!r}"
            yield TableFault(key=key, got=got, expected="a joint that a servo or a drive moves")
        if np.any(_polynomial(couple)[2:] != 0.0):
            got = f"polycoef {couple.get('polycoef', '')}"
            yield TableFault(
                key=key, got=got, expected="a straight line: zeros behind the second number"
            )


def _polynomial(couple: Element) -> Array:
    return numbers(couple.get("polycoef", "0 1 0 0 0"))


def _couplings(document: MjcfDocument) -> dict[str, JointCoupling]:
    couplings = {}
    for couple in document.root.findall("equality/joint"):
        offset, multiplier, *_ = map(float, _polynomial(couple))
        couplings[couple.get("joint1", "")] = JointCoupling(
            leader=couple.get("joint2", ""), multiplier=multiplier, offset=offset
        )
    return couplings


def _joint_faults(document: MjcfDocument, leads: Collection[str]) -> Iterator[TableFault]:
    moving = {*leads, *document.leaders}
    for body in document.bodies:
        if not body.name:
            yield TableFault(
                key="body", got=f"one without a name in {body.parent!r}", expected="a name"
            )
        for joint in body.element.findall("joint"):
            attributes = document.attributes(joint, body.child_class)
            name, kind = attributes.get("name", ""), attributes.get("type", "hinge")
            if name not in moving:
                continue
            if kind not in MOVING:
                yield TableFault(
                    key=f"joint {name}", got=f"a {kind} joint", expected="a hinge or a slide"
                )
            if float(attributes.get("ref", "0")) != 0.0:
                expected = "no ref: the joint's zero is where the body is drawn"
                yield TableFault(
                    key=f"joint {name}", got=f"ref {attributes['ref']}", expected=expected
                )
            if not body.parent:
                expected = "a root body that nothing moves against the base"
                yield TableFault(
                    key=f"joint {name}", got="a joint of the root body", expected=expected
                )


def _name_faults(joints: Sequence[FrameJoint]) -> Iterator[TableFault]:
    frames = Counter([BASE_FRAME, *(joint.child for joint in joints)])
    names = Counter(joint.name for joint in joints)
    for kind, counts in (("frame", frames), ("joint", names)):
        for name, count in counts.items():
            if count > 1:
                got = f"{count} {kind}s of that name"
                yield TableFault(
                    key=f"{kind} {name}", got=got, expected="one: rename a body or a site"
                )


def _body_joints(
    link: Link, couplings: Mapping[str, JointCoupling], robot: RobotDescription
) -> Iterator[FrameJoint]:
    """Yield what joins a body to its parent: a joint, or several with frames between them."""
    joints = [joint for joint in link.joints if joint.name in couplings]
    parent, before = link.parent, np.zeros(3)
    xyz, quaternion = np.array(link.position_m), link.quaternion
    for joint in joints:
        anchor = np.array(joint.position_m) if joint.kind == "hinge" else before
        is_last = joint is joints[-1] and not anchor.any()
        child = link.name if is_last else f"{joint.name}_link"
        coupling = couplings[joint.name]
        yield FrameJoint(
            name=joint.name,
            kind=_kind(joint, coupling, robot),
            parent=parent,
            child=child,
            xyz=vector(xyz + matrix(np.array(quaternion)) @ (anchor - before)),
            quaternion=quaternion,
            axis=joint.axis,
            coupling=None if coupling.leader == joint.name else coupling,
        )
        parent, before, xyz, quaternion = child, anchor, np.zeros(3), UNTURNED
    if parent != link.name:
        yield _fixed(parent, link.name, xyz - before, np.array(quaternion))


def _kind(joint: Joint, coupling: JointCoupling, robot: RobotDescription) -> str:
    if joint.kind == "slide":
        return "prismatic"
    return "continuous" if coupling.leader in _wheels(robot) else "revolute"


def _fixed(parent: str, child: str, xyz: Array, quaternion: Array) -> FrameJoint:
    return FrameJoint(
        name=f"{child}_fixed",
        kind=FIXED,
        parent=parent,
        child=child,
        xyz=vector(xyz),
        quaternion=vector(quaternion),
    )


def _device_frames(robot: RobotDescription, tree: KinematicTree) -> Iterator[FrameJoint]:
    """Yield the frames of sensors and grips; the camera's is where its calibration puts it."""
    sites = {site.name: site for site in tree.sites}
    grips = dict.fromkeys(hand.grip_site for hand in robot.hands.values())
    parts = robot.parts
    found = ((parts.lidar, LIDAR_FRAME), (parts.imu, IMU_FRAME))
    sensors = [(sensor.site, frame) for sensor, frame in found if sensor is not None]
    for name, frame in (*sensors, *((grip, grip) for grip in grips)):
        site = sites[name]
        yield _fixed(site.link, frame, np.array(site.position_m), np.array(site.quaternion))
    if parts.camera is None:
        return
    site, moved = sites[parts.camera.site], parts.camera.site_from_camera
    stand = np.array(site.quaternion)
    place = np.array(site.position_m) + matrix(stand) @ moved[:3, 3]
    optical_to_body = np.array(BODY_TO_OPTICAL) * (-1.0, -1.0, -1.0, 1.0)
    turned = product(product(stand, quaternion_of(moved[:3, :3])), optical_to_body)
    yield _fixed(site.link, CAMERA_FRAME, place, turned)
    yield _fixed(CAMERA_FRAME, OPTICAL_FRAME, np.zeros(3), np.array(BODY_TO_OPTICAL))


def _products(first: Array, then: Array) -> Array:
    """Return the turns of frames that are turned by `first` and, within that, by `then`, n x 4."""
    return product(first.T, then.T).T
