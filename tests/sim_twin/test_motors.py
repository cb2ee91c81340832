import math

import numpy as np
import pytest

from sim_twin.physics.engine import Engine
from sim_twin.physics.load import load_engine
from vla_deploy.robots import RobotDescription, load_robot

REVERSALS = 4
STEPS_BETWEEN = 150
OVERSHOOT_RATIO = 1.05
ARMS_OUT = {
    f"{side}_{joint}": value
    for side in ("left", "right")
    for joint, value in (("shoulder_pitch", 0.8), ("elbow", 1.0), ("wrist_pitch", 0.0))
}


@pytest.fixture(scope="module")
def robot() -> RobotDescription:
    return load_robot("butler")


@pytest.fixture
def engine(robot: RobotDescription) -> Engine:
    engine = load_engine(robot, "flat", seed=0)
    engine.pose(ARMS_OUT)
    engine.model.opt.gravity[:] = 0.0
    return engine


@pytest.mark.parametrize("joint", ["left_gripper", "right_gripper", "head_pan", "left_wrist_roll"])
def test_a_motor_at_full_duty_never_outruns_its_no_load_speed(
    robot: RobotDescription, engine: Engine, joint: str
) -> None:
    row = robot.joint_index[joint]
    duty = np.zeros(len(robot.joint_names))
    sign = np.sign(engine.servos.rad_per_joint)
    per_joint = abs(float(engine.servos.rad_per_joint[row]))
    fastest = 0.0
    for reversal in range(REVERSALS):
        duty[row] = math.copysign(1.0, 0.5 - reversal % 2)
        for _ in range(STEPS_BETWEEN):
            engine.servos.command(duty * sign)
            engine.step()
            fastest = max(fastest, abs(float(engine.servos.joint_motion()[1][row])) * per_joint)
    assert 0.5 < fastest / robot.model_of(joint).no_load_speed_rad_s < OVERSHOOT_RATIO
