"""What a person is told of how the robot sees."""

from typing import Any

import pytest

from vla_deploy.cli.observation.status import as_text

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
