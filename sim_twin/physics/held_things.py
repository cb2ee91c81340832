"""Carry what a hand holds round a turn as far as the hand goes.

MuJoCo's contacts bind accelerations by `J qacc` alone (MuJoCo's documentation, Computation,
"Constraint model"); what a turning hand adds to that, `J' qvel`, shows up as speed between fingers
and thing, which dies away at the contact's own rate. So in every turn a thing lags by the hand's
centripetal acceleration times the contact's time constant, less half a step of the integrator.
Friction holds speeds together, not places, so nothing brings it back: at 1.2 rad/s and an arm's
length a cup wanders out of a firm grip by a millimetre for each quarter of a turn, ever outwards.
"""

from typing import Final

import mujoco
import numpy as np

from sim_twin.physics.compose import ROBOT_ROOT, STEP_S

EVERY: Final = 8
"""Steps between two looks; the hand turns by a degree in them at most."""
_LEAST_FINGERS: Final = 2


class HeldThings:
    """Move free bodies that a hand holds by the way that contacts leave out."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        self._model = model
        self._data = data
        self._owner = owner = model.geom_bodyid
        self._is_robot = model.body_rootid[owner] == model.body(ROBOT_ROOT).id
        joint = model.body_jntadr[owner]
        is_free = model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_FREE.value
        self._is_thing = (joint >= 0) & is_free & ~self._is_robot
        self._place = model.jnt_qposadr[model.body_jntadr]
        self._rate = np.zeros((3, model.nv))
        self._steps = 0

    def step(self) -> None:
        """Look, every few steps, and move what is held."""
        self._steps += 1
        if self._steps < EVERY:
            return
        self._steps = 0
        for thing, (finger, contact) in self._held().items():
            point = self._data.xipos[thing]
            mujoco.mj_jacDot(self._model, self._data, self._rate, None, point, finger)
            turning_m_s2 = self._rate @ self._data.qvel
            place = self._place[thing]
            self._data.qpos[place : place + 3] += (
                turning_m_s2 * self._lag_s(contact) * EVERY * STEP_S
            )

    def _lag_s(self, contact: int) -> float:
        """Return the time by which a thing's speed follows the fingers', less half a step.

        `b = 2 / (dmax timeconst)`: MuJoCo's documentation, Modeling, "Solver parameters".
        """
        contacts = self._data.contact
        time_constant_s, dmax = contacts.solref[contact, 0], contacts.solimp[contact, 1]
        return float(dmax * time_constant_s / 2.0 - STEP_S / 2.0)

    def _held(self) -> dict[int, tuple[int, int]]:
        """Return of each thing that two bodies of the robot touch one of these, and its contact."""
        pairs = self._data.contact.geom
        touches = np.argwhere(self._is_thing[pairs] & self._is_robot[pairs[:, ::-1]])
        fingers: dict[int, dict[int, int]] = {}
        for contact, side in touches:
            thing = int(self._owner[pairs[contact, side]])
            finger = int(self._owner[pairs[contact, 1 - side]])
            fingers.setdefault(thing, {})[finger] = int(contact)
        return {
            thing: next(iter(touching.items()))
            for thing, touching in fingers.items()
            if len(touching) >= _LEAST_FINGERS
        }
