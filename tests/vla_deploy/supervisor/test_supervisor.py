"""Supervise real, tiny processes."""

import os
import signal
import subprocess
from pathlib import Path

import psutil
import pytest

from platforms import ProfileError, load_profile
from vla_deploy.supervisor.errors import AlreadyRunning, DeviceAbsent, StartCrashed, StartFailed
from vla_deploy.supervisor.runs.runtime import running

pytestmark = pytest.mark.stack

RUN_FOREVER = """
import sys
from pathlib import Path
from vla_deploy.supervisor.runs.options import RunOptions
from vla_deploy.supervisor.supervisor import Supervisor
from vla_deploy.supervisor.table import ProcessSpec
child, events, base = sys.argv[1:]
table = tuple(
    ProcessSpec(
        name=name,
        command=(child, "{run_dir}", name, events, behaviour),
        ready_files=(f"ready/{name}",),
    )
    for name, behaviour in (("a", "run"), ("b", "family"))
)
with Supervisor(RunOptions(runtime_base=Path(base)), table) as supervisor:
    supervisor.start()
    print("ready", flush=True)
    supervisor.run_until_stopped()
"""


def test_processes_start_and_stop_in_order_and_leave_nothing(stage):
    with stage.supervisor(stage.row("a"), stage.row("b"), stage.row("c")) as supervisor:
        supervisor.start()
        assert stage.events() == ["a started", "b started", "c started"]
        assert (stage.base / "current").resolve() == supervisor.run_dir
        assert (supervisor.run_dir / "ipc").resolve().parent == Path("/dev/shm")
    stops = [f"{name} {what}" for name in "cba" for what in ("asked to stop", "stopped")]
    assert stage.events()[3:] == stops
    assert stage.leftovers() == []


def test_a_killed_process_is_restarted_and_the_table_says_so(stage, step_until, rows):
    with stage.supervisor(stage.row("a"), stage.row("b")) as supervisor:
        supervisor.start()
        os.kill(stage.pids("a")[0], signal.SIGKILL)
        assert step_until(supervisor, lambda: rows(supervisor)["a"]["restarts"] == 1)
        assert step_until(supervisor, lambda: rows(supervisor)["a"]["state"] == "ready")
        row = rows(supervisor)["a"]
        assert (row["pid"], row["exit_code"]) == (stage.pids("a")[1], -9)
        assert len(stage.pids("b")) == 1


def test_the_table_reports_memory_and_cpu_of_every_process(stage, step_until):
    with stage.supervisor(stage.row("a")) as supervisor:
        supervisor.start()
        reader = supervisor.space.cell_reader("process_table")
        assert step_until(
            supervisor,
            lambda: reader.latest().document()["processes"][0]["memory_mb"] is not None,
        )
        document = reader.latest().document()
    child, own = document["processes"][0], document["supervisor"]
    assert 1 < child["memory_mb"] <= child["rss_mb"] < 200
    assert 0 < child["cpu_ratio"] < 1.5
    assert document["peak_memory_mb"] >= child["memory_mb"] + own["memory_mb"] - 1
    assert document["memory_kind"] in {"pss", "rss"}
    assert document["supervisor_pid"] == os.getpid()


def test_a_process_that_keeps_crashing_fails_the_start(stage):
    supervisor = stage.supervisor(stage.row("a"), stage.row("b", "crash"), stage.row("c"))
    with pytest.raises(StartCrashed, match=r"b did not start: exit code 3; given up after 4 fail"):
        supervisor.start()
    assert stage.events().count("b started") == 4
    assert "c started" not in stage.events()
    assert stage.events()[-1] == "a stopped"
    assert stage.leftovers() == []


def test_a_refusal_fails_the_start_at_once_with_the_process_own_words(stage):
    with pytest.raises(StartFailed, match=r"^b did not start: robot\.toml: servo 3") as refusal:
        stage.supervisor(stage.row("a"), stage.row("b", "refuse")).start()
    assert refusal.type is StartFailed
    assert stage.events().count("b started") == 1


def test_an_absent_device_fails_the_start_after_several_tries_with_the_process_own_words(stage):
    with pytest.raises(DeviceAbsent, match=r"^b did not start: servos: /dev/ttyUSB0 does not"):
        stage.supervisor(stage.row("a"), stage.row("b", "unwired")).start()
    assert stage.events().count("b started") == 4


def test_a_device_that_appears_late_only_delays_the_start(stage, rows):
    with stage.supervisor(stage.row("a", "wired-later")) as supervisor:
        supervisor.start()
        row = rows(supervisor)["a"]
    assert (row["state"], row["restarts"], row["exit_code"]) == ("ready", 1, 4)


def test_a_process_that_never_gets_ready_fails_the_start(stage):
    row = stage.row("a", "never-ready", ready_timeout_s=0.1)
    with pytest.raises(StartCrashed, match=r"not ready within 0\.1 s"):
        stage.supervisor(row).start()


def test_a_process_that_the_computer_cannot_start_fails_alone_and_is_tried_again(
    stage, caplog, step_until, rows
):
    with stage.supervisor(stage.row("a"), stage.row("b")) as supervisor:
        supervisor.start()
        output = supervisor.run_dir / "logs" / "b.out"
        output.unlink()
        table = supervisor.space.cell_reader("process_table")
        told = table.latest().sequence
        assert step_until(supervisor, lambda: table.latest().sequence > told)
        output.mkdir()  # nothing can be written there
        os.kill(stage.pids("b")[0], signal.SIGKILL)
        assert step_until(
            supervisor,
            lambda: "could not be started" in rows(supervisor)["b"]["reason"],
        )
        output.rmdir()
        assert step_until(supervisor, lambda: rows(supervisor)["b"]["state"] == "ready")
        assert rows(supervisor)["a"]["restarts"] == 0
    assert "b: back-off (could not be started: [Errno 21] Is a directory" in caplog.text


def test_a_stubborn_process_is_killed_after_its_stop_timeout(stage):
    with stage.supervisor(stage.row("a", "stubborn", stop_timeout_s=0.2)) as supervisor:
        supervisor.start()
    assert stage.events() == ["a started", "a asked to stop"]
    assert not psutil.pid_exists(stage.pids("a")[0])


def test_what_a_process_started_itself_in_its_group_ends_with_it(
    stage, tmp_path, eventually, is_running
):
    script = tmp_path / "parent.py"
    script.write_text(
        "import subprocess, sys, pathlib, time\n"
        "child = subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(60)'])\n"
        "pathlib.Path(sys.argv[1]).write_text(str(child.pid))\n"
        "time.sleep(60)\n"
    )
    told = tmp_path / "pid"
    row = stage.row("a")
    row = type(row)(name="a", command=(str(script), str(told)), ready_files=("../../pid",))
    with stage.supervisor(row) as supervisor:
        supervisor.start()
        pid = int(told.read_text())
    assert eventually(lambda: not is_running(pid))


def test_a_child_has_its_nice_and_its_threads_from_its_start(stage):
    # It sets nothing itself: a large program that is loading must not delay the others.
    with stage.supervisor(stage.row("dashboard"), stage.row("a")) as supervisor:
        supervisor.start()
        (nice,) = stage.pids("dashboard")
        (usual,) = stage.pids("a")
        wanted = load_profile("desktop").processes["dashboard"]
        own_nice = os.getpriority(os.PRIO_PROCESS, 0)
        assert wanted.nice > 0
        assert os.getpriority(os.PRIO_PROCESS, nice) == max(wanted.nice, own_nice)
        assert psutil.Process(nice).environ()["OMP_NUM_THREADS"] == str(wanted.threads)
        assert os.getpriority(os.PRIO_PROCESS, usual) == own_nice
        own = os.environ.get("OMP_NUM_THREADS")
        assert psutil.Process(usual).environ().get("OMP_NUM_THREADS") == own


def test_a_second_supervisor_is_refused_with_who_and_what_to_do(stage):
    with stage.supervisor(stage.row("a")) as supervisor:
        supervisor.start()
        with pytest.raises(AlreadyRunning, match=rf"pid {os.getpid()}, run .*vla-deploy shutdown"):
            stage.supervisor(stage.row("b")).start()
        assert running(stage.base).run_dir == str(supervisor.run_dir)
    assert running(stage.base) is None
    assert stage.events() == ["a started", "a asked to stop", "a stopped"]


def test_arming_is_asked_for_once_everything_is_ready(stage):
    with stage.supervisor(stage.row("a"), arm=True) as supervisor:
        supervisor.start()
        (event,) = supervisor.space.ring_reader("operator", from_start=True).drain()
    assert event.payload["act"] == "arm"


def test_a_broken_profile_starts_nothing(stage):
    with pytest.raises(ProfileError):
        stage.supervisor(stage.row("a"), profile="no-such").start()
    assert stage.events() == []
    assert not stage.base.exists()


def test_a_run_under_another_than_the_chosen_profile_says_so_loudly(stage, caplog):
    fault = "the chosen profile mine.toml does not load: it is gone"
    with stage.supervisor(stage.row("a"), profile_fault=fault) as supervisor:
        supervisor.start()
    (told,) = (record for record in caplog.records if record.levelname == "ERROR")
    assert told.getMessage() == f"{fault}; the run takes desktop"


def test_sigterm_ends_the_run_in_order(stage, python):
    supervisor = start_supervisor(stage, python)
    supervisor.terminate()
    assert supervisor.wait(timeout=20) == 0
    assert stage.events()[-2:] == ["a asked to stop", "a stopped"]
    assert stage.leftovers() == []


def test_who_ends_the_run_in_order_switches_the_robot_off(stage):
    with stage.supervisor(stage.row("a", "witness")) as supervisor:
        supervisor.start()
        supervisor.request_stop()
        supervisor.run_until_stopped()
    assert stage.events()[-2:] == ["a lets go", "a stopped"]


def test_a_run_that_fails_lets_no_arm_go(stage):
    def fail() -> None:
        with stage.supervisor(stage.row("a", "witness")) as supervisor:
            supervisor.start()
            raise RuntimeError("no space left")

    with pytest.raises(RuntimeError):
        fail()
    assert stage.events()[-2:] == ["a holds", "a stopped"]


def test_a_start_that_fails_lets_no_arm_go(stage):
    with pytest.raises(StartFailed):
        stage.supervisor(stage.row("a", "witness"), stage.row("b", "refuse")).start()
    assert stage.events()[-2:] == ["a holds", "a stopped"]


def test_a_run_whose_folder_is_gone_still_ends(stage, caplog):
    with stage.supervisor(stage.row("a")) as supervisor:
        supervisor.start()
        supervisor.run_dir.rename(supervisor.run_dir.with_name("elsewhere"))
    assert "arms keep holding" in caplog.text


def test_kill_9_of_the_supervisor_ends_its_children_and_the_next_start_sweeps_the_rest(
    stage, python, eventually, is_running
):
    supervisor = start_supervisor(stage, python)
    (a,), (b,), (grandchild,) = (stage.pids(name) for name in ("a", "b", "grandchild"))
    supervisor.kill()
    assert eventually(lambda: running(stage.base) is None, 3.0)  # also while nobody has reaped it
    supervisor.wait(timeout=10)
    assert eventually(lambda: not is_running(a) and not is_running(b), 3.0)
    assert is_running(grandchild)
    assert running(stage.base) is None
    assert len(stage.leftovers()) == 3  # the run, `current`, the shared memory
    with stage.supervisor(stage.row("c")) as later:
        later.start()
        assert not is_running(grandchild)
    assert stage.leftovers() == []


def start_supervisor(stage, python) -> subprocess.Popen:
    child = str(Path(__file__).with_name("child.py"))
    arguments = [child, str(stage.events_path), str(stage.base)]
    supervisor = subprocess.Popen(
        [python, "-c", RUN_FOREVER, *arguments], stdout=subprocess.PIPE, text=True
    )
    with supervisor.stdout:
        assert supervisor.stdout.readline() == "ready\n"
    return supervisor


def test_the_batterys_gauge_is_one_of_the_devices_that_are_replaced(stage, step_until, tmp_path):
    gauge = tmp_path / "dev/sys/class/power_supply/BAT0"
    gauge.mkdir(parents=True)
    for name, text in {"type": "Battery", "status": "Discharging", "capacity": "63"}.items():
        (gauge / name).write_text(text)
    with stage.supervisor(stage.row("a"), devices_dir=tmp_path / "dev") as supervisor:
        supervisor.start()
        cell = supervisor.space.cell_reader("battery")
        assert step_until(supervisor, lambda: cell.latest() is not None)
        told = cell.latest().document()
        assert (told["charge_ratio"], told["is_charging"]) == (0.63, False)
        assert (
            "there is no /sys/class/power_supply/BAT0/voltage_now" in told["missing"]["voltage_v"]
        )
