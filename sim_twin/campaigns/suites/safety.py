"""Stop, shove and break the robot at work, in lock-step, and see how soon it is safe."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import Final

import numpy as np

from sim_twin.campaigns import navigation
from sim_twin.campaigns.evidence import Watch, unwatched
from sim_twin.campaigns.faulting.choreography import Phase
from sim_twin.campaigns.faulting.fault_matrix import (
    Cell,
    Disturbance,
    cells,
    play_disturbance,
)
from sim_twin.campaigns.faulting.fault_matrix import play as play_fault
from sim_twin.campaigns.report import CampaignCase
from sim_twin.harness.lockstep_stack import LockstepControl
from sim_twin.physics.compose import ROBOT_ROOT, STEP_S
from vla_deploy.robots import load_robot

_CHAIR_AHEAD_M: Final = 0.75
"""Of its middle before the base's: 0.3 m are left, at 0.3 m/s and 0.6 m/s² 0.08 m are needed."""
_SHOVE_N: Final = -40.0
_SHOVE_AT_M: Final = 1.0
_SHOVE_S: Final = 0.3
"""Against the driving robot's head: it leans back by 1.7 degrees and comes down again."""
AVOIDANCE: Final = "obstacle_avoidance"


class _Shove:
    """Push the robot at the height of its head for a moment; run it beside the robot's nodes."""

    period_s = STEP_S

    def __init__(self, stack: LockstepControl) -> None:
        self._stack = stack
        self._end_s = stack.lockstep.now_s + _SHOVE_S

    def start(self) -> None:
        pass

    def step(self) -> None:
        engine = self._stack.lockstep.twin.engine
        body = engine.model.body(ROBOT_ROOT).id
        ahead = engine.data.xmat[body].reshape(3, 3)[:, 0]
        lasts = self._stack.lockstep.now_s < self._end_s
        force = (_SHOVE_N if lasts else 0.0) * ahead
        engine.data.xfrc_applied[body, :3] = force
        engine.data.xfrc_applied[body, 3:] = np.cross((0.0, 0.0, _SHOVE_AT_M), force)

    def stop(self) -> None:
        pass


def _press_stop(stack: LockstepControl) -> None:
    stack.operate("estop")


def _put_chair(stack: LockstepControl) -> None:
    robot = stack.lockstep.truth()["robot"]
    yaw_rad = robot["yaw_rad"]
    stack.lockstep.twin.person.put(
        "chair",
        {
            "x_m": robot["x_m"] + _CHAIR_AHEAD_M * math.cos(yaw_rad),
            "y_m": robot["y_m"] + _CHAIR_AHEAD_M * math.sin(yaw_rad),
            "z_m": 0.0,
            "yaw_rad": yaw_rad,
        },
    )


def _shove(stack: LockstepControl) -> None:
    stack.lockstep.add(_Shove(stack))


@dataclass(frozen=True, slots=True, kw_only=True)
class _Stop:
    """Hold what happens in a phase that is no fault of a device, and the cause to be named."""

    phase: Phase
    happens: Callable[[LockstepControl], None]
    cause: str
    sees: bool = False
    """Whether it needs perception."""


STOPS: Final[Mapping[str, _Stop]] = {
    "emergency_stop/driving": _Stop(phase=Phase.DRIVING, happens=_press_stop, cause="estop"),
    "emergency_stop/reaching": _Stop(phase=Phase.REACHING, happens=_press_stop, cause="estop"),
    "collision_stop/driving": _Stop(
        phase=Phase.DRIVING, happens=_put_chair, cause="obstacle_stop_zone", sees=True
    ),
    "balance_recovery/driving": _Stop(phase=Phase.DRIVING, happens=_shove, cause="tip_margin"),
}
FAULTS: Final[Mapping[str, str]] = {
    "estop/wrong/carrying": "estop",
    "can_bus/bus_off/driving": "can_bus_lost",
    "servo_bus/unplug/carrying": "servo_bus_lost",
    "servo.left_elbow/overheat/reaching": "servo_hardware_error",
    "lidar/unplug/driving": "stale_scan",
}
"""Cells of `validate faults`, and the cause that must be named."""
SCENES: Final = (*STOPS, AVOIDANCE, *FAULTS)


def play(scene: str, seed: int, watch: Watch = unwatched) -> CampaignCase:
    """Play a stop, a fault, or a drive around a chair."""
    if scene == AVOIDANCE:
        return navigation.play(f"around/{seed}", watch)
    if scene in STOPS:
        stop = STOPS[scene]
        what = Disturbance(name=scene, phase=stop.phase, happens=stop.happens, takes_all=stop.sees)
        return _named_right(play_disturbance(what, seed, watch=watch), stop.cause)
    return _named_right(play_fault(_cells()[scene], seed, watch=watch), FAULTS[scene])


def _named_right(case: CampaignCase, cause: str) -> CampaignCase:
    """Return the case with its cause judged; a stage that could not be set has none."""
    if "cause" not in case.figures:
        return case
    is_right = case.figures["cause"] == cause
    wrong = () if is_right else (f"cause {case.figures['cause']}, expected {cause}",)
    figures = {**case.figures, "named_right": float(is_right)}
    return replace(case, failures=(*case.failures, *wrong), figures=figures)


@cache
def _cells() -> Mapping[str, Cell]:
    return {cell.name: cell for cell in cells(load_robot("butler"))}
