"""Solve an arm's forward and inverse kinematics in the base frame.

The grip frame sits between the fingers: z out of the hand along the fingers, y the closing axis.
Positions are arrays over the whole robot in joint order; only the arm's own joints are changed.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pinocchio
from numpy.typing import NDArray

from vla_deploy.manipulation.errors import PostureUnreachable
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.kinematics.model import RobotModel

Array = NDArray[np.float64]

POSITION_TOLERANCE_M = 2e-4
ROTATION_TOLERANCE_RAD = 2e-3
MAX_ITERATIONS = 60
STALL_ITERATIONS = 8
STALL_RATIO = 0.98
RESTARTS = 4
RESTART_SEED = 20
DAMPING = 1e-2
MAX_STEP_RAD = 0.4
MAX_WAYPOINT_JUMP_RAD = 0.3
AT_LIMIT_RAD = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class IkSolution:
    """Give a posture of the whole robot and how exactly its hand is where it was wanted."""

    positions: Array
    position_error_m: float
    rotation_error_rad: float

    @property
    def is_exact(self) -> bool:
        """Return whether both errors are within tolerance."""
        near = self.position_error_m <= POSITION_TOLERANCE_M
        return near and self.rotation_error_rad <= ROTATION_TOLERANCE_RAD


class ArmKinematics:
    """Answer where one hand is and how its arm must stand; one instance per thread."""

    def __init__(self, robot: RobotDescription, side: str) -> None:
        """Build the kinematics of one hand of the robot file.

        Raises:
            KeyError: the robot has no such hand.
        """
        hand = robot.hands[side]
        self.side = side
        self._site = hand.grip_site
        self._model = RobotModel(robot)
        self._names = robot.group(hand.arm).joints
        self._columns = [robot.joint_index[name] for name in self._names]
        self._low = robot.position_min[self._columns]
        self._high = robot.position_max[self._columns]
        self.shoulder_m: Array = self.points(np.zeros(len(robot.joint_names)))[0]
        """The arm's first joint in the base frame."""

    def forward(self, positions: Array) -> Array:
        """Return the grip frame in the base frame."""
        return self._model.site_pose(self._site, positions)

    def points(self, positions: Array) -> Array:
        """Return where the arm's joints and its grip are in the base frame, (n, 3)."""
        poses = self._model.joint_poses(positions)
        joints = [poses[name][:3, 3] for name in self._names]
        return np.array([*joints, self.forward(positions)[:3, 3]])

    def camera_pose(self, positions: Array) -> Array:
        """Return the head camera's optical frame (x right, y down, z forward) in the base frame."""
        return self._model.camera_pose(positions)

    def solve(self, target: Array, seed: Array, *, restarts: int = RESTARTS) -> IkSolution:
        """Return a posture that brings the grip frame to `target`, near `seed` if there is one.

        Raises:
            PostureUnreachable: every start ended outside the tolerances; the message says how far.
        """
        nearest: IkSolution | None = None
        for start in self._starts(seed, restarts):
            found = self._descend(target, start)
            if found.is_exact:
                return found
            if nearest is None or found.position_error_m < nearest.position_error_m:
                nearest = found
        assert nearest is not None, "the seed itself is always a start"
        raise self._unreachable(target, nearest, restarts + 1)

    def straight_line(self, start: Array, target: Array, step_m: float = 0.01) -> Array:
        """Return postures, `start` first, that lead the grip frame straight to `target`.

        Raises:
            PostureUnreachable: a point of the line is out of reach, or needs another posture.
        """
        origin = self.forward(start)
        length_m = float(np.linalg.norm(target[:3, 3] - origin[:3, 3]))
        count = max(1, int(np.ceil(length_m / step_m)))
        waypoints = [np.array(start, dtype=np.float64)]
        for index in range(1, count + 1):
            pose = _between(origin, target, index / count)
            posture = self.solve(pose, waypoints[-1], restarts=0).positions
            self._refuse_jump(waypoints[-1], posture, index / count)
            waypoints.append(posture)
        return np.array(waypoints)

    def _starts(self, seed: Array, restarts: int) -> Iterator[Array]:
        start = np.array(seed, dtype=np.float64)
        start[self._columns] = np.clip(start[self._columns], self._low, self._high)
        yield start.copy()
        random = np.random.default_rng(RESTART_SEED)
        for _ in range(restarts):
            start[self._columns] = random.uniform(self._low, self._high)
            yield start.copy()

    def _descend(self, target: Array, positions: Array) -> IkSolution:
        errors: list[float] = []
        for _ in range(MAX_ITERATIONS):
            error = _twist(self.forward(positions), target)
            found = IkSolution(
                positions=positions,
                position_error_m=float(np.linalg.norm(error[:3])),
                rotation_error_rad=float(np.linalg.norm(error[3:])),
            )
            errors.append(float(np.linalg.norm(error)))
            if found.is_exact or _has_stalled(errors):
                return found
            positions = self._step(positions, error)
        return found

    def _step(self, positions: Array, error: Array) -> Array:
        """Return one damped least-squares step; joints that push against a limit stay out of it."""
        jacobian = self._model.site_jacobian(self._site, positions)[:, self._columns]
        arm = positions[self._columns]
        free = np.ones(len(arm), dtype=bool)
        step = np.zeros(len(arm))
        for _ in range(2):
            step[:] = 0.0
            step[free] = _damped(jacobian[:, free], error)
            blocked = ((arm <= self._low) & (step < 0)) | ((arm >= self._high) & (step > 0))
            if not blocked.any():
                break
            free &= ~blocked
        step *= min(1.0, MAX_STEP_RAD / max(float(np.abs(step).max()), 1e-12))
        following = positions.copy()
        following[self._columns] = np.clip(arm + step, self._low, self._high)
        return following

    def _refuse_jump(self, before: Array, after: Array, ratio: float) -> None:
        jump = float(np.abs(after - before).max())
        if jump > MAX_WAYPOINT_JUMP_RAD:
            raise PostureUnreachable(
                f"{self.side} hand: the straight line needs a jump of {jump:.2f} rad at "
                f"{ratio:.0%} of its length; start from another posture"
            )

    def _unreachable(self, target: Array, nearest: IkSolution, starts: int) -> PostureUnreachable:
        arm = nearest.positions[self._columns]
        at_limit = (arm - self._low < AT_LIMIT_RAD) | (self._high - arm < AT_LIMIT_RAD)
        held = ", ".join(name for name, is_at in zip(self._names, at_limit, strict=True) if is_at)
        x_m, y_m, z_m = target[:3, 3]
        reason = (
            f"{self.side} hand cannot reach x {x_m:.3f}, y {y_m:.3f}, z {z_m:.3f} m in that "
            f"orientation: nearest posture of {starts} starts is off by "
            f"{nearest.position_error_m * 1000:.1f} mm and {nearest.rotation_error_rad:.3f} rad"
            f"{f', at the limit of {held}' if held else ''}; stand elsewhere or turn the hand"
        )
        return PostureUnreachable(reason, nearest.position_error_m)


def _has_stalled(errors: list[float]) -> bool:
    return len(errors) > STALL_ITERATIONS and (
        errors[-1] > STALL_RATIO * errors[-1 - STALL_ITERATIONS]
    )


def _damped(jacobian: Array, error: Array) -> Array:
    # Damping fades with the error: quick far from the target, exact near it.
    damping = DAMPING * min(1.0, float(np.linalg.norm(error)))
    square = jacobian @ jacobian.T + (damping**2 + 1e-9) * np.eye(6)
    return np.asarray(jacobian.T @ np.linalg.solve(square, error), dtype=np.float64)


def _twist(current: Array, target: Array) -> Array:
    """Return the motion from one pose to another, linear first, in the former's frame."""
    rotation = current[:3, :3].T
    linear = rotation @ (target[:3, 3] - current[:3, 3])
    angular = pinocchio.log3(rotation @ target[:3, :3])
    return np.concatenate([linear, angular])


def _between(start: Array, end: Array, ratio: float) -> Array:
    pose = np.eye(4)
    turn = pinocchio.log3(start[:3, :3].T @ end[:3, :3])
    pose[:3, :3] = start[:3, :3] @ pinocchio.exp3(ratio * turn)
    pose[:3, 3] = (1.0 - ratio) * start[:3, 3] + ratio * end[:3, 3]
    return pose
