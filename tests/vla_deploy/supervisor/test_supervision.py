"""Let tiny processes freeze, hang, crash and be unwanted; look what the supervisor does."""

import json
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest

from drivers.clock import NS_PER_S
from vla_deploy.ipc import topics
from vla_deploy.supervisor.errors import ProcessGivenUp
from vla_deploy.supervisor.runs.runtime import running
from vla_deploy.supervisor.supervisor import Supervisor
from vla_deploy.supervisor.systemd import NotifyTarget
from vla_deploy.supervisor.table import GivingUp, Watched, twin_only

pytestmark = pytest.mark.stack

BEATING = (Watched(topic="base_state", silence_limit_s=0.5),)


def reports(stage) -> list[dict]:
    return [
        json.loads(path.read_text()) for path in sorted((stage.state_dir / "crashes").iterdir())
    ]


def test_a_frozen_process_is_ended_by_its_data_and_started_again(
    stage, step_until, rows, is_running
):
    with stage.supervisor(stage.row("a", "base", watched=BEATING)) as supervisor:
        supervisor.start()
        first = stage.pids("a")[0]
        os.kill(first, signal.SIGSTOP)
        assert step_until(supervisor, lambda: len(stage.pids("a")) == 2)
        assert step_until(supervisor, lambda: rows(supervisor)["a"]["state"] == "ready")
        assert not is_running(first)
        assert rows(supervisor)["a"]["restarts"] == 1
    (report,) = reports(stage)
    assert report["reason"].startswith("base_state silent for 0.")
    assert (report["process"], report["pid"], report["signal"]) == ("a", first, "SIGABRT")
    traceback = "\n".join(report["traceback"])
    assert "Current thread" in traceback  # of the main thread itself: another reads what changes
    assert "beating.py" in traceback
    assert report["topics"]["base_state"]["age_s"] > 0.5


def test_a_process_that_ignores_its_abortion_is_killed_a_second_later(stage, step_until):
    row = stage.row("a", "abort-deaf", watched=BEATING)
    with stage.supervisor(row) as supervisor:
        supervisor.start()
        assert step_until(supervisor, lambda: len(stage.pids("a")) == 2)
    assert reports(stage)[0]["signal"] == "SIGKILL"


def test_a_crash_is_reported_with_its_traceback_run_and_uptime(stage, step_until):
    row = stage.row("a", "crash-later")
    with stage.supervisor(row) as supervisor:
        supervisor.start()
        run_id = supervisor.run_dir.name
        assert step_until(supervisor, lambda: len(stage.pids("a")) == 2)
    report = reports(stage)[0]
    assert (report["exit_code"], report["signal"]) == (1, None)
    assert report["traceback"][-1] == "KeyError: 'elbow'"
    assert (report["run_id"], report["robot"], report["profile"]) == (run_id, "butler", "desktop")
    assert 0.3 <= report["uptime_s"] < 30
    assert report["given_up"] is False


def test_the_row_says_what_giving_up_means_the_run_ends(stage):
    row = stage.row("a", "crash-later", giving_up=GivingUp.END_RUN)
    with stage.supervisor(row) as supervisor:
        supervisor.start()
        with pytest.raises(ProcessGivenUp, match=r"^a was given up: exit code 1; given up after 4"):
            supervisor.run_until_stopped()
    assert [report["given_up"] for report in reports(stage)] == [False, False, False, True]


def test_the_row_says_what_giving_up_means_commands_are_refused(stage, step_until, rows):
    row = stage.row("a", "crash-later", giving_up=GivingUp.NO_COMMANDS)
    with stage.supervisor(row, stage.row("b")) as supervisor:
        supervisor.start()
        plans = supervisor.space.ring_reader("plan", from_start=True)
        table = supervisor.space.cell_reader("process_table")
        assert step_until(supervisor, lambda: table.latest().document()["refusal"] != "")
        assert table.latest().document()["refusal"].startswith("a was given up: exit code 1")
        assert [event.payload["cancel"] for event in plans.drain()] == [True]
        assert rows(supervisor)["b"]["state"] == "ready"


def test_the_row_says_what_giving_up_means_the_others_carry_on(stage, step_until, rows):
    row = stage.row("a", "crash", giving_up=GivingUp.CARRY_ON)
    with stage.supervisor(stage.row("b"), row) as supervisor:
        supervisor.start()
        assert step_until(supervisor, lambda: rows(supervisor)["a"]["state"] == "given up")
        document = supervisor.space.cell_reader("process_table").latest().document()
        assert document["refusal"] == ""
        assert rows(supervisor)["b"]["state"] == "ready"


def test_what_the_run_does_not_want_is_not_started_and_says_why(stage, rows):
    with stage.supervisor(stage.row("a", when=twin_only), stage.row("b")) as supervisor:
        supervisor.start()
        supervisor.step()
        row = rows(supervisor)["a"]
    assert (row["state"], row["reason"]) == ("off", "the run has no twin")
    assert "a started" not in stage.events()


def test_what_a_killed_process_has_moved_out_of_its_group_ends_with_it(
    stage, step_until, is_running
):
    with stage.supervisor(stage.row("b", "family")) as supervisor:
        supervisor.start()
        (grandchild,) = stage.pids("grandchild")
        assert os.getsid(grandchild) == grandchild
        os.kill(stage.pids("b")[0], signal.SIGKILL)
        assert step_until(supervisor, lambda: not is_running(grandchild))
        assert step_until(supervisor, lambda: len(stage.pids("grandchild")) == 2)
    assert not any(is_running(pid) for pid in stage.pids("grandchild"))


def test_the_logs_of_an_ended_run_are_kept(stage):
    with stage.supervisor(stage.row("a")) as supervisor:
        supervisor.start()
        run_id = supervisor.run_dir.name
    (kept,) = (stage.state_dir / "runs").iterdir()
    assert kept.name == f"000001-{run_id}"
    lines = [json.loads(line) for line in (kept / "supervisor.log").read_text().splitlines()]
    assert [line["message"] for line in lines] == [
        f"a: {state}" for state in ("starting", "ready", "stopping", "stopped")
    ]
    assert {(line["process"], line["run"], line["robot"]) for line in lines} == {
        ("supervisor", run_id, "butler")
    }


class Systemd:
    def __init__(self, path: Path) -> None:
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.bind(str(path))
        self.socket.setblocking(False)
        self.target = NotifyTarget(address=str(path), watchdog_ns=NS_PER_S // 2)
        self.heard: list[str] = []

    def listen(self) -> list[str]:
        fresh = []
        while True:
            try:
                fresh.append(self.socket.recv(4096).decode())
            except BlockingIOError:
                self.heard += fresh
                return fresh


@pytest.fixture
def systemd(tmp_path: Path) -> Iterator[Systemd]:
    listening = Systemd(tmp_path / "notify")
    yield listening
    listening.socket.close()


def feeds(systemd: Systemd, supervisor: Supervisor, step_until) -> bool:
    systemd.listen()
    return step_until(supervisor, lambda: "WATCHDOG=1" in systemd.listen())


def starves(systemd: Systemd, supervisor: Supervisor, step_until, words: str) -> bool:
    """Wait until the status names the trouble; then no food comes for three intervals."""

    def told() -> bool:
        return any(text.startswith("STATUS=") and words in text for text in systemd.listen())

    assert step_until(supervisor, told)
    until_ns = supervisor.clock.now_ns() + 3 * NS_PER_S // 2
    step_until(supervisor, lambda: supervisor.clock.now_ns() > until_ns)
    return "WATCHDOG=1" not in systemd.listen()


def test_systemd_is_told_of_start_health_and_stop(stage, systemd, step_until):
    row = stage.row("control", "control")
    with stage.supervisor(row, notify=systemd.target) as supervisor:
        supervisor.start()
        systemd.listen()
        assert "READY=1" in systemd.heard
        assert "EXTEND_TIMEOUT_USEC=15000000" in systemd.heard
        assert feeds(systemd, supervisor, step_until)
    systemd.listen()
    assert systemd.heard.count("READY=1") == systemd.heard.count("STOPPING=1") == 1


@pytest.mark.parametrize(
    ("file", "words"),
    [("bus-lost", "bus servos: too many answers"), ("safety-silent", "ticks were not judged")],
)
def test_the_watchdog_starves_while_a_bus_is_lost_or_safety_is_silent(
    stage, systemd, step_until, file, words
):
    with stage.supervisor(stage.row("control", "control"), notify=systemd.target) as supervisor:
        supervisor.start()
        assert feeds(systemd, supervisor, step_until)
        trouble = supervisor.run_dir / file
        trouble.touch()
        assert starves(systemd, supervisor, step_until, words)
        trouble.unlink()
        assert feeds(systemd, supervisor, step_until)


def test_the_watchdog_starves_while_control_is_frozen(stage, systemd, step_until):
    with stage.supervisor(stage.row("control", "control"), notify=systemd.target) as supervisor:
        supervisor.start()
        assert feeds(systemd, supervisor, step_until)
        (pid,) = stage.pids("control")
        os.kill(pid, signal.SIGSTOP)
        assert starves(systemd, supervisor, step_until, "control: control_status: age")
        os.kill(pid, signal.SIGCONT)
        assert feeds(systemd, supervisor, step_until)


def test_children_know_nothing_of_systemd(stage, monkeypatch, step_until):
    monkeypatch.setenv("NOTIFY_SOCKET", "/nowhere")
    monkeypatch.setenv("WATCHDOG_USEC", "1000000")
    with stage.supervisor(stage.row("a"), notify=NotifyTarget()) as supervisor:
        supervisor.start()
        environment = psutil.Process(stage.pids("a")[0]).environ()
        assert not {"NOTIFY_SOCKET", "WATCHDOG_USEC", "WATCHDOG_PID"} & environment.keys()
        assert environment["VLA_DEPLOY_RUN_ID"] == supervisor.run_dir.name


HELD = """
import sys
from pathlib import Path
from vla_deploy.supervisor.runs.options import RunOptions
from vla_deploy.supervisor.supervisor import Supervisor
from vla_deploy.supervisor.table import ProcessSpec
child, events, base, last = sys.argv[1:]
table = tuple(
    ProcessSpec(
        name=name,
        command=(child, "{run_dir}", name, events, behaviour),
        ready_files=(f"ready/{name}",),
        stop_timeout_s=60.0,
    )
    for name, behaviour in (("a", "run"), ("b", last))
)
with Supervisor(RunOptions(runtime_base=Path(base)), table) as supervisor:
    supervisor.start()
    supervisor.run_until_stopped()
"""


@pytest.mark.parametrize(
    ("last", "moment"), [("never-ready", "b started"), ("stubborn", "b asked to stop")]
)
def test_kill_9_of_the_supervisor_while_it_starts_or_stops_leaves_nothing_for_long(
    stage, eventually, last, moment, is_running
):
    child = str(Path(__file__).with_name("child.py"))
    words = [sys.executable, "-c", HELD, child, str(stage.events_path), str(stage.base), last]
    with subprocess.Popen(words) as supervisor:
        assert eventually(lambda: "b started" in stage.events(), 20.0)
        if moment != "b started":
            assert eventually(lambda: (stage.base / "current" / "ready" / "b").exists())
            supervisor.terminate()
            assert eventually(lambda: moment in stage.events())
        supervisor.kill()
    assert running(stage.base) is None
    with stage.supervisor(stage.row("c")) as later:
        later.start()
        assert not any(is_running(pid) for name in "ab" for pid in stage.pids(name))
    assert stage.leftovers() == []
    assert len(list((stage.state_dir / "runs").iterdir())) == 2


def test_what_the_robot_does_is_said_by_the_supervisor_whatever_dies(stage, step_until):
    with stage.supervisor(stage.row("a", "base", watched=BEATING)) as supervisor:
        supervisor.start()
        activity = supervisor.space.cell_reader(topics.ACTIVITY)

        def says_stopped(after: int) -> bool:
            sample = activity.latest()
            if sample is None or sample.sequence <= after:
                return False
            told = sample.document()
            return (told["activity"], told["stopped_by"]) == ("stopped", "control is silent")

        assert step_until(supervisor, lambda: says_stopped(0))
        os.kill(stage.pids("a")[0], signal.SIGKILL)
        before = activity.latest()
        assert before.writer_pid == os.getpid()
        assert step_until(supervisor, lambda: says_stopped(before.sequence))
