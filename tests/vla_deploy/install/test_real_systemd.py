"""The unit does under a real systemd what it says."""

import json
import os
import shlex
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from vla_deploy.cli.main import main
from vla_deploy.install.building import LAUNCHER
from vla_deploy.install.releases import ReleaseStore

pytestmark = [pytest.mark.stack, pytest.mark.timeout(150)]
TRIAL = "/opt/vla-deploy/trial"
PROGRAM = "/opt/vla-deploy/current/bin/vla-deploy"
QUICK = "etc/systemd/system/vla-deploy.service.d/quick.conf"
UNIT = "vla-deploy.service"
# Comes to rest half a second after it was told to stop, as control does, and says so.
CHILD = """
import signal, sys, time
def come_to_rest(*_):
    time.sleep(0.5)
    tell("at rest;")
    sys.exit()
def tell(words):
    with open("/var/log/vla-deploy/child", "a") as note:
        note.write(words)
signal.signal(signal.SIGTERM, come_to_rest)
tell("at work;")
time.sleep(99)
"""
# A main process with the product's own notifier, and a child that ends as control does.
TINY = f"""
import ctypes, signal, subprocess, sys
from drivers.clock import MonotonicClock
from vla_deploy.supervisor.systemd import Notifier, own_target
def end_with_me():
    ctypes.CDLL(None).prctl(1, 15)
clock, stop = MonotonicClock(), []
notifier = Notifier(own_target(), clock)
signal.signal(signal.SIGTERM, lambda *_: stop.append(1))
child = subprocess.Popen([sys.executable, "-c", {CHILD!r}], preexec_fn=end_with_me)
while not stop:
    notifier.step(ready=True, stopping=False, status="at work", troubles=())
    clock.sleep_until(clock.now_ns() + 20_000_000)
notifier.stopping()
"""


@pytest.fixture(scope="module")
def computer(image: Path, boot: Callable[[], Any], add_environment: Callable[[Path], None]) -> Any:
    own = os.umask(0o077)  # as root has it on a hardened computer; the service is another user
    assert main(["install", "--root", str(image), "--twin"]) == 0
    os.umask(own)
    release = image / "opt/vla-deploy/releases/tiny"
    add_environment(release)
    (release / "tiny.py").write_text(TINY)
    launcher = LAUNCHER.replace('-I -m vla_deploy.cli "$@"', '"$here/../tiny.py"')
    (release / "bin/vla-deploy").write_text(launcher)
    (release / "bin/vla-deploy").chmod(0o755)
    (image / "opt/vla-deploy/current").symlink_to("releases/tiny")
    subprocess.run(
        ["systemd-sysusers", f"--root={image}", "vla-deploy.conf"], check=True, capture_output=True
    )
    # A drop-in as a person would write it, so that the test need not wait for long.
    extra = image / QUICK
    extra.parent.mkdir()
    extra.write_text("[Service]\nWatchdogSec=1\nTimeoutAbortSec=1\nRestartSec=0.2\n")
    output = "[Service]\nStandardOutput=append:/opt/service.log\n"  # no journal is running
    (image / QUICK).with_name("output.conf").write_text(output)
    computer = boot()
    up = ("running", "degraded", "starting")
    state = ("systemctl", "is-system-running")
    computer.await_that(lambda: computer.run(*state, check=False).strip() in up)
    return computer


def restarts(computer: Any) -> int:
    return int(computer.show(UNIT, "NRestarts"))


def test_the_unit_lives_by_its_rules(computer: Any) -> None:
    computer.run("systemctl", "start", UNIT)
    assert computer.show(UNIT, "ActiveState") == "active"
    assert computer.show(UNIT, "StatusText") == "at work"
    assert computer.show(UNIT, "Slice") == "vla-deploy.slice"
    pid = computer.show(UNIT, "MainPID")
    status = computer.run("cat", f"/proc/{pid}/status")
    assert "CapAmb:\t0000000000800000" in status  # CAP_SYS_NICE, nothing else
    assert "NoNewPrivs:\t1" in status
    computer.run("kill", "-STOP", pid)
    computer.await_that(lambda: restarts(computer) == 1)
    computer.await_that(lambda: computer.show(UNIT, "ActiveState") == "active")
    note = ("cat", "/var/log/vla-deploy/child")
    computer.await_that(lambda: computer.run(*note, check=False).endswith("at work;"))
    computer.run("kill", "-KILL", computer.show(UNIT, "MainPID"))
    computer.await_that(lambda: restarts(computer) == 2)
    assert "at work;at rest;" in computer.run(*note)  # nobody killed the child before
    computer.await_that(lambda: computer.show(UNIT, "ActiveState") == "active")


def test_a_release_on_trial_that_dies_is_taken_back_at_its_next_start(computer: Any) -> None:
    prefix = computer.image / "opt/vla-deploy"
    (prefix / "releases/new").symlink_to("tiny")
    store = ReleaseStore(prefix)
    store.begin_trial("new")
    store.use("new")
    computer.run("sh", "-c", f"sed -i s/^watcher=.*/watcher=1/ {TRIAL}")  # a process in there
    computer.run("systemctl", "restart", UNIT)
    assert store.current() == "new"
    computer.run("kill", "-KILL", computer.show(UNIT, "MainPID"))
    computer.await_that(lambda: store.trial() is None)
    assert store.current() == "tiny"
    assert "had to be started again" in store.last_rollback()


def test_a_service_that_keeps_failing_is_given_up(computer: Any) -> None:
    def is_given_up() -> bool:
        computer.run("systemctl", "kill", "--signal=KILL", UNIT, check=False)
        return str(computer.show(UNIT, "ActiveState")) == "failed"

    computer.await_that(is_given_up)
    assert computer.show(UNIT, "Result") in ("start-limit-hit", "signal")
    assert computer.show("vla-deploy-gave-up.service", "ExecMainStartTimestampMonotonic") != "0"


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_the_twin_comes_up_in_the_sandbox_and_stops_in_order(
    computer: Any, add_environment: Callable[[Path], None]
) -> None:
    robot = computer.image / "opt/vla-deploy/releases/robot"
    add_environment(robot)
    (robot / "bin/vla-deploy").write_text(LAUNCHER)
    (robot / "bin/vla-deploy").chmod(0o755)
    ReleaseStore(computer.image / "opt/vla-deploy").use("robot")
    # A busy test machine keeps no robot's times; what is judged here is the sandbox.
    (computer.image / QUICK).write_text("[Service]\nWatchdogSec=60\n")
    computer.run("systemctl", "daemon-reload")
    computer.run("systemctl", "reset-failed", UNIT)
    computer.run("systemctl", "restart", UNIT)
    assert computer.show(UNIT, "ActiveState") == "active"
    words = ("--runtime-base", "/run/vla-deploy", "status", "--json")
    vla_deploy = ("setpriv", "--reuid=vla-deploy", "--clear-groups", PROGRAM)
    status = json.loads(computer.run(*vla_deploy, *words))
    states = {row["name"]: row["state"] for row in status["process_table"]["processes"]}
    assert {states[name] for name in ("control", "perception", "twin")} == {"ready"}
    (robot.parent / "next").symlink_to("robot")
    chosen = ("--robot", "butler", "--profile", "desktop", "--healthy", "3", "--json")
    switch = (PROGRAM, "release", "switch", "next", *chosen)
    talk = (*vla_deploy, *words[:2])
    computer.run(*talk, "arm")
    computer.run("sh", "-c", f"{shlex.join((*talk, 'say', 'go to the kitchen'))} >/dev/null 2>&1 &")

    def is_at_work() -> bool:
        executor = json.loads(computer.run(*vla_deploy, *words))["executor"]
        return executor is not None and executor["state"] == "executing"

    computer.await_that(is_at_work)
    refused = json.loads(computer.run(*switch, check=False))
    assert refused["end"] == "refused"
    assert "skill navigate_to" in refused["failures"][0]
    computer.run(*talk, "stop")
    computer.await_that(lambda: not is_at_work())
    computer.await_that(lambda: json.loads(computer.run(*switch, check=False))["end"] == "switched")
    computer.run("systemctl", "stop", UNIT)
    assert computer.show(UNIT, "Result") == "success"
    assert "vla-deploy" not in computer.run("ls", "/run")
    assert computer.run("find", "/dev/shm", "-user", "vla-deploy") == ""
