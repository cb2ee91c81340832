"""Run pytest as a user of the package does, in a folder that knows nothing of this repository."""

import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLE = """
import pytest


@pytest.mark.twin(seed=7)
def test_the_robot_turns_by_what_it_was_told(twin):
    before = twin.lockstep.truth()["robot"]["yaw_rad"]
    outcome = twin.say("turn left 20 degrees")
    assert outcome["success"], outcome["error"]
    turned = twin.lockstep.truth()["robot"]["yaw_rad"] - before
    assert turned == pytest.approx(0.349, abs=0.05)
"""

MISTAKEN = """
import pytest


@pytest.mark.twin(sed=7)
def test_a_typing_error(twin):
    pass
"""


def run_pytest(folder: Path, *words: str) -> "subprocess.CompletedProcess[str]":
    return subprocess.run(
        [sys.executable, "-m", "pytest", "-q", *words],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=100,
        check=False,
    )


@pytest.mark.gl
@pytest.mark.timeout(120)
def test_a_test_of_a_users_own_finds_the_fixtures(tmp_path: Path) -> None:
    (tmp_path / "test_mine.py").write_text(EXAMPLE)
    done = run_pytest(tmp_path, "--strict-markers")
    assert "1 passed" in done.stdout, done.stdout


def test_an_unknown_choice_is_refused_by_name(tmp_path: Path) -> None:
    (tmp_path / "test_mine.py").write_text(MISTAKEN)
    done = run_pytest(tmp_path)
    assert "expected robot, world, seed, profile by name, got 'sed'" in done.stdout
