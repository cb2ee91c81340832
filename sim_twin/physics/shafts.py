"""Translate between the robot's joints and the motor shafts that the emulated firmware knows."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from sim_twin.errors import TwinModelMismatch

Floats = NDArray[np.float64]
ControlLaw = Callable[[int, float, float], float]
"""Return a motor's input from simulated time, its shaft's angle and its shaft's speed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Shaft:
    """Say how a motor's shaft drives a joint: joint = offset + ratio * shaft angle.

    Without `actuator` the motor is the actuator of the joint's name.
    """

    joint: str
    actuator: str = ""
    offset: float = 0.0
    ratio: float = 1.0


class Shafts:
    """Read position, speed and torque of all motors of one kind, and set their input.

    An array that a method returns is overwritten by its next call.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, shafts: Sequence[Shaft]) -> None:
        joints = [_find(model.joint, "joint", shaft.joint) for shaft in shafts]
        names = [shaft.actuator or shaft.joint for shaft in shafts]
        actuators = [_find(model.actuator, "actuator", name) for name in names]
        qpos, qvel = model.jnt_qposadr[joints].tolist(), model.jnt_dofadr[joints].tolist()
        ratio = np.array([shaft.ratio for shaft in shafts])
        self.zero_rad = np.array([shaft.offset for shaft in shafts]) / ratio
        """Shaft angle = rad_per_joint * joint - zero_rad."""
        self._each_zero_rad: list[float] = self.zero_rad.tolist()
        self.rad_per_joint = 1.0 / ratio
        # The state's memory is asked for once: asking MjData anew costs more than reading it.
        self._motion = np.zeros((2, len(shafts)))
        self._read_positions = _reader(data.qpos, qpos, self._motion[0])
        self._read_speeds = _reader(data.qvel, qvel, self._motion[1])
        self._force, self._all_ctrl = data.actuator_force, data.ctrl
        self._actuator = _span(actuators)
        self._each_qpos, self._each_qvel = memoryview(data.qpos), memoryview(data.qvel)
        self._each_ctrl = memoryview(data.ctrl)
        factors = (self.rad_per_joint.tolist(), np.sign(ratio).tolist())
        self._rows = list(zip(range(len(shafts)), qpos, qvel, actuators, *factors, strict=True))

    def joint_motion(self) -> Floats:
        """Return what the joints stand at in a first row, and their speeds in a second."""
        self._read_positions()
        self._read_speeds()
        return self._motion

    def joint_effort(self) -> Floats:
        """Return what the motors give, in the joint's direction; the physics may write to it."""
        effort: Floats = self._force[self._actuator]
        return effort

    def command(self, value: Floats) -> None:
        """Set the motors' input, in the joint's direction: duty of a servo, torque of a drive."""
        self._all_ctrl[self._actuator] = value

    def command_each(self, now_ns: int, laws: Sequence[ControlLaw]) -> None:
        """Set each motor's input by a law of its own, one by one, which is faster for a few."""
        qpos, qvel, ctrl = self._each_qpos, self._each_qvel, self._each_ctrl
        for law, row in zip(laws, self._rows, strict=True):
            number, angle, speed, actuator, per_joint, sign = row
            angle_rad = qpos[angle] * per_joint - self._each_zero_rad[number]
            ctrl[actuator] = sign * law(now_ns, angle_rad, qvel[speed] * per_joint)

    def slip(self, row: int, angle_rad: float) -> None:
        """Measure a shaft further off than it is, as an encoder does after a blow."""
        self.zero_rad[row] -= angle_rad
        self._each_zero_rad[row] -= angle_rad


def _reader(state: Floats, addresses: list[int], out: Floats) -> Callable[[], Floats]:
    """Return what copies these addresses to `out` and returns it."""
    places = np.array(addresses, np.intp)
    return lambda: state.take(places, None, out, "clip")


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
        raise TwinModelMismatch(
            f"the robot file names {name!r}, but its MJCF has no such {kind}"
        ) from error
