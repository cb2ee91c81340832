"""Hand an ODrive's inputs, modes, limits and gains from their messages to the controller."""

import math
from collections.abc import Callable, Mapping
from typing import Final

from drivers.odrive.codec import ControlMode, InputMode, OdriveCommand
from sim_twin.can.odrive.controller import ODriveController

FEED_FORWARD_PER_UNIT: Final = 1000.0


def refuse_nan(*values: float) -> None:
    """Let only finite numbers pass.

    Raises:
        ValueError: one is not.
    """
    if not all(map(math.isfinite, values)):
        raise ValueError(f"not finite: {values}")


def _modes(controller: ODriveController, control_mode: int, input_mode: int) -> None:
    modes = ControlMode(control_mode), InputMode(input_mode)
    controller.control_mode, controller.input_mode = modes


def _position(
    controller: ODriveController, position_rev: float, velocity: int, torque: int
) -> None:
    refuse_nan(position_rev)
    controller.input_rev = position_rev
    controller.input_rev_s = velocity / FEED_FORWARD_PER_UNIT
    controller.input_nm = torque / FEED_FORWARD_PER_UNIT


def _velocity(controller: ODriveController, velocity_rev_s: float, torque_nm: float) -> None:
    refuse_nan(velocity_rev_s, torque_nm)
    controller.input_rev_s, controller.input_nm = velocity_rev_s, torque_nm


def _torque(controller: ODriveController, torque_nm: float) -> None:
    refuse_nan(torque_nm)
    controller.input_nm = torque_nm


def _limits(controller: ODriveController, velocity_rev_s: float, current_a: float) -> None:
    refuse_nan(velocity_rev_s, current_a)
    controller.set_limits(velocity_rev_s, current_a)


def _position_gain(controller: ODriveController, gain: float) -> None:
    refuse_nan(gain)
    controller.position_gain = gain


def _velocity_gains(controller: ODriveController, gain: float, integrator_gain: float) -> None:
    refuse_nan(gain, integrator_gain)
    controller.set_gains(gain, integrator_gain)


INPUTS: Final[Mapping[OdriveCommand, Callable[..., None]]] = {
    OdriveCommand.SET_CONTROLLER_MODE: _modes,
    OdriveCommand.SET_INPUT_POS: _position,
    OdriveCommand.SET_INPUT_VEL: _velocity,
    OdriveCommand.SET_INPUT_TORQUE: _torque,
    OdriveCommand.SET_LIMITS: _limits,
    OdriveCommand.SET_POS_GAIN: _position_gain,
    OdriveCommand.SET_VEL_GAINS: _velocity_gains,
}
