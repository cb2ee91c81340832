"""A motion that feels its way ends where it meets something, long before that is a collision."""

from typing import Any

import numpy as np
import pytest

from vla_deploy.control.motion.touch_guard import TouchGuard

BLOCKING_NM = 50.0
JOINT = "left_shoulder_pitch"
FAR_RAD, SLOWLY_S = 0.8, 8.0


def test_only_what_comes_on_top_of_the_first_torque_is_a_touch() -> None:
    guard = TouchGuard(("shoulder", "elbow", "wrist"), np.array([0.5, 0.4, np.inf]))
    assert guard.touch(np.array([2.0, -1.0, 0.0])) == ""
    assert guard.touch(np.array([2.4, -0.7, 90.0])) == ""
    told = guard.touch(np.array([1.4, -1.5, 90.0]))
    assert told == "elbow has met something: 0.50 N m more than before, 0.40 allowed"


def _feel_the_way(rig: Any, **more: Any) -> None:
    here = rig.joint(JOINT, "setpoint")
    u = np.linspace(0.0, 1.0, 40)
    s = 10 * u**3 - 15 * u**4 + 6 * u**5
    rig.send(
        kind="trajectory",
        motion_id=3,
        joints=[JOINT],
        times_s=(SLOWLY_S * u).tolist(),
        positions=(here + FAR_RAD * s)[:, None].tolist(),
        **more,
    )


def _block(rig: Any) -> None:
    """Hold the joint fast once it is well on its way."""
    began = rig.joint(JOINT)
    assert rig.lockstep.run_until(lambda: rig.joint(JOINT) > began + 0.3 * FAR_RAD, SLOWLY_S)
    model = rig.lockstep.twin.engine.model
    model.dof_frictionloss[model.joint(JOINT).dofadr[0]] = BLOCKING_NM


def test_a_free_way_is_felt_to_its_end(armed: Any) -> None:
    _feel_the_way(armed, contact_ratio=0.25)
    armed.run(SLOWLY_S + 0.5)
    (result,) = armed.results()
    assert result["status"] == "done", result


def test_a_blocked_joint_ends_the_motion_as_touched_and_the_robot_stays_armed(armed: Any) -> None:
    _feel_the_way(armed, contact_ratio=0.25)
    _block(armed)
    armed.run(1.5)
    (result,) = armed.results()
    assert result["status"] == "touched"
    assert f"{JOINT} has met something" in result["reason"]
    assert armed.state == "armed", armed.status["detail"]
    assert abs(armed.joint(JOINT, "velocity")) < 0.01


def test_who_feels_nothing_on_the_way_collides(armed: Any) -> None:
    _feel_the_way(armed)
    _block(armed)
    armed.run(1.5)
    (result,) = armed.results()
    assert (result["status"], armed.status["cause"]) == ("stopped", "collision")


@pytest.mark.parametrize("ratio", [0.0, 1.5, "much", None])
def test_a_ratio_that_is_none_is_refused(armed: Any, ratio: Any) -> None:
    _feel_the_way(armed, contact_ratio=ratio)
    armed.run(0.2)
    (result,) = armed.results()
    assert result["status"] == "refused"
    assert "contact_ratio: expected" in result["reason"]
