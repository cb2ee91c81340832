"""Near pairs against all pairs: the same distances wherever they matter."""

from typing import Any

import numpy as np
import pinocchio
import pytest

from vla_deploy.control.judging.body_shapes import BodyShapes
from vla_deploy.robots import load_robot

ROBOT = load_robot("butler")
LIMITS = ROBOT.protection.clearance
STEPS = 100
SOLVED_M = 1e-5  # what the solver leaves, which begins where it ended last


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("step_rad", [0.005, 0.1, 3.0])
def test_near_distances_are_those_of_all_pairs_up_to_their_reach(
    seed: int, step_rad: float
) -> None:
    body = BodyShapes(ROBOT)
    rng = np.random.default_rng(seed)
    pose = np.zeros(len(ROBOT.joint_names))
    for _ in range(STEPS):
        way = rng.uniform(-step_rad, step_rad, len(pose)) * (rng.random(len(pose)) < 0.5)
        pose = np.clip(pose + way, ROBOT.position_min, ROBOT.position_max)
        near, exact = (
            np.concatenate(body.survey(pose)[:2]),
            np.concatenate(body.distances(pose)),
        )
        reach_m = near.max()
        assert reach_m > max(LIMITS.self_m, LIMITS.floor_m)
        assert near == pytest.approx(np.minimum(exact, reach_m), abs=SOLVED_M)


def test_a_survey_is_of_its_own_pose_whatever_was_asked_between() -> None:
    body = BodyShapes(ROBOT)
    first, second = ROBOT.position_min * 0.5, ROBOT.position_max * 0.5
    for pose in (first, first, second, first):
        survey = body.survey(pose)
        body.balls(second)
        np.testing.assert_allclose(survey.grips, body.grips(pose))
    assert body.survey(first) is survey
    pose = first.copy()
    body.survey(pose)
    pose += 0.1
    assert body.survey(pose) is not survey


def test_a_pair_whose_joints_stand_is_as_far_as_before_without_a_new_measurement(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    body = BodyShapes(ROBOT)
    pose = np.zeros(len(ROBOT.joint_names))
    measured: list[int] = []
    measure = pinocchio.computeDistance

    def counting(shapes: Any, placed: Any, pair: int) -> Any:
        measured.append(pair)
        return measure(shapes, placed, pair)

    monkeypatch.setattr(pinocchio, "computeDistance", counting)
    before = body.survey(pose).self_m
    near = np.count_nonzero(before < before.max())
    measured.clear()
    pose = pose.copy()
    pose[ROBOT.joint_index["left_elbow"]] += 1e-3
    after = body.survey(pose).self_m
    assert 0 < len(measured) < near
    stand = [not any("left" in name for name in pair) for pair in body.self_pairs]
    assert any(stand)
    np.testing.assert_array_equal(after[stand], before[stand])
