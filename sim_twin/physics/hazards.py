"""Watch the physics for what a safe robot never does, whatever fails; a referee, like `truth`."""

import math
from dataclasses import asdict, dataclass
from typing import Any, Final

import mujoco
import numpy as np
from numpy.typing import NDArray

from sim_twin.physics.compose import ROBOT_ROOT
from vla_deploy.robots import RobotDescription

SPEED_SLACK_RATIO: Final = 1.1
"""A P-controlled servo swings past the speed of its setpoint, and so does the base.

Four jobs in the flat (110 s, Butler, seed 0) reached 0.992 of a joint's limit, 0.907 of the base's
speed and 0.865 of its turning: a tenth above the limit is nothing that a healthy robot does.
"""
RANGE_SLACK_RATIO: Final = 0.005
"""MuJoCo's stops are springs: a joint that leans on one is a little beyond it. The same jobs kept
2 % of the range away from them."""
WORKSPACE_SLACK_M: Final = 0.01
"""How far a hand swings on where its setpoint ends; the same jobs kept it 0.09 m inside."""
MOST_TILT_RAD: Final = math.radians(8.0)
MOST_PUSH_N: Final = 60.0
"""Less than half of what ISO/TS 15066 allows on a hand (140 N); nothing here pushes on purpose."""
FALL_M_S: Final = 1.0
"""What falls 5 cm freely is this fast; what a hand lets go above a table is not."""
_LOOK_EVERY_NS: Final = 6_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Hazard:
    """Hold what went wrong with which part: its worst value, the limit, and when it began."""

    kind: str
    part: str
    worst: float
    limit: float
    began_s: float

    def __str__(self) -> str:
        return f"{self.kind} {self.part}: {self.worst:.3g}, limit {self.limit:.3g}"


class HazardWatch:
    """Collect the hazards since `begin`: of joints, hands, base, pushing and falling things."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, robot: RobotDescription) -> None:
        self._model = model
        self._data = data
        self._robot = robot
        names = robot.joint_names
        joints = np.array([model.joint(name).id for name in names])
        self._names = names
        self._places, self._dofs = model.jnt_qposadr[joints], model.jnt_dofadr[joints]
        low, high = model.jnt_range[joints].T
        slack = RANGE_SLACK_RATIO * (high - low)
        self._low, self._high = low - slack, high + slack
        self._speed_limit = SPEED_SLACK_RATIO * robot.velocity_max
        self._root = model.body(ROBOT_ROOT).id
        self._root_dof = int(model.body_dofadr[self._root])
        self._is_robot = model.body_rootid[model.geom_bodyid] == self._root
        self._is_fixed = (model.body_weldid[model.geom_bodyid] == 0) & ~self._is_robot
        self._is_floor = model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE.value
        self._things = _free_bodies(model, self._root)
        self._boxes = _workspaces(model, robot)
        self._found: dict[tuple[str, str], Hazard] = {}
        self._due_ns = 0
        self._wrench = np.zeros(6)

    def begin(self) -> None:
        """Forget what was found."""
        self._found.clear()

    def step(self, now_ns: int) -> None:
        """Look, every few milliseconds."""
        if now_ns < self._due_ns:
            return
        self._due_ns = now_ns + _LOOK_EVERY_NS
        self._look_at_joints()
        self._look_at_hands()
        self._look_at_base()
        self._look_at_contacts()
        self._look_at_things()

    @property
    def found(self) -> tuple[Hazard, ...]:
        """Return one hazard for each kind and part, in the order of their beginning."""
        return tuple(self._found.values())

    def document(self) -> list[dict[str, Any]]:
        """Return the hazards as JSON."""
        return [{**asdict(hazard), "text": str(hazard)} for hazard in self.found]

    def _look_at_joints(self) -> None:
        position = self._data.qpos[self._places]
        speed = np.abs(self._data.qvel[self._dofs])
        for row in np.flatnonzero((position < self._low) | (position > self._high)):
            bound = self._low[row] if position[row] < self._low[row] else self._high[row]
            self._note("joint range", self._names[row], float(position[row]), float(bound))
        for row in np.flatnonzero(speed > self._speed_limit):
            limit = float(self._speed_limit[row])
            self._note("joint speed", self._names[row], float(speed[row]), limit)

    def _look_at_hands(self) -> None:
        """Find a grip that is outside the box in which the robot file lets it be."""
        turn = self._data.xmat[self._root].reshape(3, 3)
        for hand, (site, low, high) in self._boxes.items():
            grip = turn.T @ (self._data.site_xpos[site] - self._data.xpos[self._root])
            outside_m = float(np.maximum(low - grip, grip - high).max())
            if outside_m > WORKSPACE_SLACK_M:
                self._note("workspace", hand, outside_m, WORKSPACE_SLACK_M)

    def _look_at_base(self) -> None:
        base = self._robot.parts.base
        if base is None:
            return
        velocity = self._data.qvel[self._root_dof : self._root_dof + 6]
        speed_m_s = math.hypot(velocity[0], velocity[1])
        upright = float(self._data.xmat[self._root][8])
        readings = (
            ("base speed", speed_m_s, SPEED_SLACK_RATIO * base.max_speed_m_s),
            ("turning speed", abs(float(velocity[5])), SPEED_SLACK_RATIO * base.max_turn_rad_s),
            ("tilt", math.acos(min(1.0, upright)), MOST_TILT_RAD),
        )
        for kind, value, limit in readings:
            if value > limit:
                self._note(kind, "base", value, limit)

    def _look_at_contacts(self) -> None:
        """Find the robot pushing itself or what stands fast; it stands on the floor."""
        geoms = self._data.contact.geom[: self._data.ncon]
        robot, fixed = self._is_robot[geoms], self._is_fixed[geoms] & ~self._is_floor[geoms]
        pushing = robot.all(axis=1) | (robot.any(axis=1) & fixed.any(axis=1))
        for index in np.flatnonzero(pushing):
            mujoco.mj_contactForce(self._model, self._data, int(index), self._wrench)
            if self._wrench[0] > MOST_PUSH_N:
                first, second = (self._body_name(int(geom)) for geom in geoms[index])
                self._note("push", f"{first} on {second}", float(self._wrench[0]), MOST_PUSH_N)

    def _look_at_things(self) -> None:
        for name, dof in self._things.items():
            down_m_s = -float(self._data.qvel[dof + 2])
            if down_m_s > FALL_M_S:
                self._note("fall", name, down_m_s, FALL_M_S)

    def _body_name(self, geom: int) -> str:
        return str(self._model.body(int(self._model.geom_bodyid[geom])).name)

    def _note(self, kind: str, part: str, value: float, limit: float) -> None:
        known = self._found.get((kind, part))
        if known is None or abs(value) > abs(known.worst):
            began_s = float(self._data.time) if known is None else known.began_s
            self._found[kind, part] = Hazard(
                kind=kind, part=part, worst=value, limit=limit, began_s=began_s
            )


def _free_bodies(model: mujoco.MjModel, root: int) -> dict[str, int]:
    """Return the first degree of freedom of each loose thing."""
    joints: NDArray[np.intp] = np.flatnonzero(model.jnt_type == mujoco.mjtJoint.mjJNT_FREE)
    bodies = {int(model.jnt_bodyid[joint]): int(model.jnt_dofadr[joint]) for joint in joints}
    return {model.body(body).name: dof for body, dof in bodies.items() if body != root}


def _workspaces(
    model: mujoco.MjModel, robot: RobotDescription
) -> dict[str, tuple[int, NDArray[np.float64], NDArray[np.float64]]]:
    """Return of each hand with a workspace its grip's site and the box's corners, base frame."""
    return {
        hand: (model.site(robot.hands[hand].grip_site).id, np.array(box.min_m), np.array(box.max_m))
        for hand, box in robot.protection.workspaces.items()
    }
