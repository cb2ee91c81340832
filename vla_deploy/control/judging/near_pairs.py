"""Measure the distances of the pairs that are near, and leave alone those that cannot have become.

However the joints move, a shape moves no further than each joint's turn times the length of what
the joint carries up to it. So a pair that was far is measured again only after as much motion as
could have brought it near.
"""

import coal
import numpy as np
import pinocchio
from numpy.typing import NDArray

Array = NDArray[np.float64]


class NearPairs:
    """Measure the distances of a geometry model's pairs; `reach_m` stands for all beyond it.

    `leaders` gives, for each of the model's joints, the column of a pose that moves it.
    """

    def __init__(
        self,
        model: pinocchio.Model,
        shapes: pinocchio.GeometryModel,
        leaders: dict[int, int],
        columns: int,
        reach_m: float,
    ) -> None:
        self._shapes = shapes
        self._placed = shapes.createData()
        self._reach_m = reach_m
        self._levers_m = _levers_m(model, shapes, leaders, columns)
        pairs = len(shapes.collisionPairs)
        self._known_m = np.full(pairs, -np.inf)
        self._poses = np.full((pairs, columns), np.nan)

    def distances(
        self, model: pinocchio.Model, data: pinocchio.Data, q: Array, pose: Array
    ) -> Array:
        """Return the distances at a pose, `q` in the model's own numbers; negative in overlap."""
        moved_m = np.einsum("pj,pj->p", self._levers_m, np.abs(pose - self._poses))
        # A pair whose joints stand where it was measured is as far as it was then.
        is_due = (moved_m != 0.0) & ~(self._known_m - moved_m >= self._reach_m)
        due = np.flatnonzero(is_due)
        pinocchio.updateGeometryPlacements(model, data, self._shapes, self._placed, q)
        shapes, placed, measure = self._shapes, self._placed, pinocchio.computeDistance
        measured_m = [measure(shapes, placed, pair).min_distance for pair in due.tolist()]
        self._known_m[due], self._poses[due] = measured_m, pose
        found_m: Array = np.minimum(self._known_m, self._reach_m)
        return found_m


def _levers_m(
    model: pinocchio.Model,
    shapes: pinocchio.GeometryModel,
    leaders: dict[int, int],
    columns: int,
) -> Array:
    """Return, for each pair and column, how far a unit of motion takes the one from the other."""
    objects = shapes.geometryObjects
    chains = [_chain(model, shape) for shape in objects]
    levers = np.zeros((len(shapes.collisionPairs), columns))
    for row, pair in enumerate(shapes.collisionPairs):
        first, second = chains[pair.first], chains[pair.second]
        for joint in first.keys() ^ second.keys():
            if joint in leaders:
                levers[row, leaders[joint]] += first.get(joint, second.get(joint, 0.0))
    return levers


def _chain(model: pinocchio.Model, shape: pinocchio.GeometryObject) -> dict[int, float]:
    """Return the joints that carry a shape, each with how far a unit of it can take the shape."""
    carried_m = float(np.linalg.norm(shape.placement.translation)) + _extent_m(shape.geometry)
    levers, joint = {}, shape.parentJoint
    while joint > 0:
        slides = model.joints[joint].shortname().startswith("JointModelP")
        levers[joint] = 1.0 if slides else carried_m
        carried_m += float(np.linalg.norm(model.jointPlacements[joint].translation))
        carried_m += _slide_m(model, joint) if slides else 0.0
        joint = model.parents[joint]
    return levers


def _slide_m(model: pinocchio.Model, joint: int) -> float:
    place = model.idx_qs[joint]
    ends = model.lowerPositionLimit[place], model.upperPositionLimit[place]
    return float(np.abs(ends).max())


def _extent_m(geometry: coal.CollisionGeometry) -> float:
    """Return how far from its own origin a shape reaches; a half-space carries nobody."""
    if isinstance(geometry, coal.Halfspace):
        return 0.0
    geometry.computeLocalAABB()
    return float(np.linalg.norm(geometry.aabb_center)) + float(geometry.aabb_radius)
