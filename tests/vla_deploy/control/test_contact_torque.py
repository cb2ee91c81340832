"""The torque that motion and weight do not explain."""

import numpy as np
import pytest

from vla_deploy.control.judging.contact_torque import FILTER_S, ContactTorque
from vla_deploy.robots import load_robot
from vla_deploy.robots.kinematics.model import RobotModel, full_positions

ROBOT = load_robot("butler")
MODEL = RobotModel(ROBOT)
POSE = full_positions(ROBOT, [("left_shoulder_pitch", 0.8), ("left_elbow", 1.0)])
STILL = np.zeros(len(ROBOT.joint_names))
STALL = np.array([ROBOT.model_of(name).stall_torque_nm for name in ROBOT.joint_names])
PITCH = ROBOT.joint_index["left_shoulder_pitch"]
STEP_NS = 20_000_000


def look(contact: ContactTorque, step: int, effort: np.ndarray) -> np.ndarray | None:
    contact.note(STILL, effort)
    return contact.update(step * STEP_NS, POSE)


def settle(contact: ContactTorque, effort: np.ndarray, steps: int = 40) -> np.ndarray:
    told = [look(contact, n, effort) for n in range(1, steps + 1)]
    assert told[-1] is not None
    return told[-1]


def holding() -> np.ndarray:
    """Return the effort that carries the arms' own weight; pinions of grippers bear none."""
    return MODEL.gravity(POSE) / STALL


def test_a_robot_that_carries_its_own_weight_feels_nothing() -> None:
    told = settle(ContactTorque(ROBOT, MODEL), holding())
    assert np.abs(told).max() < 1e-6


def test_a_weight_in_the_hand_is_told_in_newton_metres() -> None:
    loaded = holding()
    loaded[PITCH] += 2.0 / STALL[PITCH]
    told = settle(ContactTorque(ROBOT, MODEL), loaded)
    assert told[PITCH] == pytest.approx(-2.0, abs=0.01)


def test_a_short_push_passes_the_filter_in_part() -> None:
    contact = ContactTorque(ROBOT, MODEL)
    settle(contact, holding())
    loaded = holding()
    loaded[PITCH] += 2.0 / STALL[PITCH]
    told = look(contact, 41, loaded)
    assert told is not None
    assert told[PITCH] == pytest.approx(-2.0 * 0.02 / (FILTER_S + 0.02))


def test_servos_that_measure_no_current_are_not_judged() -> None:
    contact = ContactTorque(ROBOT, MODEL)
    judged = {
        name for name, senses in zip(ROBOT.joint_names, contact.senses, strict=True) if senses
    }
    assert "left_elbow" in judged
    assert not judged & {"head_pan", "head_tilt", "left_gripper", "right_gripper"}


def test_a_gap_or_a_missing_value_begins_anew() -> None:
    contact = ContactTorque(ROBOT, MODEL)
    settle(contact, holding())
    assert look(contact, 100, holding()) is None
    missing = holding()
    missing[0] = np.nan
    assert look(contact, 101, missing) is None
    assert look(contact, 102, holding()) is None
    assert look(contact, 103, holding()) is not None


def test_a_servo_that_rings_in_step_with_the_looks_shows_no_torque() -> None:
    contact, told = ContactTorque(ROBOT, MODEL), None
    for tick in range(300):
        ringing = holding()
        ringing[PITCH] += 0.25 * np.cos(2.0 * np.pi * tick / 2.5)
        contact.note(STILL, ringing)
        if tick % 5 == 0:
            told = contact.update(tick * STEP_NS // 5, POSE)
    assert told is not None
    assert abs(told[PITCH]) < 0.01 * STALL[PITCH]
