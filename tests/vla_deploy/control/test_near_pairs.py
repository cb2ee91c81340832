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
            np.concatenate(body.near_distances(pose)),
            np.concatenate(body.distances(pose)),
        )
        reach_m = near.max()
        assert reach_m > max(LIMITS.self_m, LIMITS.floor_m)
        assert near == pytest.approx(np.minimum(exact, reach_m), abs=SOLVED_M)


def test_grips_of_the_pose_asked_last_are_those_of_that_pose() -> None:
    body = BodyShapes(ROBOT)
    pose = ROBOT.position_min * 0.5
    body.near_distances(pose)
    np.testing.assert_allclose(body.grips_here(), body.grips(pose))
