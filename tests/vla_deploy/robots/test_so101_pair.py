"""Two SO-101 on one table: each arm is the published one at its place, and neither meets the
other unseen."""

import math
import runpy
from pathlib import Path

import mujoco
import numpy as np
import pytest

from sim_twin.worlds import draw_poses
from vla_deploy.control.judging.body_shapes import BodyShapes
from vla_deploy.manipulation.downward_reach import DownwardReach
from vla_deploy.manipulation.grasps import hand_down
from vla_deploy.manipulation.kinematics import ArmKinematics
from vla_deploy.robots import load_robot
from vla_deploy.robots.loader import ROBOTS_DIR

PAIR, ARM = load_robot("so101_pair"), load_robot("so101")
SIDES_M = {"left": 0.15, "right": -0.15}
MJCF = ROBOTS_DIR / "so101_pair" / "so101_pair.xml"
SCRIPT = Path(__file__).parents[3] / "scripts" / "so101_pair.py"


def test_its_mjcf_is_what_the_script_makes_of_the_one_arm() -> None:
    assert MJCF.read_text(encoding="utf-8") == runpy.run_path(str(SCRIPT))["pair_text"]()


@pytest.mark.parametrize("side", SIDES_M)
def test_each_hand_is_where_that_of_one_arm_is_beside_the_middle(side: str) -> None:
    one, both = ArmKinematics(ARM, "hand"), ArmKinematics(PAIR, side)
    model = mujoco.MjModel.from_xml_path(str(MJCF))
    data = mujoco.MjData(model)
    beside_m = np.array([0.0, SIDES_M[side], 0.0])
    for drawn in np.random.default_rng(0).uniform(ARM.position_min, ARM.position_max, (5, 6)):
        joints = dict(zip(ARM.joint_names, drawn, strict=True))
        for name, value in joints.items():
            data.joint(f"{side}_{name}").qpos[0] = value
        mujoco.mj_forward(model, data)
        there = np.array(
            [joints.get(name.removeprefix(f"{side}_"), 0.0) for name in PAIR.joint_names]
        )
        expected_m = one.forward(drawn)[:3, 3] + beside_m
        assert both.forward(there)[:3, 3] == pytest.approx(expected_m, abs=1e-6)
        assert data.site(f"{side}_grip").xpos == pytest.approx(expected_m, abs=1e-6)


def test_both_are_wired_set_and_limited_as_one_arm() -> None:
    ids = [servo.id for servo in PAIR.servo_bus.servos]
    assert ids == list(range(1, 13))
    assert [supply.servos for supply in PAIR.servo_bus.supplies] == [tuple(ids[:6]), tuple(ids[6:])]
    for side in SIDES_M:
        for name in ARM.joint_names:
            assert PAIR.limits[f"{side}_{name}"] == ARM.limits[name]
        for pose in set(ARM.poses) - {"aside"}:
            own = {name: PAIR.poses[pose][f"{side}_{name}"] for name in ARM.joint_names}
            assert own == ARM.poses[pose], (side, pose)


def test_hands_that_would_meet_in_the_middle_are_judged_to_be_too_near() -> None:
    shapes = BodyShapes(PAIR)
    between = [
        tuple(sorted(name.partition("_")[0] for name in pair)) == ("left", "right")
        for pair in shapes.self_pairs
    ]
    positions = np.array([PAIR.poses["ready"][name] for name in PAIR.joint_names])
    apart_m = min(np.array(shapes.distances(positions)[0])[between])
    for side in SIDES_M:
        middle = hand_down((0.19, 0.0, 0.06), yaw_rad=math.pi / 2)
        positions = ArmKinematics(PAIR, side).solve(middle, positions).positions
    meeting_m = min(np.array(shapes.distances(positions)[0])[between])
    assert meeting_m < PAIR.protection.clearance.self_m < 0.1 < apart_m


def test_each_block_lies_where_a_hand_gets_and_the_bowl_where_both_do() -> None:
    hands = DownwardReach(PAIR)
    for seed in range(20):
        places = {
            name: pose.position_m[:2] for name, pose in draw_poses("pair_table", seed).items()
        }
        assert all(hands.has(hand, (*places["bowl"], 0.07)) for hand in SIDES_M), seed
        for block in ("red_block", "blue_block"):
            assert hands.any_has((*places[block], 0.02)), (seed, block)
