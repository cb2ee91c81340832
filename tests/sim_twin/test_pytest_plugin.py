"""Run pytest as a user of the package does, in a folder that knows nothing of this repository."""

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import vla_deploy.robots
from drivers.clock import MonotonicClock

PAGE = Path(__file__).parents[2] / "docs/testing.md"
ROBOT_FILE = Path(vla_deploy.robots.__file__).parent / "butler/robot.toml"

FAULTY = """
import pytest


def test_the_processes_stop_without_their_servo_bus(twin_stack, faults):
    fault = faults.inject("servo_bus", None, "unplug")
    assert twin_stack.wait_until(lambda: twin_stack.state() == "stopped", 10.0)
    assert fault.is_on
    assert twin_stack.status()["control"]["cause"] == "servo_bus_lost"
    fault.clear()
    assert not fault.is_on


def test_the_robot_in_lock_step_stops_without_its_servo_bus(twin, faults):
    faults.inject("servo_bus", None, "unplug")
    twin.lockstep.run_for(1.0)
    assert twin.status()["cause"] == "servo_bus_lost"
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
        timeout=170,
        check=False,
    )


@pytest.mark.gl
@pytest.mark.timeout(120)
def test_the_example_of_the_page_runs_and_an_unknown_choice_is_refused_by_name(
    tmp_path: Path,
) -> None:
    example = PAGE.read_text().split("```python\n")[1].split("```")[0]
    (tmp_path / "test_mine.py").write_text(example)
    (tmp_path / "test_mistaken.py").write_text(MISTAKEN)
    done = run_pytest(tmp_path, "--strict-markers")
    assert "2 passed, 1 error" in done.stdout, done.stdout
    assert "expected robot, world, seed, profile, speech by name, got 'sed'" in done.stdout


@pytest.mark.gl
@pytest.mark.stack
@pytest.mark.timeout(240)
def test_faults_reach_the_twin_that_the_test_uses(tmp_path: Path) -> None:
    (tmp_path / "test_mine.py").write_text(FAULTY)
    done = run_pytest(tmp_path)
    assert "2 passed" in done.stdout, done.stdout


@pytest.fixture
def devices_dir(tmp_path: Path) -> Iterator[Path]:
    """A twin's devices, which look like real ones."""
    run_dir = tmp_path / "run"
    run_dir.mkdir()
    clock = MonotonicClock()
    with subprocess.Popen([sys.executable, "-m", "sim_twin", "--run-dir", str(run_dir)]) as twin:
        while not (run_dir / "dev/ready").exists():
            assert twin.poll() is None
            clock.sleep_until(clock.now_ns() + 50_000_000)
        yield run_dir / "dev"
        twin.terminate()


@pytest.mark.gl
@pytest.mark.slow
@pytest.mark.stack
@pytest.mark.timeout(240)
def test_naming_a_robot_runs_the_contracts_on_its_devices(
    tmp_path: Path, devices_dir: Path
) -> None:
    words = ("--hardware", str(ROBOT_FILE), "--devices-dir", str(devices_dir))
    done = run_pytest(tmp_path, *words, "--energise")
    assert done.returncode == 0, done.stdout
    assert "28 passed" in done.stdout
    without_leave = run_pytest(tmp_path, *words, "-rs", "-k", "Torque or Power")
    assert "3 skipped" in without_leave.stdout
    assert "keep clear of the robot and add --energise" in without_leave.stdout


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (("--hardware", "nobody.toml"), "nobody.toml: (file): got no such file"),
        (("--hardware", str(ROBOT_FILE), "--devices-dir", "gone"), "gone is no folder; start a"),
        (("--energise",), "add --hardware robot.toml"),
    ],
)
def test_a_mistake_about_the_robot_is_one_clear_line_and_runs_no_test(
    tmp_path: Path, words: tuple[str, ...], complaint: str
) -> None:
    done = run_pytest(tmp_path, *words)
    assert done.returncode == pytest.ExitCode.USAGE_ERROR
    assert complaint in done.stderr
    assert done.stderr.strip().count("\n") == 0
