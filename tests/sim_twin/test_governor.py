"""Time waits for members that work, not for those that cannot go on.

Run as a program, this moves time in a folder as the twin does, without any physics.
"""

import os
import select
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from drivers.clock import NS_PER_S, MonotonicClock
from drivers.twin_clock import TwinClock
from drivers.twin_page import TIME_SOCKET, Op, TimeRole, pack
from sim_twin.timing.governor import Governor
from sim_twin.timing.pacer import Pacer
from vla_deploy.runtime.executors import TwinWorker, worker_thread

MS = 1_000_000
STEP_NS = 2 * MS
WORKER = """
import os, sys
from pathlib import Path
from drivers.twin_clock import TwinClock
from drivers.twin_page import TimeRole
clock = TwinClock(Path(sys.argv[1]))
clock.join(TimeRole(name="child", order=1, patience_s=float(sys.argv[2])), os.getpid())
print("works", flush=True)
sys.stdin.read()
"""


class Metronome:
    """Advance a governor step by step until stopped."""

    def __init__(self, folder: Path, *, is_fast: bool = True) -> None:
        self.governor = Governor(folder, Pacer(MonotonicClock(), is_fast=is_fast))
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self.run, daemon=True)

    def __enter__(self) -> "Metronome":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join(10)
        self.governor.close()

    def run(self) -> None:
        governor, wait_s = self.governor, 0.0
        while not self._stop.is_set():
            ready, _, _ = select.select(governor.filenos(), [], [], wait_s)
            governor.go_round()
            if ready:
                governor.serve(set(ready))
            wait_s = 0.0 if ready else governor.go_on(governor.now_ns + STEP_NS) or 0.0


@pytest.fixture
def folder() -> Iterator[Path]:
    with tempfile.TemporaryDirectory(prefix="vla-") as path:  # sockets want a short path
        yield Path(path)


@pytest.fixture
def metronome(folder: Path) -> Iterator[Metronome]:
    with Metronome(folder) as metronome:
        yield metronome


def passes(clock: TwinClock, within_s: float = 30.0, span_ns: int = NS_PER_S) -> bool:
    """Whether time passes, beyond any slack."""
    until_ns, end_s = clock.now_ns() + span_ns, time.monotonic() + within_s
    while clock.now_ns() < until_ns and time.monotonic() < end_s:
        time.sleep(0.005)
    return clock.now_ns() >= until_ns


def in_thread(work: Callable[[], None]) -> threading.Thread:
    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    return thread


def work(folder: Path, patience_s: float = 60.0) -> "subprocess.Popen[str]":
    """Start a member that works and never waits."""
    pipe = subprocess.PIPE
    words = [sys.executable, "-c", WORKER, str(folder), str(patience_s)]
    child = subprocess.Popen(words, stdin=pipe, stdout=pipe, text=True)
    assert child.stdout is not None
    assert child.stdout.readline() == "works\n"
    return child


@pytest.fixture
def child(metronome: Metronome, folder: Path) -> Iterator["subprocess.Popen[str]"]:
    with work(folder) as child:
        yield child
        child.kill()


def test_time_goes_on_while_no_member_works(metronome: Metronome, folder: Path) -> None:
    assert passes(TwinClock(folder))


def test_time_stands_still_while_a_member_works(
    metronome: Metronome, folder: Path, child: "subprocess.Popen[str]"
) -> None:
    assert not passes(TwinClock(folder), within_s=0.3, span_ns=1)


def test_time_goes_on_by_the_slack_of_one_that_works(metronome: Metronome, folder: Path) -> None:
    clock, slack_ns = TwinClock(folder), 100 * MS
    clock.join(TimeRole(name="recorder", order=1, slack_ns=slack_ns), os.getpid())
    due_ns = clock.now_ns() + MS
    clock.sleep_until(due_ns)
    assert passes(clock, span_ns=due_ns + slack_ns - STEP_NS - clock.now_ns())
    time.sleep(0.2)
    assert clock.now_ns() - due_ns <= slack_ns


def test_a_sleep_ends_at_its_deadline_and_not_later(metronome: Metronome, folder: Path) -> None:
    clock = TwinClock(folder)
    clock.join(TimeRole(name="control", order=0), os.getpid())
    for ahead_ns in (1, STEP_NS // 3, STEP_NS, 7 * STEP_NS + 5):
        due_ns = clock.now_ns() + ahead_ns
        clock.sleep_until(due_ns)
        assert clock.now_ns() == due_ns


def test_members_that_are_due_at_once_work_one_after_the_other_in_their_order(
    folder: Path,
) -> None:
    log, names = [], ["control", "executor", "planner"]

    def step(name: str) -> None:
        clock.join(TimeRole(name=name, order=names.index(name)), os.getpid())
        clock.sleep_until(at_ns)
        for _ in range(5):
            log.append(name)
            time.sleep(0.002)
            log.append(name)
            clock.sleep_until(clock.now_ns() + 10 * MS)

    with Metronome(folder, is_fast=False):
        clock = TwinClock(folder)
        at_ns = clock.now_ns() + NS_PER_S
        threads = [in_thread(lambda name=name: step(name)) for name in reversed(names)]
        for thread in threads:
            thread.join(20)
    assert log == [name for name in names for _ in range(2)] * 5


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_one_that_is_killed_or_stopped_holds_time_no_more(
    metronome: Metronome, folder: Path, child: "subprocess.Popen[str]", number: signal.Signals
) -> None:
    child.send_signal(number)
    assert passes(TwinClock(folder))


def test_one_that_is_continued_holds_time_again(
    metronome: Metronome, folder: Path, child: "subprocess.Popen[str]"
) -> None:
    clock = TwinClock(folder)
    child.send_signal(signal.SIGSTOP)
    assert passes(clock)
    child.send_signal(signal.SIGCONT)
    assert any(not passes(clock, within_s=0.3, span_ns=1) for _ in range(50))


def test_one_that_hangs_holds_time_for_as_long_as_its_patience(
    metronome: Metronome, folder: Path, caplog: pytest.LogCaptureFixture
) -> None:
    with work(folder, patience_s=0.3) as child:
        assert passes(TwinClock(folder))
        assert "child (pid" in caplog.text
        assert "has worked for more than 0.3 s" in caplog.text
        child.kill()


def test_a_child_that_loads_holds_time_at_what_was_declared_and_begins_there(
    metronome: Metronome, folder: Path
) -> None:
    clock, role = TwinClock(folder), TimeRole(name="planner", order=3)
    clock.join(TimeRole(name="supervisor", order=9), os.getpid())
    now_ns = clock.now_ns()
    with subprocess.Popen(
        [sys.executable, "-c", "import sys; sys.stdin.read()"], stdin=-1
    ) as child:
        clock.expect(child.pid, role, 500 * MS)
        clock.sleep_until(now_ns + 499 * MS)
        begins: list[int] = []

        def begin() -> None:
            clock.join(role, child.pid)
            begins.append(clock.now_ns())

        thread = in_thread(lambda: clock.sleep_until(now_ns + 501 * MS))
        time.sleep(0.2)
        in_thread(begin)
        clock.sleep_until(now_ns + 501 * MS)
        child.kill()
        thread.join(10)
    assert begins == [now_ns + 500 * MS]


def test_a_child_that_is_quicker_than_its_announcement_does_not_freeze_time(
    metronome: Metronome, folder: Path, child: "subprocess.Popen[str]"
) -> None:
    clock = TwinClock(folder)
    child.send_signal(signal.SIGSTOP)  # one that has joined, and is waited for no more
    clock.expect(child.pid, TimeRole(name="child", order=1), 10 * MS)
    assert passes(clock)


@pytest.mark.parametrize(
    "packet", [b"x", b"\xff" * 17, pack(Op.JOIN, 1) + b"{}", pack(Op.JOIN, 1) + b"[1]"]
)
def test_an_invalid_packet_costs_only_its_sender_the_connection(
    metronome: Metronome, folder: Path, packet: bytes
) -> None:
    clock = TwinClock(folder)
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as stranger:
        stranger.connect(str(folder / TIME_SOCKET))
        stranger.send(packet)
        assert stranger.recv(1) == b""
    assert passes(clock)


def test_one_that_only_watches_holds_nothing(metronome: Metronome, folder: Path) -> None:
    clock = TwinClock(folder)
    due_ns = clock.now_ns() + 50 * MS
    clock.sleep_until(due_ns)
    assert clock.now_ns() >= due_ns
    assert passes(clock)


def test_a_governor_that_ends_disconnects_its_members_and_frees_time(folder: Path) -> None:
    with Metronome(folder):
        clock = TwinClock(folder)
        clock.join(TimeRole(name="control", order=0), os.getpid())
        assert clock.page.is_governed
    assert not clock.page.is_governed
    assert passes(clock)


def test_work_in_a_thread_is_done_when_declared_whatever_it_took(
    metronome: Metronome, folder: Path
) -> None:
    clock, took_s = TwinClock(folder), iter((0.15, 0.0))
    clock.join(TimeRole(name="perception", order=2), os.getpid())
    with worker_thread("network", clock, 0.1) as network:
        assert isinstance(network, TwinWorker)
        for _ in range(2):
            began_ns = clock.now_ns()
            future = network.submit(time.sleep, next(took_s))
            clock.sleep_until(began_ns + 99 * MS)
            assert not future.done()
            clock.sleep_until(began_ns + 100 * MS)
            assert not future.running()
            clock.sleep_until(began_ns + 101 * MS)
            assert future.done()
            assert future.result() is None


def test_work_that_fails_or_is_cancelled_says_so(metronome: Metronome, folder: Path) -> None:
    clock = TwinClock(folder)
    network = worker_thread("network", clock, 0.01)
    failed = network.submit(int, "no number")
    begun = threading.Event()
    busy = network.submit(lambda: begun.set() or time.sleep(0.2))
    begun.wait(10)
    never = network.submit(int, "1")
    network.shutdown(wait=True, cancel_futures=True)
    assert isinstance(failed.exception(), ValueError)
    assert busy.result() is None
    assert never.cancelled()
    assert passes(clock)


class Apart:
    """Move time in a process of its own."""

    def __init__(self, folder: Path) -> None:
        pipe = subprocess.PIPE
        words = [sys.executable, __file__, str(folder)]
        self.process = subprocess.Popen(words, stdin=pipe, stdout=pipe, text=True)
        assert self.process.stdout is not None
        assert self.process.stdout.readline() == "ready\n"

    def close(self) -> None:
        self.process.send_signal(signal.SIGCONT)
        self.process.kill()
        self.process.communicate()


@pytest.fixture
def apart(folder: Path) -> Iterator[Apart]:
    apart = Apart(folder)
    yield apart
    apart.close()


def slept_s(clock: TwinClock, span_s: float) -> float:
    began_s, due_ns = time.monotonic(), clock.now_ns() + round(span_s * NS_PER_S)
    clock.sleep_until(due_ns)
    assert clock.now_ns() >= due_ns
    return time.monotonic() - began_s


def test_a_clock_that_first_waits_when_the_twin_has_died_goes_by_the_wall(
    apart: Apart, folder: Path
) -> None:
    apart.process.kill()
    apart.process.wait()
    assert slept_s(TwinClock(folder), 0.2) >= 0.1


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP, signal.SIGTERM])
@pytest.mark.parametrize("joined", [True, False])
def test_a_twin_that_dies_or_is_stopped_does_not_freeze_time(
    apart: Apart, folder: Path, number: signal.Signals, joined: bool
) -> None:
    clock = TwinClock(folder)
    if joined:
        clock.join(TimeRole(name="control", order=0), os.getpid())
    slept_s(clock, 0.01)
    before_ns = clock.now_ns()
    timer = threading.Timer(0.1, apart.process.send_signal, [number])
    timer.start()
    slept_s(clock, 1.0)
    timer.join()
    assert slept_s(clock, 0.2) >= 0.15
    assert clock.now_ns() - before_ns >= 1.2 * NS_PER_S


def test_a_twin_that_is_continued_takes_time_over_where_it_is_by_then(
    apart: Apart, folder: Path
) -> None:
    clock = TwinClock(folder)
    clock.join(TimeRole(name="control", order=0), os.getpid())
    slept_s(clock, 0.01)
    apart.process.send_signal(signal.SIGSTOP)
    slept_s(clock, 0.8)
    before_ns = clock.now_ns()
    apart.process.send_signal(signal.SIGCONT)
    slept_s(clock, 0.3)
    assert clock.page.is_governed
    assert clock.now_ns() >= before_ns
    slept_s(clock, 0.01)  # it has joined again by now
    held_ns = clock.now_ns()
    time.sleep(0.2)
    assert clock.now_ns() == held_ns


def test_another_twin_takes_time_over_from_one_that_died(apart: Apart, folder: Path) -> None:
    clock = TwinClock(folder)
    clock.join(TimeRole(name="control", order=0), os.getpid())
    slept_s(clock, 0.01)
    apart.process.kill()
    slept_s(clock, 0.3)
    before_ns = clock.now_ns()
    second = Apart(folder)
    try:
        slept_s(clock, 0.1)
        assert clock.page.is_governed
        held_ns = clock.now_ns()
        assert held_ns > before_ns
        time.sleep(0.2)
        assert clock.now_ns() == held_ns
    finally:
        second.close()


if __name__ == "__main__":
    with Metronome(Path(sys.argv[1]), is_fast=False) as metronome:
        sys.stdout.write("ready\n")
        sys.stdout.flush()
        sys.stdin.read()
