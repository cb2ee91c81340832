"""The runner treats a service as systemd does: by its notifications, its silence and its exit."""

import os
import signal
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace

import psutil
import pytest

from drivers.clock import NS_PER_S, MonotonicClock
from sim_twin.contracts.scripted import ManualClock
from sim_twin.harness.service_runner import RunnerState, ServiceRules, ServiceRunner

# A service whose words are those of the product's own notifier.
SERVICE = """
import os, signal, subprocess, sys, time
mode = sys.argv[1]
if mode.isdecimal():
    sys.exit(int(mode))
if mode == "someone else":
    say = "import os, socket; to = os.environ['NOTIFY_SOCKET']; "
    say += "socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM).sendto(b'READY=1', to)"
    subprocess.run([sys.executable, "-c", say], check=True)
    time.sleep(60)
from drivers.clock import MonotonicClock
from vla_deploy.supervisor.systemd import Notifier, own_target
clock, stop, troubles = MonotonicClock(), [], ()
notifier = Notifier(own_target(), clock)
signal.signal(signal.SIGTERM, lambda *_: stop.append(1))
if mode == "child":
    # Until its interpreter has begun a child's environment reads empty.
    begun = "import time; print(flush=True); time.sleep(60)"
    command = [sys.executable, "-c", begun]
    child = subprocess.Popen(command, stdout=subprocess.PIPE, start_new_session=True)
    child.stdout.readline()
begin_ns = clock.now_ns()
while not stop:
    if mode == "in trouble" and clock.now_ns() - begin_ns > 4e8:
        troubles = ("control is late",)
    notifier.step(ready=True, stopping=False, status="at work", troubles=troubles)
    clock.sleep_until(clock.now_ns() + 20_000_000)
notifier.stopping()
"""
QUICK = ServiceRules(
    watchdog_s=1.0, restart_s=0.05, abort_timeout_s=0.3, settle_s=0.1, start_timeout_s=20.0
)
Launch = Callable[..., ServiceRunner]

pytestmark = pytest.mark.stack


@pytest.fixture
def launch() -> Iterator[Launch]:
    runners = []

    def start(
        mode: str, rules: ServiceRules = QUICK, clock: ManualClock | None = None
    ) -> ServiceRunner:
        runner = ServiceRunner([sys.executable, "-c", SERVICE, mode], os.environ, rules, clock)
        runners.append(runner)
        runner.start()
        return runner

    yield start
    for runner in runners:
        runner.stop()
        assert not runner.members()


def test_a_service_is_ready_when_its_main_process_says_so(launch: Launch) -> None:
    runner = launch("good")
    assert runner.wait_for(RunnerState.READY, 20)
    clock = MonotonicClock()
    deadline_ns = clock.now_ns() + 5 * NS_PER_S
    while runner.report.status != "at work" and clock.now_ns() < deadline_ns:  # a datagram later
        clock.sleep_until(clock.now_ns() + NS_PER_S // 50)
    assert (runner.report.status, runner.report.restarts) == ("at work", 0)
    runner.stop()
    assert (runner.state, runner.report.exit_code) == (RunnerState.INACTIVE, 0)


def test_a_killed_or_frozen_service_is_started_again(launch: Launch) -> None:
    runner = launch("good")
    for restarts, number in enumerate((signal.SIGKILL, signal.SIGSTOP), start=1):
        assert runner.wait_for(RunnerState.READY, 20)
        before = runner.report.main_pid
        os.kill(before, number)
        assert runner.wait_for(RunnerState.RESTARTING, 10)
        assert runner.wait_for(RunnerState.READY, 20)
        assert runner.report.main_pid != before
        assert runner.report.restarts == restarts
    assert runner.report.watchdog_kills == 1


def test_a_service_in_trouble_does_not_feed_and_is_started_again(launch: Launch) -> None:
    runner = launch("in trouble")
    assert runner.wait_for(RunnerState.RESTARTING, 20)
    assert runner.report.watchdog_kills == 1


def test_a_service_on_the_twins_time_is_judged_by_it(launch: Launch) -> None:
    clock = ManualClock()
    runner = launch("in trouble", clock=clock)  # it feeds for 0.4 s of the wall clock
    assert runner.wait_for(RunnerState.READY, 20)
    assert not runner.wait_for(RunnerState.RESTARTING, 2)
    clock.ns += 1_100_000_000
    assert runner.wait_for(RunnerState.RESTARTING, 20)
    assert runner.report.watchdog_kills == 1


@pytest.mark.parametrize("code", [1, 4], ids=["crashed", "device absent"])
def test_a_service_that_ends_at_once_is_tried_again_and_given_up(launch: Launch, code: int) -> None:
    runner = launch(str(code), ServiceRules(watchdog_s=1.0, restart_s=0.01, start_limit_burst=3))
    assert runner.wait_for(RunnerState.FAILED, 20)
    assert (runner.report.restarts, runner.report.exit_code) == (3, code)


def test_a_wrong_configuration_is_not_tried_again(launch: Launch) -> None:
    runner = launch("2")
    assert runner.wait_for(RunnerState.FAILED, 20)
    assert (runner.report.restarts, runner.report.exit_code) == (0, 2)


def test_only_the_main_process_may_say_that_it_is_ready(launch: Launch) -> None:
    rules = replace(QUICK, start_timeout_s=1.5)
    runner = launch("someone else", rules)
    assert not runner.wait_for(RunnerState.READY, 2.0)
    assert runner.report.watchdog_kills == 0


def test_nothing_of_a_killed_service_is_left(launch: Launch) -> None:
    runner = launch("child")
    assert runner.wait_for(RunnerState.READY, 20)
    child = next(one for one in runner.members() if one.pid != runner.report.main_pid)
    os.kill(runner.report.main_pid, signal.SIGKILL)
    psutil.wait_procs([child], timeout=10)
    assert not child.is_running()
