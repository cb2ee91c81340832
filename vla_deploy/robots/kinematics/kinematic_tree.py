"""Hold a robot's links as a tree, and compute where they are for given joint values.

Positions are metres, quaternions x, y, z, w; each is relative to the parent link.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vla_deploy.robots.kinematics.orientation import matrix, turn

Array = NDArray[np.float64]
Vector = tuple[float, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Joint:
    """Turn ("hinge") or shift ("slide") a link about or along an axis of its own frame.

    The axis of a hinge goes through `position_m`, in the link's frame. A joint that `follows`
    another has that one's value.
    """

    name: str
    kind: str
    axis: Vector
    range: Vector | None
    position_m: Vector = (0.0, 0.0, 0.0)
    follows: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Shape:
    """Draw one primitive; `size_m` are MJCF's half sizes, `rgba` is from 0 to 1."""

    kind: str
    size_m: Vector
    position_m: Vector
    quaternion: Vector
    rgba: Vector | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Site:
    """Mark a frame on a link."""

    name: str
    link: str
    position_m: Vector
    quaternion: Vector


@dataclass(frozen=True, slots=True, kw_only=True)
class Link:
    """Hold what moves as one; `parent` is empty for the root."""

    name: str
    parent: str
    position_m: Vector
    quaternion: Vector
    joints: tuple[Joint, ...]
    shapes: tuple[Shape, ...]


@dataclass(frozen=True, kw_only=True)
class KinematicTree:
    """Hold all links, each behind its parent, and the sites on them."""

    links: tuple[Link, ...]
    sites: tuple[Site, ...]

    def site_pose(self, site: str, positions: Mapping[str, float]) -> Array:
        """Return a site's pose in the root link's frame, 4 x 4; joints not named are at zero.

        Raises:
            KeyError: there is no such site.
        """
        marked = self._sites[site]
        pose = _pose(marked.position_m, marked.quaternion)
        name = marked.link
        while name:
            link = self._links[name]
            pose = _link_pose(link, positions) @ pose
            name = link.parent
        return pose

    @cached_property
    def _links(self) -> Mapping[str, Link]:
        return {link.name: link for link in self.links}

    @cached_property
    def _sites(self) -> Mapping[str, Site]:
        return {site.name: site for site in self.sites}


def _link_pose(link: Link, positions: Mapping[str, float]) -> Array:
    pose = _pose(link.position_m, link.quaternion)
    for joint in link.joints:
        value = positions.get(joint.follows or joint.name, 0.0)
        axis = np.array(joint.axis)
        moved = np.eye(4)
        if joint.kind == "slide":
            moved[:3, 3] = value * axis
        else:
            anchor = np.array(joint.position_m)
            moved[:3, :3] = matrix(turn(axis, value))
            moved[:3, 3] = anchor - moved[:3, :3] @ anchor
        pose = pose @ moved
    return pose


def _pose(position_m: Vector, quaternion: Vector) -> Array:
    pose = np.eye(4)
    pose[:3, :3] = matrix(np.array(quaternion))
    pose[:3, 3] = position_m
    return pose
