"""Translate between the robot's joints and the motor shafts that the emulated firmware knows."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from sim_twin.errors import ModelMismatch

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Shaft:
    """Say how a motor's shaft drives a joint: joint = offset + ratio * shaft angle."""

    joint: str
    offset: float = 0.0
    ratio: float = 1.0


class Shafts:
    """Read shaft angle, speed and torque of all motors of one kind, and set their input."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, shafts: Sequence[Shaft]) -> None:
        joints = [_find(model.joint, "joint", shaft.joint) for shaft in shafts]
        actuators = [_find(model.actuator, "actuator", shaft.joint) for shaft in shafts]
        ratio = np.array([shaft.ratio for shaft in shafts])
        # Views of the state's memory: asking MjData for them anew costs more than reading them.
        self._all_qpos, self._all_qvel = data.qpos, data.qvel
        self._all_force, self._all_ctrl = data.actuator_force, data.ctrl
        self._actuator = _span(actuators)
        self._qpos = _span(model.jnt_qposadr[joints].tolist())
        self._qvel = _span(model.jnt_dofadr[joints].tolist())
        self._zero_rad = np.array([shaft.offset for shaft in shafts]) / ratio
        self._per_joint = 1.0 / ratio
        self._sign = np.sign(ratio)
        self._rows = [
            (int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint]), actuator, row)
            for row, (joint, actuator) in enumerate(zip(joints, actuators, strict=True))
        ]
        self._per_joint_each: list[float] = self._per_joint.tolist()
        self._sign_each: list[float] = self._sign.tolist()

    def position_rad(self) -> Floats:
        """Return shaft angles."""
        angle: Floats = self._all_qpos[self._qpos] * self._per_joint
        angle -= self._zero_rad
        return angle

    def velocity_rad_s(self) -> Floats:
        """Return shaft speeds."""
        speed: Floats = self._all_qvel[self._qvel] * self._per_joint
        return speed

    def motions(self) -> list[tuple[float, float]]:
        """Return each shaft's angle and speed as plain numbers, which is faster for a few."""
        qpos, qvel, zero_rad = self._all_qpos.item, self._all_qvel.item, self._zero_rad.item
        per_joint = self._per_joint_each
        return [
            (qpos(angle) * per_joint[row] - zero_rad(row), qvel(speed) * per_joint[row])
            for angle, speed, _, row in self._rows
        ]

    def effort(self) -> Floats:
        """Return what the motors gave in the last step, in the shaft's direction."""
        effort: Floats = self._all_force[self._actuator] * self._sign
        return effort

    def command(self, value: Floats) -> None:
        """Set the motors' input, in the shaft's direction: duty of a servo, torque of a drive."""
        self._all_ctrl[self._actuator] = value * self._sign

    def command_each(self, values: Iterable[float]) -> None:
        """Set the motors' input from plain numbers."""
        ctrl, signs = self._all_ctrl, self._sign_each
        for value, (_, _, actuator, row) in zip(values, self._rows, strict=True):
            ctrl[actuator] = value * signs[row]

    def slip(self, row: int, angle_rad: float) -> None:
        """Measure a shaft further off than it is, as an encoder does after a blow."""
        self._zero_rad[row] -= angle_rad


def _span(addresses: list[int]) -> slice | NDArray[np.intp]:
    """Return addresses as a slice where they follow each other: reading that copies nothing."""
    start = min(addresses, default=0)
    whole = slice(start, start + len(addresses))
    in_order = addresses == list(range(whole.start, whole.stop))
    return whole if in_order else np.array(addresses, np.intp)


def _find(lookup: object, kind: str, name: str) -> int:
    try:
        return int(lookup(name).id)  # type: ignore[operator]
    except KeyError as error:
        raise ModelMismatch(
            f"the robot file names {name!r}, but its MJCF has no such {kind}"
        ) from error
