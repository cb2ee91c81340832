"""Run the real processes on the wall clock, and end them in every way they may end."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import psutil
import pytest

from platforms import load_profile
from sim_twin.referee import ask

pytestmark = [pytest.mark.gl, pytest.mark.stack, pytest.mark.timeout(180)]

VLA_DEPLOY = [sys.executable, "-m", "vla_deploy.cli.main"]
STANDSTILL_RAD_S = 0.02
MOVING_RAD_S = 1.0
DRIVE = "go to the kitchen"


def eventually(condition: Callable[[], object], timeout_s: float = 30.0) -> bool:
    until_ns = time.monotonic_ns() + round(timeout_s * 1e9)
    while not condition():
        if time.monotonic_ns() > until_ns:
            return False
        time.sleep(0.02)
    return True


class Run:
    """Hold one `vla-deploy run --twin` and talk to it as a user does."""

    def __init__(self, base: Path) -> None:
        self.base = base
        self.process = subprocess.Popen(
            self._words("run", "--twin"), stdout=subprocess.PIPE, text=True, start_new_session=True
        )

    def wait_until_armed(self) -> None:
        told = iter(self.process.stdout.readline, "")
        assert any(line.startswith("ready;") for line in told), "the run ended before it was ready"
        self.run_dir = (self.base / "current").resolve()
        self.shared_memory = (self.run_dir / "ipc").resolve()
        assert eventually(lambda: self.state() == "armed")

    def _words(self, *words: str) -> list[str]:
        return [*VLA_DEPLOY, "--runtime-base", str(self.base), *words]

    def ask(self, *words: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            self._words(*words), capture_output=True, text=True, timeout=90, check=False
        )

    def begin(self, *words: str) -> "subprocess.Popen[str]":
        pipe = subprocess.PIPE
        return subprocess.Popen(self._words(*words), stdout=pipe, stderr=pipe, text=True)

    def status(self) -> dict:
        return json.loads(self.ask("status", "--json").stdout)

    def state(self) -> str:
        return (self.status()["control"] or {"state": "silent"})["state"]

    def row(self, name: str) -> dict:
        return next(
            row for row in self.status()["process_table"]["processes"] if row["name"] == name
        )

    def fastest_rad_s(self) -> float:
        joints = ask(self.run_dir, "truth")["joints"]
        return max(abs(joint["velocity"]) for joint in joints.values())

    def drive(self) -> "subprocess.Popen[str]":
        saying = self.begin("say", DRIVE)
        assert eventually(lambda: self.fastest_rad_s() > MOVING_RAD_S)
        return saying

    def members(self) -> list[psutil.Process]:
        """Return every process that carries the run's id, the supervisor's descendants or not."""
        return [one for one in psutil.process_iter() if _belongs(one, self.run_dir.name)]

    def end(self) -> None:
        if self.process.poll() is None:
            os.killpg(self.process.pid, signal.SIGTERM)
        self.process.wait(60)
        self.process.stdout.close()


def _belongs(process: psutil.Process, run_id: str) -> bool:
    try:
        alive = process.status() != psutil.STATUS_ZOMBIE
        return alive and process.environ().get("VLA_DEPLOY_RUN_ID") == run_id
    except (psutil.NoSuchProcess, psutil.AccessDenied):
        return False


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Callable[[], Run]]:
    runs: list[Run] = []

    def begin() -> Run:
        runs.append(Run(tmp_path / "base"))
        runs[-1].wait_until_armed()
        return runs[-1]

    yield begin
    for run in runs:
        run.end()


@pytest.fixture
def run(start: Callable[[], Run]) -> Run:
    return start()


def one_line(done: "subprocess.CompletedProcess[str]") -> str:
    assert done.returncode == 2, done
    assert done.stderr.count("\n") == 1, done.stderr
    return done.stderr


def test_a_session_from_the_first_command_to_ctrl_c(run: Run) -> None:
    said = run.ask("say", "turn left 20 degrees")
    assert said.returncode == 0, said
    assert said.stdout.startswith("plan: turn")
    assert "executor     ready" in run.ask("status").stdout

    saying = run.drive()
    assert run.ask("estop").returncode == 0
    assert eventually(lambda: run.fastest_rad_s() < STANDSTILL_RAD_S, 5.0)
    _, complaint = saying.communicate(timeout=30)
    assert saying.returncode == 1
    assert "estop" in complaint
    assert "vla-deploy reset" in one_line(run.ask("say", "turn left"))

    assert run.ask("reset").stdout == "control: disarmed\n"
    assert "vla-deploy arm" in one_line(run.ask("say", "turn left"))
    assert run.ask("arm").stdout == "control: armed\n"

    saying = run.drive()
    assert run.ask("stop").stdout == "stopped; the robot is ready\n"
    assert eventually(lambda: run.fastest_rad_s() < STANDSTILL_RAD_S, 5.0)
    saying.communicate(timeout=30)
    assert saying.returncode == 1

    os.killpg(run.process.pid, signal.SIGINT)
    assert run.process.wait(30) == 0
    assert run.members() == []
    assert not run.shared_memory.exists()
    assert [path.name for path in run.base.iterdir()] == ["lock"]


def test_bad_requests_are_one_line_each_and_lose_nothing(run: Run, tmp_path: Path) -> None:
    plan = tmp_path / "plan.json"
    plan.write_text('{"goal": "x", "actions": [{"id": "a", "skill": "fly", "parameters": {}}]}')
    complaints = {
        ("say", "go to the moon"): 'I do not know the place "the moon"; I know: ',
        ("say", "pick up the dinosaur"): 'I do not know the object "the dinosaur"; I can handle: ',
        ("say", "colourless green ideas"): 'I do not understand "colourless green ideas"; try: ',
        ("say", ""): 'I do not understand ""; try: ',
        ("say", "--plan", str(plan)): 'the plan was refused: action "a": unknown skill "fly"',
        ("say", "--plan", str(tmp_path / "none.json")): "No such file or directory",
        ("run", "--twin"): f"a supervisor already runs in {run.base} (pid {run.process.pid}",
    }
    for words, complaint in complaints.items():
        assert complaint in one_line(run.ask(*words))
    assert run.state() == "armed"
    assert [row["restarts"] for row in run.status()["process_table"]["processes"]] == [0] * 5


def test_kill_9_of_control_stops_the_robot_and_leaves_it_disarmed(run: Run) -> None:
    profile = load_profile("desktop")
    saying = run.drive()
    os.kill(run.row("control")["pid"], signal.SIGKILL)
    # Physics runs on the wall clock here: allow a busy machine some time to ask.
    limit_s = max(profile.bus_watchdog_s, profile.can_heartbeat_s) + 1.5
    assert eventually(lambda: run.fastest_rad_s() < STANDSTILL_RAD_S, limit_s)
    _, complaint = saying.communicate(timeout=60)
    assert saying.returncode == 1, complaint
    assert eventually(lambda: run.row("control")["restarts"] == 1)
    assert eventually(lambda: run.state() == "disarmed")
    assert run.fastest_rad_s() < STANDSTILL_RAD_S
    assert "vla-deploy arm" in one_line(run.ask("say", "turn left"))
    assert run.ask("arm").returncode == 0
    assert run.ask("say", "turn left 20 degrees").returncode == 0


def test_kill_9_of_the_executor_tells_the_command_as_lost(run: Run) -> None:
    saying = run.begin("say", "--json", DRIVE)
    assert eventually(lambda: run.fastest_rad_s() > MOVING_RAD_S)
    os.kill(run.row("executor")["pid"], signal.SIGKILL)
    assert eventually(lambda: run.fastest_rad_s() < STANDSTILL_RAD_S, 5.0)
    told, complaint = saying.communicate(timeout=30)
    assert saying.returncode == 1
    assert complaint.startswith("vla-deploy: lost: the executor ")
    assert [action["status"] for action in json.loads(told)["actions"]] == ["lost"]
    assert eventually(lambda: run.row("executor")["state"] == "ready")
    assert run.ask("say", "turn left 20 degrees").returncode == 0


def test_kill_9_of_the_supervisor_ends_everything_and_a_new_run_starts(
    start: Callable[[], Run],
) -> None:
    run = start()
    saying = run.drive()
    run.process.kill()
    assert eventually(lambda: not run.members(), 5.0)
    saying.communicate(timeout=30)
    assert saying.returncode == 1
    assert "no robot runs in" in one_line(run.ask("status"))
    assert start().ask("say", "turn left 20 degrees").returncode == 0
    assert not run.run_dir.exists()
    assert not run.shared_memory.exists()


def test_without_opengl_the_run_says_what_to_install_and_stops_again(tmp_path: Path) -> None:
    base = tmp_path / "base"
    done = subprocess.run(
        [*VLA_DEPLOY, "--runtime-base", str(base), "run", "--twin"],
        env={**os.environ, "__EGL_VENDOR_LIBRARY_FILENAMES": "/nonexistent", "MUJOCO_GL": "bogus"},
        capture_output=True,
        text=True,
        timeout=90,
        check=False,
    )
    assert "apt-get install -y libegl1 libgl1-mesa-dri libopengl0" in one_line(done)
    assert [path.name for path in base.iterdir()] == ["lock"]


def test_without_hardware_the_run_names_the_device_and_the_robot_file(tmp_path: Path) -> None:
    base = tmp_path / "base"
    done = subprocess.run(
        [*VLA_DEPLOY, "--runtime-base", str(base), "run"],
        capture_output=True,
        text=True,
        timeout=90,
        check=False,
    )
    assert one_line(done).startswith("vla-deploy: control did not start: /dev/serial/")
    assert [path.name for path in base.iterdir()] == ["lock"]
