"""Collect the status that the processes of a run publish."""

import math
from typing import Any

import numpy as np

from vla_deploy.client.agent_lease import judge_lease
from vla_deploy.client.link import RobotLink
from vla_deploy.client.place_state import Doubt, PlaceState
from vla_deploy.ipc import Sample, topics


def collect(link: RobotLink) -> dict[str, Any]:
    """Return the status of every process; null where one is silent."""
    pose = link.fresh(topics.POSE, age_limit_s=1.0)
    dashboard = link.document(topics.DASHBOARD_STATUS, age_limit_s=3.0)
    return {
        "run_dir": str(link.run_dir),
        "twin": link.document(topics.TWIN_STATUS, age_limit_s=3.0),
        "process_table": link.document(topics.PROCESS_TABLE, age_limit_s=3.0),
        "activity": link.document(topics.ACTIVITY, age_limit_s=3.0),
        "control": link.document(topics.CONTROL_STATUS, age_limit_s=1.0),
        "planner": link.document(topics.PLANNER_STATUS, age_limit_s=2.0),
        "executor": link.document(topics.EXECUTOR_STATUS, age_limit_s=2.0),
        "pose": None if pose is None else pose_document(pose),
        "scene": link.document(topics.SCENE, age_limit_s=5.0),
        "speech": link.document(topics.SPEECH_STATUS, age_limit_s=2.0),
        "battery": link.document(topics.BATTERY, topics.BATTERY.deadline_s),
        "profile": link.document(topics.PROFILE_STATUS, age_limit_s=3.0),
        "agents": judge_lease(link.document(topics.AGENT_LEASE), link.clock.now_ns()).document(),
        "replay": link.document(topics.REPLAY_STATUS, age_limit_s=3.0),
        "dashboard_url": None if dashboard is None else dashboard["url"],
    }


def pose_document(sample: Sample) -> dict[str, Any]:
    """Return a pose as JSON, its state and doubt in words."""
    numbers = {name: float(sample.data[name]) for name in ("x_m", "y_m", "yaw_rad", "match_ratio")}
    state, doubt = PlaceState(int(sample.data["state"])), Doubt(int(sample.data["doubt"]))
    return {
        **numbers,
        "state": state.name.lower(),
        "doubt": doubt.name.lower(),
        "covariance": np.reshape(sample.data["covariance"], (3, 3)).tolist(),
    }


def motion_now(link: RobotLink) -> dict[str, Any]:
    """Return the speed of the base, that of the fastest joint, and the missions at work.

    SI units; null where control is silent or there is no base, a joint by its number in the robot
    file.
    """
    base = link.fresh(topics.BASE_STATE, age_limit_s=1.0)
    joints = link.fresh(topics.JOINT_STATE, age_limit_s=1.0)
    missions = link.document(topics.MISSIONS)
    shown = [] if missions is None else missions["missions"]
    return {
        "base": None if base is None else _base_speed(base),
        "joint": None if joints is None else _fastest_joint(joints),
        "missions": [one["mission_id"] for one in shown if one["state"] == "executing"],
    }


def _base_speed(sample: Sample) -> dict[str, float]:
    ahead, left = float(sample.data["v_m_s"]), float(sample.data["left_m_s"])
    return {"speed_m_s": math.hypot(ahead, left), "w_rad_s": float(sample.data["w_rad_s"])}


def _fastest_joint(sample: Sample) -> dict[str, float] | None:
    speeds = np.abs(sample.data["velocity"][: int(sample.data["joint_count"])])
    if not len(speeds):
        return None
    fastest = int(np.argmax(speeds))
    return {"number": fastest, "velocity": float(speeds[fastest])}
