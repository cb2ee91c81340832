"""What a person is told of how the robot sees."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from drivers.clock import MonotonicClock
from vla_deploy.cli.observation.status import as_text
from vla_deploy.install.robot_report import moving_in, tick_of
from vla_deploy.ipc import SharedSpace, topics

SILENT = ("twin", "process_table", "profile", "control", "pose", "planner", "executor", "speech")
MODEL = {
    "model": "detector",
    "variant": "int8_u8s8",
    "provider": "CPUExecutionProvider",
    "p50_s": 0.0041,
    "memory_mb": 11.6,
    "notices": ["CUDAExecutionProvider: this onnxruntime has none"],
}


def text_of(**told: Any) -> str:
    return as_text({**dict.fromkeys(SILENT), "scene": None, **told})


def told(sight: dict[str, Any], *faults: str) -> str:
    scene = {"objects": [], "sight": sight, "image": {"use": "all", "faults": list(faults)}}
    return text_of(scene=scene)


def test_the_network_at_work_is_told_with_its_cost_and_what_is_not_as_asked() -> None:
    text = told({"mode": "network", "why": "", "model": MODEL})
    assert "names by: form and detector int8_u8s8 on CPUExecutionProvider, 4 ms, 12 MB" in text
    assert "CUDAExecutionProvider: this onnxruntime has none" in text


@pytest.mark.parametrize("model", [None, MODEL])
def test_that_the_network_is_done_without_is_told_with_the_reason(
    model: dict[str, Any] | None,
) -> None:
    text = told({"mode": "form", "why": "no answer within 1 s", "model": model})
    assert text.endswith("names by: form alone (no answer within 1 s)")


def test_what_spoils_the_images_is_told() -> None:
    text = told({"mode": "network", "why": "", "model": MODEL}, "dark: 1, limit 0.9 (...)")
    assert text.endswith("  image: dark: 1, limit 0.9 (...)")


def test_that_the_chosen_profile_does_not_load_is_told() -> None:
    profile = {
        "profile": "desktop",
        "phase": "",
        "last": {},
        "fault": "the chosen profile x is gone",
    }
    lines = text_of(profile=profile).splitlines()
    assert lines[lines.index("profile: desktop") + 1] == "  alarm: the chosen profile x is gone"


def test_whether_spoken_words_are_understood_is_told_and_why_not() -> None:
    def ears(speech: dict[str, Any] | None) -> str:
        return text_of(speech=speech).split("\n")[-2]

    assert ears(None) == "hears: nothing, speech is silent"
    deaf = {"state": "deaf", "why": "robot butler has no [microphone]"}
    assert ears(deaf) == "hears: no words (robot butler has no [microphone]); type commands"
    heard = {"accepted": 3, "doubted": 1, "rejected": 1}
    well = {"state": "listening", "why": "", "model": {"name": "whisper-small.en"}, "heard": heard}
    assert ears(well) == "hears: listening by whisper-small.en, 3 accepted, 1 doubted, 1 rejected"


def test_who_plans_what_is_asked_and_who_is_away_is_told() -> None:
    planner = {
        "rungs": ["rules", "server bench"],
        "by_rung": {"rules": {"planned": 3}, "server bench": {"declined": 2}},
        "refused": 1,
        "away": {"cloud": "no key"},
        "question": "Which cup?",
    }
    text = text_of(planner=planner)
    assert "plans by: rules 3, server bench 0; refused 1" in text
    assert "  without cloud: no key" in text
    assert "asks: Which cup?" in text


@pytest.mark.parametrize(
    ("factor", "words"),
    [(1.0, "twin: at 1.0 of real time"), (0.6, "twin: at 0.6 of real time, held by perception")],
)
def test_how_fast_the_twins_time_goes_and_who_holds_it_is_shown(factor: float, words: str) -> None:
    twin = {"pace": "real", "real_time_factor": factor, "held_by": "perception"}
    lines = text_of(twin=twin).splitlines()
    assert words in lines


@pytest.mark.parametrize(
    ("joint_rad_s", "base_m_s", "mission", "moving"),
    [
        (0.02, 0.004, "completed", ""),
        (-0.3, 0.0, "completed", "joint 1 at 0.3 rad/s"),
        (0.0, -0.2, "completed", "the base at {'speed_m_s': 0.2, 'w_rad_s': 0.0}"),
        (0.0, 0.0, "executing", "mission m-1"),
    ],
)
def test_an_update_reads_from_the_status_whether_the_robot_moves(
    run_dir: Path,
    vla: Callable[..., Any],
    joint_rad_s: float,
    base_m_s: float,
    mission: str,
    moving: str,
) -> None:
    space = SharedSpace(run_dir / "ipc", MonotonicClock())
    names = ("position", "velocity", "setpoint", "effort_ratio", "age_s", "error", "torque_enabled")
    joints: dict[str, Any] = {name: [0, 0] for name in names}
    velocity = [0.0, joint_rad_s]
    space.cell_writer(topics.JOINT_STATE).put(**{**joints, "joint_count": 2, "velocity": velocity})
    pose = dict.fromkeys(("x_m", "y_m", "yaw_rad", "w_rad_s", "enabled"), 0)
    space.cell_writer(topics.BASE_STATE).put(v_m_s=base_m_s, **pose)
    control = {"state": "armed", "tick": 41, "active_motions": [], "cause": "", "detail": ""}
    space.cell_writer("control_status").put_document(control)
    document = {"missions": [{"mission_id": "m-1", "state": mission}], "trouble": ""}
    space.cell_writer("missions").put_document(document)
    report = vla("status", "--json").document
    space.close()
    assert (moving_in(report), tick_of(report)) == (moving, 41)
