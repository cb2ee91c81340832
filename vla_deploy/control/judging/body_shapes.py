"""Measure how far the robot's parts are from each other and from the floor, with the MJCF's shapes.

Which pairs are judged follows from the file: shapes that no servo moves against each other,
neighbours at one joint, a gripper's fingers among themselves and the pairs that the MJCF or the
robot file excludes are left out.
"""

from collections.abc import Iterator
from typing import NamedTuple
from xml.etree import ElementTree

import coal
import numpy as np
import pinocchio
from numpy.typing import NDArray

from vla_deploy.control.judging.near_pairs import NearPairs
from vla_deploy.control.motion.axes import any_of
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.kinematics.mjcf import read_mjcf_names

Array = NDArray[np.float64]
Pair = tuple[str, str]

FLOOR = "floor"
_FINEST_M = 0.02
# Beyond the least clearance by this, a distance is as good as any larger one.
_LOOK_M = 0.05


class Survey(NamedTuple):
    """Carry the distances of `self_pairs` and `floor_pairs`, and where the hands grip."""

    self_m: Array
    floor_m: Array
    grips: Array


class BodyShapes:
    """Answer for one pose after another; the base stands at the origin of its own frame."""

    def __init__(self, robot: RobotDescription) -> None:
        path = str(robot.mjcf_path)
        self._model = pinocchio.buildModelFromMJCF(path)
        self._data = self._model.createData()
        self._neutral = pinocchio.neutral(self._model)
        mimics = read_mjcf_names(robot.mjcf_path).mimics
        self._leaders = {**{name: name for name in robot.joint_names}, **mimics}
        self._parents = list(self._model.parents)
        self._movers = [self._servos_to(joint) for joint in range(self._model.njoints)]
        index = robot.joint_index
        moved = [(self._model.getJointId(n), index[of]) for n, of in self._leaders.items()]
        self._places = np.array([self._model.idx_qs[joint] for joint, _ in moved])
        self._sources = np.array([source for _, source in moved])
        self._grips = [
            self._model.getFrameId(robot.hands[name].grip_site)
            for name in robot.protection.workspaces
        ]
        shapes = pinocchio.buildGeomFromMJCF(self._model, path, pinocchio.GeometryType.COLLISION)
        self._shapes = self._with_pairs(shapes, robot)
        self._results = self._shapes.createData()
        self._surveyed: tuple[Array, Survey] | None = None
        limits = robot.protection.clearance
        self._near = NearPairs(
            self._model,
            self._shapes,
            {int(joint): int(column) for joint, column in moved},
            len(robot.joint_names),
            max(limits.self_m, limits.floor_m) + _LOOK_M,
        )
        self._covers = [
            _cover(shape)
            for shape in self._shapes.geometryObjects
            if self._movers[shape.parentJoint]
        ]
        self._radii_m = np.concatenate([np.full(len(c), r) for _, c, r in self._covers])
        names = [shape.name for shape in self._shapes.geometryObjects]
        pairs = [(names[p.first], names[p.second]) for p in self._shapes.collisionPairs]
        self._is_floor = np.array([second == FLOOR for _, second in pairs], dtype=np.bool_)
        self.self_pairs: list[Pair] = [pair for pair in pairs if pair[1] != FLOOR]
        self.floor_pairs: list[Pair] = [pair for pair in pairs if pair[1] == FLOOR]

    def distances(self, positions: Array) -> tuple[Array, Array]:
        """Return the distances of `self_pairs` and of `floor_pairs`, negative in overlap."""
        q = self._expand(positions)
        pinocchio.computeDistances(self._model, self._data, self._shapes, self._results, q)
        found = np.array([result.min_distance for result in self._results.distanceResults])
        return found[~self._is_floor], found[self._is_floor]

    def survey(self, positions: Array) -> Survey:
        """Return what `distances` and `grips` do; the pose of the last call costs nothing again.

        For pairs that are too far apart to matter, the distance is only a bound.
        """
        if self._surveyed is None or any_of(positions != self._surveyed[0]):
            found = self._near.distances(
                self._model, self._data, self._expand(positions), positions
            )
            survey = Survey(found[~self._is_floor], found[self._is_floor], self._grips_here())
            self._surveyed = positions.copy(), survey
        return self._surveyed[1]

    def balls(self, positions: Array) -> tuple[Array, Array]:
        """Return centres, (n, 3) in the base frame, and radii of balls that cover what moves."""
        q = self._expand(positions)
        pinocchio.forwardKinematics(self._model, self._data, q)
        centres = [
            local @ self._data.oMi[joint].rotation.T + self._data.oMi[joint].translation
            for joint, local, _ in self._covers
        ]
        return np.concatenate(centres), self._radii_m

    def grips(self, positions: Array) -> Array:
        """Return where the hands with a workspace grip, (n, 3) in the base frame."""
        pinocchio.forwardKinematics(self._model, self._data, self._expand(positions))
        return self._grips_here()

    def _grips_here(self) -> Array:
        """Return where the hands grip in the pose that the model's data are in."""
        for frame in self._grips:
            pinocchio.updateFramePlacement(self._model, self._data, frame)
        points = [self._data.oMf[frame].translation for frame in self._grips]
        return np.array(points, dtype=np.float64).reshape(-1, 3)

    def centre_of_mass(self, positions: Array) -> Array:
        """Return the whole robot's centre of mass in the base frame."""
        centre = pinocchio.centerOfMass(self._model, self._data, self._expand(positions))
        return np.array(centre, dtype=np.float64)

    def _expand(self, positions: Array) -> Array:
        q: Array = self._neutral.copy()
        q[self._places] = positions[self._sources]
        return q

    def _with_pairs(
        self, shapes: pinocchio.GeometryModel, robot: RobotDescription
    ) -> pinocchio.GeometryModel:
        allowed = {frozenset(pair) for pair in robot.protection.clearance.allow}
        excluded = set(_excluded_bodies(robot))
        objects = list(shapes.geometryObjects)
        # Read once: each look at pinocchio's own lists copies what it returns.
        bodies = [str(self._model.frames[shape.parentFrame].name) for shape in objects]
        names = [str(shape.name) for shape in objects]
        joints = [int(shape.parentJoint) for shape in objects]
        for second in range(len(objects)):
            for first in range(second):
                if (
                    self._may_collide(joints[first], joints[second])
                    and frozenset((bodies[first], bodies[second])) not in excluded
                    and frozenset((names[first], names[second])) not in allowed
                ):
                    shapes.addCollisionPair(pinocchio.CollisionPair(first, second))
        self._add_floor(shapes, objects)
        return shapes

    def _add_floor(
        self, shapes: pinocchio.GeometryModel, objects: list[pinocchio.GeometryObject]
    ) -> None:
        plane = coal.Halfspace(np.array((0.0, 0.0, 1.0)), 0.0)
        below = pinocchio.GeometryObject(FLOOR, 0, pinocchio.SE3.Identity(), plane)
        floor = shapes.addGeometryObject(below)
        for index, shape in enumerate(objects):
            if self._movers[shape.parentJoint]:
                shapes.addCollisionPair(pinocchio.CollisionPair(index, floor))

    def _may_collide(self, first: int, second: int) -> bool:
        """Return whether shapes that these joints carry are moved against each other."""
        parents = self._parents
        if first == second or parents[first] == second or parents[second] == first:
            return False
        between = self._movers[first] ^ self._movers[second]
        return len(between) > 1

    def _servos_to(self, joint: int) -> frozenset[str]:
        """Return the servo joints between the base and a joint, that joint included."""
        found = set()
        while joint > 0:
            name = self._model.names[joint]
            if name in self._leaders:
                found.add(self._leaders[name])
            joint = self._parents[joint]
        return frozenset(found)


def _cover(shape: pinocchio.GeometryObject) -> tuple[int, Array, float]:
    """Return the joint that carries a shape, and balls in a row along its longest axis."""
    shape.geometry.computeLocalAABB()
    box = shape.geometry.aabb_local
    half = 0.5 * (np.array(box.max_) - np.array(box.min_))
    axis = int(half.argmax())
    radius_m = float(np.delete(half, axis).max())
    reach_m = max(0.0, float(half[axis]) - 0.5 * radius_m)
    count = 1 + int(np.ceil(2.0 * reach_m / max(radius_m, _FINEST_M)))
    local = np.outer(np.linspace(-reach_m, reach_m, count), np.eye(3)[axis])
    place = shape.placement
    return shape.parentJoint, local @ place.rotation.T + place.translation, radius_m


def _excluded_bodies(robot: RobotDescription) -> Iterator[frozenset[str]]:
    root = ElementTree.parse(robot.mjcf_path).getroot()
    for exclude in root.findall("contact/exclude"):
        yield frozenset((exclude.get("body1", ""), exclude.get("body2", "")))
