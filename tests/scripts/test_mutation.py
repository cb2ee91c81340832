"""The mutation campaign, on a package of one function: what it notices and what it tells."""

import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
TOOL = ROOT / "scripts" / "mutation"
EQUIVALENT = ROOT / "tests" / "vla_deploy" / "safety" / "equivalent_mutants.toml"
SOURCE = """
LEAST = 3


def is_big(value):
    return value > LEAST


def above(least):
    def judge(value):
        return value > least

    return judge


is_vast = above(9)
"""
NARROW = """
from little.sizes import is_big, is_vast

def test_it():
    assert not is_vast(9)
    assert is_vast(10)
    assert is_big(9)
"""
WIDE = NARROW + "    assert is_big(4)\n    assert not is_big(3)\n"


@pytest.fixture
def little(tmp_path: Path) -> Path:
    """Lay out a package and a test that leaves its boundary open; return their root."""
    for folder in ("little", "tests/little"):
        (tmp_path / folder).mkdir(parents=True)
    (tmp_path / "little" / "__init__.py").touch()
    (tmp_path / "little" / "sizes.py").write_text(SOURCE)
    (tmp_path / "tests" / "little" / "test_sizes.py").write_text(NARROW)
    return tmp_path


def run(*options: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(TOOL), "--jobs", "1", *options]
    only_what_it_needs = {"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1", "PYTEST_PLUGINS": "pytest_timeout"}
    return subprocess.run(
        command,
        capture_output=True,
        text=True,
        timeout=50,
        check=False,
        env=os.environ | only_what_it_needs,
    )


def run_on(little: Path) -> subprocess.CompletedProcess[str]:
    return run("--root", str(little), "--package", "little")


def list_as_equivalent(little: Path, *mutants: str) -> None:
    rows = [f'[[equivalent]]\nmutant = "{mutant}"\nreason = "a try"\n' for mutant in mutants]
    (little / "tests" / "little" / "equivalent_mutants.toml").write_text("".join(rows))


def test_what_no_test_notices_is_reported_and_the_rest_is_not(little: Path) -> None:
    done = run_on(little)
    assert {line for line in done.stdout.splitlines() if line.startswith("survived:")} == {
        "survived: sizes.py:2: sizes.module: 3 -> 4",
        "survived: sizes.py:6: sizes.is_big: value > LEAST -> value >= LEAST",
    }
    assert "9 mutants, 2 survived" in done.stdout
    assert done.returncode == 1


def test_a_test_of_the_boundary_kills_them_all(little: Path) -> None:
    (little / "tests" / "little" / "test_sizes.py").write_text(WIDE)
    done = run_on(little)
    assert "9 mutants, 0 survived" in done.stdout
    assert done.returncode == 0, done.stdout + done.stderr


def test_a_list_of_equivalents_must_tell_the_truth(little: Path) -> None:
    killed = "sizes.is_big: value > LEAST -> value <= LEAST"
    list_as_equivalent(little, "sizes.module: 3 -> 4", killed, "sizes.gone: 1 -> 2")
    done = run_on(little)
    assert "9 mutants, 1 survived" in done.stdout
    assert f"listed as equivalent, but a test fails: {killed}" in done.stdout
    assert "listed as equivalent, but there is no such mutant: sizes.gone: 1 -> 2" in done.stdout
    assert done.returncode == 1


def test_tests_that_fail_without_any_change_end_the_campaign(little: Path) -> None:
    (little / "tests" / "little" / "test_sizes.py").write_text(NARROW + "    assert is_big(1)\n")
    done = run_on(little)
    assert "fails without any change; mend it first" in done.stdout + done.stderr
    assert done.returncode == 1


def test_every_mutant_of_safety_that_is_listed_as_equivalent_exists_and_has_a_reason() -> None:
    done = run("--list")
    assert done.returncode == 0, done.stdout.splitlines()[-1]
    rows = tomllib.loads(EQUIVALENT.read_text())["equivalent"]
    assert all(len(row["reason"]) > 20 for row in rows)
    assert len({row["mutant"] for row in rows}) == len(rows)


@pytest.mark.slow
@pytest.mark.nightly
@pytest.mark.timeout(4 * 3600)
def test_no_small_change_of_the_safety_rules_passes_their_tests() -> None:
    # What it tells goes to the terminal, a line per file and survivor.
    assert subprocess.run([sys.executable, str(TOOL)], check=False).returncode == 0
