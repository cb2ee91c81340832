"""See what would be done for a command, without a robot that runs."""

import json

import pytest

SCENE = {
    "stamp_ns": 1,
    "things": [
        {
            "id": name,
            "class": "cup",
            "colour": colour,
            "position_m": [2.2, y_m, 0.5],
            "size_m": [0.07, 0.07, 0.1],
            "held_by": None,
        }
        for name, colour, y_m in (("cup_1", "red", 1.4), ("cup_2", "blue", 1.6))
    ],
}


@pytest.fixture
def plan(tmp_path, vla):
    """Plan a command in the scene; return the exit code and what was printed."""
    scene = tmp_path / "scene.json"
    scene.write_text(json.dumps(SCENE))

    def plan(*words: str) -> tuple[int, str]:
        return vla("plan", *words, "--scene", scene)[:2]

    return plan


def test_a_plan_is_printed_with_who_made_it(plan):
    code, printed = plan("pick up the red cup")
    assert code == 0
    assert printed.startswith("patterns planned in ")
    assert "pick up red cup" in printed


def test_scripts_get_plan_and_attempts(plan):
    code, printed = plan("pick up the red cup", "--json")
    told = json.loads(printed)
    assert (code, told["rung"], told["question"]) == (0, "patterns", None)
    assert told["plan"]["actions"][-1]["skill"] == "pick_up"


def test_what_the_robot_would_ask_is_told_by_its_own_exit_code(plan):
    code, printed = plan("pick up the cup")
    assert code == 3
    assert "robot would ask: Which cup" in printed


def test_what_nobody_can_plan_is_refused_with_what_each_said(plan):
    code, printed = plan("sing a sea shanty")
    assert code == 2
    said = [line.split()[0] for line in printed.splitlines()]
    assert said == ["patterns", "command_parser"]


def test_a_server_that_is_not_there_is_told(plan, tmp_path):
    profile = tmp_path / "served.toml"
    profile.write_text('inherits = "desktop"\n[planning]\nservers = ["attic"]\n')

    code, printed = plan("pick up the red cup", "--profile", str(profile))
    assert code == 0
    assert "attic away: " in printed
    assert "attic" in json.loads(plan("stop", "--profile", str(profile), "--json")[1])["away"]


@pytest.mark.parametrize("content", ["[1, 2]", "{", '{"objects": 3}', '{"things": [7]}'])
def test_a_file_that_is_no_scene_is_refused_in_one_line(tmp_path, vla, content):
    (tmp_path / "bad.json").write_text(content)
    said = vla("plan", "go", "--scene", tmp_path / "bad.json")
    assert (said.code, len(said.err.splitlines())) == (2, 1)
