"""Distances of Butler's parts, which pairs are judged, and what the lidar mask covers."""

from dataclasses import replace

import numpy as np
import pytest

from vla_deploy.control.judging.body_shapes import FLOOR, BodyShapes
from vla_deploy.robots import load_robot
from vla_deploy.robots.kinematics.model import full_positions
from vla_deploy.robots.protection import ClearanceLimits

ROBOT = load_robot("butler")
BODY = BodyShapes(ROBOT)
TUCK = full_positions(ROBOT, list(ROBOT.poses["tuck"].items()))


def test_neighbours_at_a_joint_and_fingers_of_one_hand_are_no_pair() -> None:
    pairs = {frozenset(pair) for pair in BODY.self_pairs}
    for first, second in (
        ("left_upper_arm_shell", "left_elbow_shell"),
        ("left_palm", "left_finger_pad"),
        ("left_finger_pad", "left_finger_mimic_pad"),
        ("left_tyre", "right_tyre"),
        ("left_forearm_shell", "left_palm"),
    ):
        assert frozenset((first, second)) not in pairs
    assert frozenset(("left_palm", "right_palm")) in pairs
    assert frozenset(("left_palm", "torso_shell")) in pairs


def test_only_what_servos_move_is_held_against_the_floor() -> None:
    parts = {first for first, second in BODY.floor_pairs if second == FLOOR}
    assert "left_finger_pad" in parts
    assert not parts & {"left_tyre", "front_caster", "base_deck"}


def test_an_allowed_pair_is_not_judged() -> None:
    limits = ClearanceLimits(allow=(("right_palm", "left_palm"),))
    protection = replace(ROBOT.protection, clearance=limits)
    allowed = BodyShapes(replace(ROBOT, protection=protection))
    assert ("left_palm", "right_palm") in BODY.self_pairs
    assert set(BODY.self_pairs) - set(allowed.self_pairs) == {("left_palm", "right_palm")}


def test_tucked_arms_touch_nothing_and_arms_swung_inward_overlap() -> None:
    apart, above = BODY.distances(TUCK)
    assert apart.min() > 0.015
    assert above.min() > 0.4
    inward = full_positions(
        ROBOT, [("left_shoulder_yaw", -1.17), ("left_shoulder_pitch", 1.2), ("left_elbow", 1.5)]
    )
    assert BODY.distances(inward)[0].min() < 0.0


def test_a_tucked_robot_has_its_weight_over_its_wheels() -> None:
    centre = BODY.centre_of_mass(TUCK)
    assert np.abs(centre[:2]).max() < 0.05
    assert 0.2 < centre[2] < 0.5


def test_grips_are_told_for_hands_with_a_workspace_only() -> None:
    assert BODY.grips(TUCK).shape == (2, 3)
    without = replace(ROBOT, protection=replace(ROBOT.protection, workspaces={}))
    assert BodyShapes(without).grips(TUCK).shape == (0, 3)


def test_balls_cover_every_grip_side_of_the_hands() -> None:
    centres, radii = BODY.balls(TUCK)
    assert centres.shape == (len(radii), 3)
    for grip in BODY.grips(TUCK):
        gap = np.linalg.norm(centres - grip, axis=1) - radii
        assert gap.min() == pytest.approx(0.0, abs=0.06)
