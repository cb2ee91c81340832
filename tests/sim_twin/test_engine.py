import math

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

from sim_twin.errors import TwinModelMismatch
from sim_twin.physics.engine import START_NS, STEP_NS, Engine
from sim_twin.physics.shafts import Shaft


def angles(engine: Engine) -> NDArray[np.float64]:
    """Return shaft angles as the emulated encoders have them."""
    shafts = engine.servos
    return shafts.rad_per_joint * shafts.joint_motion()[0] - shafts.zero_rad


def speeds(engine: Engine) -> NDArray[np.float64]:
    """Return the speeds of the shafts."""
    return engine.servos.rad_per_joint * engine.servos.joint_motion()[1]


def test_time_goes_by_steps_of_two_milliseconds(engine: Engine) -> None:
    for _ in range(3):
        engine.step()
    assert engine.now_ns == START_NS + 3 * 2_000_000 == START_NS + 3 * STEP_NS


def test_joints_start_inside_their_range(engine: Engine) -> None:
    assert engine.data.joint("finger").qpos[0] == pytest.approx(0.01)


def test_a_shaft_reads_its_joint_through_offset_and_sign(engine: Engine) -> None:
    engine.data.joint("arm").qpos[0] = 0.8
    engine.data.joint("arm").qvel[0] = 0.1
    assert angles(engine) == pytest.approx([-0.3])
    assert speeds(engine) == pytest.approx([-0.1])


def test_a_shaft_of_a_finger_turns_travel_into_an_angle(room: mujoco.MjModel) -> None:
    engine = Engine(room, [Shaft(joint="finger", offset=0.02, ratio=0.02)], [])
    engine.data.joint("finger").qpos[0] = 0.03
    assert angles(engine) == pytest.approx([0.5])


def test_a_command_in_shaft_direction_moves_a_mirrored_joint_backwards(engine: Engine) -> None:
    engine.servos.command(np.array([0.5]) * np.sign(engine.servos.rad_per_joint))
    for _ in range(50):
        engine.step()
    assert engine.data.joint("arm").qvel[0] < 0.0
    assert speeds(engine)[0] > 0.0
    effort = engine.servos.joint_effort() * np.sign(engine.servos.rad_per_joint)
    assert effort == pytest.approx([0.5])


def test_a_joint_that_the_model_lacks_is_named(room: mujoco.MjModel) -> None:
    with pytest.raises(TwinModelMismatch, match="'elbow'"):
        Engine(room, [Shaft(joint="elbow")], [])


def test_bodies_are_placed_with_their_yaw(engine: Engine) -> None:
    engine.place("base", 1.0, -2.0, 0.0, math.pi / 2)
    pose = engine.referee.truth()["robot"]
    assert (pose["x_m"], pose["y_m"], pose["yaw_rad"]) == pytest.approx((1.0, -2.0, math.pi / 2))


@pytest.mark.parametrize("body", ["box", "table"])
def test_only_free_bodies_are_placed(engine: Engine, body: str) -> None:
    with pytest.raises(TwinModelMismatch, match=body):
        engine.place(body, 0.0, 0.0, 0.0, 0.0)


def test_posing_an_unknown_joint_is_refused(engine: Engine) -> None:
    with pytest.raises(TwinModelMismatch, match="'knee'"):
        engine.pose({"knee": 1.0})


def test_plain_numbers_give_the_same_motion_as_arrays(engine: Engine) -> None:
    engine.data.joint("arm").qpos[0] = 0.8
    engine.data.joint("arm").qvel[0] = 0.1
    engine.servos.slip(0, 0.05)
    reported: list[tuple[int, float, float]] = []

    def law(now_ns: int, angle_rad: float, speed_rad_s: float) -> float:
        reported.append((now_ns, angle_rad, speed_rad_s))
        return 0.25

    engine.servos.command_each(engine.now_ns, [law])
    ((now_ns, angle_rad, speed_rad_s),) = reported
    assert now_ns == engine.now_ns
    assert angles(engine) == pytest.approx([angle_rad])
    assert speeds(engine) == pytest.approx([speed_rad_s])
    assert angle_rad == pytest.approx(-0.25)
    assert engine.data.ctrl[0] == -0.25
