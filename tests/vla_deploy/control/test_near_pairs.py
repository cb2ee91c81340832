"""Near pairs against all pairs: the same distances wherever they matter."""

import numpy as np
import pytest

from vla_deploy.control.body_shapes import BodyShapes
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
