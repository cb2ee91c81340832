"""Run the real processes on the twin's time, and end them in every way they may end."""

import json
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from platforms import load_profile
from sim_twin.harness.processes import ProcessStack
from vla_deploy.runtime.exit_codes import EXIT_CONFIGURATION, EXIT_DEVICE_ABSENT

pytestmark = [pytest.mark.gl, pytest.mark.stack, pytest.mark.timeout(300)]

VLA_DEPLOY = [sys.executable, "-m", "vla_deploy.cli"]
STANDSTILL_RAD_S = 0.02
MOVING_RAD_S = 1.0
DRIVE = "go to the kitchen"


class Run(ProcessStack):
    def drive(self) -> "subprocess.Popen[str]":
        saying = self.begin("say", DRIVE)
        moves = self.wait_until(lambda: self.fastest_rad_s() > MOVING_RAD_S)
        assert moves, (saying.poll(), self.status())
        return saying


class Runs:
    """Hold the run of the test before for the next one, as long as it is as good as new."""

    def __init__(self, base: Path, profile: str) -> None:
        self._base = base
        self._profile = profile
        self._run: Run | None = None

    def start(self, *options: str) -> Run:
        """Start a run where there was one, which is cut off unless it has ended."""
        self.end()
        self._run = Run(self._base, "--fast", "--profile", self._profile, *options)
        self._run.wait_until_armed()
        return self._run

    def current(self) -> Run:
        return self._run if self._run is not None and is_as_new(self._run) else self.start()

    def end(self) -> None:
        if self._run is None:
            return
        if self._run.process.poll() is None:
            self._run.cut()
        else:  # what it left behind is the next one's to find
            self._run.close()


def is_as_new(run: Run) -> bool:
    return run.process.poll() is None and run.state() == "armed" and run.is_ready()


@pytest.fixture(scope="module")
def runs(coarse: str) -> Iterator[Runs]:
    with tempfile.TemporaryDirectory(prefix="vla-") as folder:  # sockets want a short path
        runs = Runs(Path(folder) / "base", coarse)
        yield runs
        runs.end()


@pytest.fixture
def run(runs: Runs) -> Run:
    return runs.current()


@pytest.fixture
def base() -> Iterator[Path]:
    with tempfile.TemporaryDirectory(prefix="vla-") as folder:
        yield Path(folder) / "base"


def one_line(done: "subprocess.CompletedProcess[str]", code: int = EXIT_CONFIGURATION) -> str:
    assert done.returncode == code, done
    assert done.stderr.count("\n") == 1, done.stderr
    return done.stderr


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
        ("profile", "tune", "--out", str(plan)): "expected a new file that ends in .toml",
        ("run", "--twin"): f"a supervisor already runs in {run.base} (pid {run.process.pid}",
    }
    pids = run.pids()
    for words, complaint in complaints.items():
        assert complaint in one_line(run.ask(*words))
    assert run.state() == "armed"
    assert run.pids() == pids


def test_kill_9_of_control_stops_the_robot_and_leaves_it_disarmed(run: Run, coarse: str) -> None:
    profile = load_profile(coarse)
    pid = run.row("control")["pid"]
    saying = run.drive()
    run.kill("control")
    # What drives still has to come to rest after its watchdog has tripped.
    limit_s = max(profile.bus_watchdog_s, profile.can_heartbeat_s) + 1.5
    assert run.wait_until(lambda: run.fastest_rad_s() < STANDSTILL_RAD_S, limit_s)
    _, complaint = saying.communicate(timeout=60)
    assert saying.returncode == 1, complaint
    assert run.is_back("control", pid)
    assert run.wait_until(lambda: run.state() == "disarmed")
    assert run.fastest_rad_s() < STANDSTILL_RAD_S
    assert "vla-deploy arm" in one_line(run.ask("say", "turn left"))
    assert run.ask("arm").returncode == 0
    assert run.ask("say", "turn left 20 degrees").returncode == 0


def test_kill_9_of_the_executor_tells_the_command_as_lost(run: Run) -> None:
    pid = run.row("executor")["pid"]
    saying = run.begin("say", "--json", DRIVE)
    assert run.wait_until(lambda: run.fastest_rad_s() > MOVING_RAD_S)
    run.kill("executor")
    assert run.wait_until(lambda: run.fastest_rad_s() < STANDSTILL_RAD_S, 5.0)
    told, complaint = saying.communicate(timeout=30)
    assert saying.returncode == 1
    assert complaint.startswith("vla-deploy: lost: the executor ")
    assert [action["status"] for action in json.loads(told)["actions"]] == ["lost"]
    assert run.is_back("executor", pid)
    assert run.ask("say", "turn left 20 degrees").returncode == 0


def stops_with(run: Run, *causes: str) -> bool:
    def is_stopped() -> bool:
        control = run.document("control_status")
        return bool(control) and control["state"] == "stopped" and control["cause"] in causes

    return run.wait_until(is_stopped, 10.0)


def drives_again(run: Run) -> bool:
    # What a device says after its return may take a second to be believed; and the bus of one that
    # has just come up may be lost once more to a slow computer, which wants both again.
    acts = ("reset", "arm")
    assert run.wait_until(lambda: all(run.ask(act).returncode == 0 for act in acts), 30.0)
    return run.ask("say", "turn left 20 degrees").returncode == 0


def test_kill_9_of_the_twin_stops_control_until_another_twin_is_armed(run: Run) -> None:
    pids = run.pids()
    saying = run.drive()
    run.kill("twin")
    assert stops_with(run, "estop", "servo_bus_lost", "can_bus_lost")
    saying.communicate(timeout=30)
    assert saying.returncode == 1
    assert run.is_back("twin", pids["twin"])
    assert run.row("control")["pid"] == pids["control"]
    assert run.state() == "stopped"
    assert drives_again(run)


@pytest.mark.parametrize("name", ["executor", "planner"])
def test_a_mission_goes_on_when_what_carries_it_out_is_killed(run: Run, name: str) -> None:
    pid = run.row(name)["pid"]
    saying = run.begin("say", "turn left 120 degrees; look left; turn right 20 degrees")
    assert run.wait_until(lambda: run.fastest_rad_s() > MOVING_RAD_S)
    run.kill(name)
    assert run.is_back(name, pid)
    told, _ = saying.communicate(timeout=90)
    assert saying.returncode == 0, told
    mission = json.loads(run.ask("mission", "list", "--json").stdout)["missions"][0]
    assert mission["state"] == "completed"
    tries = [one["tries"] for one in mission["subtasks"].values()]
    assert tries == [2 if name == "executor" else 1, 1, 1]


@pytest.mark.slow
def test_a_frozen_twin_stops_control_and_is_started_again_by_its_silence(run: Run) -> None:
    pids = run.pids()
    saying = run.drive()
    run.freeze("twin")
    assert stops_with(run, "servo_bus_lost")
    assert "every servo" in run.status()["control"]["detail"]
    saying.communicate(timeout=30)
    assert saying.returncode == 1
    assert run.is_back("twin", pids["twin"])
    assert "twin_status silent for 10" in run.ask("crashes", "show").stdout
    assert run.state() == "stopped"
    assert drives_again(run)
    assert run.row("control")["pid"] == pids["control"]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["control", "perception", "planner", "executor"])
def test_a_frozen_process_rests_the_robot_and_is_started_again(run: Run, name: str) -> None:
    pid = run.row(name)["pid"]
    saying = run.drive()
    run.freeze(name)
    if name in ("control", "executor"):
        assert run.wait_until(lambda: run.fastest_rad_s() < STANDSTILL_RAD_S, 5.0)
    assert run.is_back(name, pid)
    assert f"{name} (pid" in run.ask("crashes", "show").stdout
    run.ask("stop")
    saying.communicate(timeout=60)
    if name == "control":
        assert run.wait_until(lambda: run.ask("arm").returncode == 0, 20.0)
    assert run.wait_until(lambda: run.ask("say", "turn left 20 degrees").returncode == 0, 40.0)


@pytest.mark.slow
def test_a_frozen_supervisor_stops_the_robot_and_goes_on_when_it_is_continued(run: Run) -> None:
    saying = run.drive()
    pids = run.pids()
    run.process.send_signal(signal.SIGSTOP)
    assert run.wait_until(lambda: run.fastest_rad_s() < STANDSTILL_RAD_S, 10.0)
    assert stops_with(run, "supervisor_lost")
    saying.communicate(timeout=60)
    assert saying.returncode == 1
    run.process.send_signal(signal.SIGCONT)
    assert drives_again(run)
    assert run.pids() == pids
    assert "was held up for" in run.ask("logs", "supervisor", "--level", "warning").stdout


def test_kill_9_of_the_supervisor_ends_everything_and_a_new_run_starts(
    runs: Runs,
) -> None:
    run = runs.current()
    shared_memory = (run.run_dir / "ipc").resolve()
    saying = run.drive()
    run.process.kill()
    assert run.wait_until(lambda: not run.members(), 5.0)
    saying.communicate(timeout=30)
    assert saying.returncode == 1
    assert "no robot runs in" in one_line(run.ask("status"))
    fresh = runs.start()
    assert fresh.wait_until(lambda: fresh.ask("say", "turn left 20 degrees").returncode == 0)
    assert not run.run_dir.exists()
    assert not shared_memory.exists()


def test_a_session_from_the_first_command_to_ctrl_c(run: Run) -> None:
    shared_memory = (run.run_dir / "ipc").resolve()
    said = run.ask("say", "turn left 20 degrees")
    assert said.returncode == 0, said
    assert said.stdout.startswith("plan: turn")
    assert "executor     ready" in run.ask("status").stdout
    seen = json.loads(run.ask("profile", "measure", "--minutes", "0.05", "--json").stdout)
    assert seen["processes"].keys() >= {"control", "perception", "supervisor"}
    assert seen["rates"]["control_rate_hz"]["reached_hz"] > 0

    saying = run.drive()
    assert run.ask("estop").returncode == 0
    assert run.wait_until(lambda: run.fastest_rad_s() < STANDSTILL_RAD_S, 5.0)
    _, complaint = saying.communicate(timeout=30)
    assert saying.returncode == 1
    assert "estop" in complaint
    assert "vla-deploy reset" in one_line(run.ask("say", "turn left"))

    assert run.ask("reset").stdout == "control: disarmed\n"
    assert "vla-deploy arm" in one_line(run.ask("say", "turn left"))
    assert run.ask("arm").stdout == "control: armed\n"

    assert run.ask("stop").stdout == "stopped; the robot is ready\n"

    os.killpg(run.process.pid, signal.SIGINT)
    assert run.process.wait(30) == 0
    assert run.members() == []
    assert not shared_memory.exists()
    assert {path.name for path in run.base.iterdir()} == {"lock", "trends"}  # of this boot


@pytest.mark.slow
def test_a_robot_on_paced_buses_arms_and_drives(runs: Runs) -> None:
    run = runs.start("--paced")
    assert run.ask("say", "move forward 0.3 meters").returncode == 0
    assert run.state() == "armed"


def test_without_opengl_the_run_says_what_to_install_and_stops_again(base: Path) -> None:
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


def test_without_hardware_the_run_names_the_device_and_the_robot_file(base: Path) -> None:
    done = subprocess.run(
        [*VLA_DEPLOY, "--runtime-base", str(base), "run"],
        capture_output=True,
        text=True,
        timeout=90,
        check=False,
    )
    told = one_line(done, EXIT_DEVICE_ABSENT)
    assert told.startswith("vla-deploy: control did not start: /dev/serial/")
    assert [path.name for path in base.iterdir()] == ["lock"]
