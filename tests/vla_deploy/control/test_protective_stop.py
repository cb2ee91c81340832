"""Hold that a protective stop ramps, stands, is watched, and ends by itself without moving."""

from dataclasses import replace
from typing import Any as Rig  # the class in conftest.py, which no test can import

import numpy as np
import pytest

AHEAD = [-4, -3, -2, -1, 0, 1, 2, 3, 4]


def demand(rig: Rig, stop: bool) -> None:
    reason = "memory: 900 MB, limit 800 MB" if stop else ""
    document = {"rows": [], "ladder": {"step": 0, "taken": []}, "stop": stop, "reason": reason}
    rig.space.cell_writer("budget_stop").put_document(document)


def test_everything_ramps_within_its_limits_and_keeps_its_power(armed: Rig) -> None:
    armed.go(1, left_elbow=2.4, head_pan=1.2)
    armed.drive(0.4, 0.0, 1.0)
    demand(armed, stop=True)
    period_s, limits = armed.control.period_s, armed.robot
    setpoints, speeds = [armed.column("setpoint")], [armed.base()["v_m_s"]]
    for _ in range(260):  # nobody but control runs any more: the executor is silent
        armed.tick()
        setpoints.append(armed.column("setpoint"))
        speeds.append(armed.base()["v_m_s"])
    assert (armed.state, armed.status["cause"]) == ("protective_stop", "budget_exhausted")
    assert armed.status["subject"].startswith("memory")
    assert armed.column("torque_enabled").all()
    assert armed.base()["enabled"]
    velocity = np.diff(setpoints, axis=0) / period_s
    acceleration = np.diff(velocity, axis=0) / period_s
    jerk = np.diff(acceleration, axis=0) / period_s
    assert (np.abs(velocity).max(axis=0) <= 1.001 * limits.velocity_max).all()
    assert (np.abs(acceleration).max(axis=0) <= 1.001 * limits.acceleration_max).all()
    assert (np.abs(jerk).max(axis=0) <= 1.01 * limits.jerk_max).all()
    assert np.abs(velocity[-10:]).max() == 0.0
    assert abs(speeds[-1]) < 0.005
    stop_s = np.argmax(np.array(speeds) < 0.01) * period_s
    assert 0.38 / limits.base.stop_deceleration_m_s2 < stop_s < 0.5


def test_it_ends_by_itself_and_moves_nothing_on_its_own(armed: Rig) -> None:
    armed.go(1, left_elbow=2.4)
    armed.run(0.4)
    demand(armed, stop=True)
    armed.run(1.0)
    armed.go(2, left_elbow=1.2)
    armed.run(0.1)
    stopped, refused = armed.results()
    assert (stopped["status"], refused["status"]) == ("stopped", "refused")
    assert "budget_exhausted" in refused["reason"]
    here = armed.column("position")
    demand(armed, stop=False)
    armed.run(0.9)
    assert armed.state == "protective_stop"
    armed.run(0.3)
    assert (armed.state, armed.status["speed_ratio"]) == ("armed", 1.0)
    assert np.abs(armed.column("position") - here).max() < 0.005
    armed.go(3, left_elbow=1.2)
    armed.run(2.5)
    assert [r["status"] for r in armed.results()] == ["done"]


def test_motion_during_standstill_becomes_a_stop_by_category(armed: Rig) -> None:
    limits = armed.control._judging.limits
    armed.control._judging.limits = replace(
        limits, standstill_wheel_rad_s=-1.0
    )  # rest is motion enough
    armed.run(0.5)
    assert armed.state == "armed"
    demand(armed, stop=True)
    armed.run(0.15)
    assert armed.state == "protective_stop"
    armed.run(0.5)
    assert armed.status["cause"] == "standstill_motion"
    assert armed.base()["enabled"] == 0.0
    armed.control._judging.limits = limits
    demand(armed, stop=False)
    armed.run(1.5)
    assert armed.state == "stopped"
    armed.ask("reset", "arm", within_s=1.0)
    assert armed.state == "armed"


@pytest.mark.parametrize(
    ("topic", "cause", "limit_s"),
    [
        ("scan", "stale_scan", 0.5),
        ("near_obstacles", "stale_depth", 1.0),
        ("pose", "stale_pose", 0.5),
        ("imu", "stale_imu", 0.5),
    ],
)
def test_a_base_without_one_of_its_senses_comes_to_rest_and_drives_on_when_it_is_back(
    armed: Rig, topic: str, cause: str, limit_s: float
) -> None:
    armed.drive(0.3, 0.0, 1.0)
    armed.lidar.sees.remove(topic)
    armed.go(1, head_pan=0.4)
    armed.drive(0.3, 0.0, limit_s - 0.1)
    assert armed.status["cause"] == ""
    armed.drive(0.3, 0.0, 1.0)
    assert armed.status["cause"] == cause
    assert (armed.status["limit"], armed.status["measured"] > limit_s) == (limit_s, True)
    assert armed.base()["v_m_s"] == pytest.approx(0.0, abs=0.01)
    assert [r["status"] for r in armed.results()] == ["done"]
    armed.lidar.sees.add(topic)
    armed.drive(0.3, 0.0, 1.5)
    assert armed.state == "armed"
    assert armed.base()["v_m_s"] == pytest.approx(0.3, abs=0.02)


def test_before_anything_is_seen_arms_move_and_the_base_does_not(rig: Rig) -> None:
    rig.lidar.sees.clear()
    rig.boot()
    rig.ask("arm")
    assert (rig.state, rig.status["cause"]) == ("armed", "")
    rig.go(1, head_pan=0.4)
    rig.drive(0.3, 0.0, 1.5)
    assert [r["status"] for r in rig.results()] == ["done"]
    assert (rig.state, rig.status["cause"]) == ("armed", "stale_scan")
    assert abs(rig.base()["v_m_s"]) < 0.01
    rig.lidar.sees |= {"scan", "near_obstacles", "pose", "imu"}
    rig.drive(0.3, 0.0, 1.5)
    assert rig.base()["v_m_s"] == pytest.approx(0.3, abs=0.02)


def test_a_camera_that_is_looked_at_seldom_by_its_profile_is_waited_for(armed: Rig) -> None:
    armed.lidar.look_period_s = 1.0
    armed.drive(0.3, 0.0, 0.5)
    armed.lidar.sees.remove("near_obstacles")
    armed.drive(0.3, 0.0, 2.6)
    assert armed.status["cause"] == ""
    armed.drive(0.3, 0.0, 0.8)
    assert (armed.status["cause"], armed.status["limit"]) == ("stale_depth", 3.0)


def test_what_stands_ahead_blocks_the_way_there_and_not_the_way_back(armed: Rig) -> None:
    armed.lidar.ranges_m[AHEAD] = 0.25
    armed.run(0.3)
    start = armed.base()["x_m"]
    armed.drive(0.3, 0.0, 1.0)
    assert armed.status["cause"] == "obstacle_stop_zone"
    assert "forward" in armed.status["blocked"]
    assert armed.base()["x_m"] - start < 0.01
    armed.drive(-0.2, 0.0, 1.0)
    assert armed.base()["x_m"] - start < -0.05
