import os
import resource
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from vla_deploy.supervisor.budgets import hold_back
from vla_deploy.supervisor.budgets.hold_back import CpuHold, HoldRefused, MemoryHold

needs_nice = pytest.mark.skipif(os.geteuid() != 0, reason="only root may lower nice again")
THREADED = """
import sys, threading
threading.Thread(target=sys.stdin.read, daemon=True).start()
print("up", flush=True)
threading.Event().wait()
"""
GROWING = """
import sys
print("up", flush=True)
for line in sys.stdin:
    try:
        kept = bytearray(int(line))
    except MemoryError:
        print("refused", flush=True)
    else:
        print("granted", flush=True)
"""
MB = 1_000_000
# What is nice already, such as the tests themselves, stays so.
HELD_NICE = max(10, os.getpriority(os.PRIO_PROCESS, 0))


@pytest.fixture
def child() -> Iterator[subprocess.Popen[str]]:
    yield from _running(THREADED)


@pytest.fixture
def growing() -> Iterator[subprocess.Popen[str]]:
    yield from _running(GROWING)


def _running(code: str) -> Iterator[subprocess.Popen[str]]:
    command = [sys.executable, "-c", code]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as child:
        assert child.stdout is not None
        assert child.stdout.readline() == "up\n"
        yield child
        child.kill()


def threads(pid: int) -> list[int]:
    return [int(task.name) for task in Path(f"/proc/{pid}/task").iterdir()]


@needs_nice
def test_every_thread_of_a_cpu_hog_is_held_back_and_gets_back_what_it_had(child):
    before = os.sched_getaffinity(child.pid)
    nice = os.getpriority(os.PRIO_PROCESS, child.pid)
    hold = CpuHold.take(child.pid, cores=0.6)
    tasks = threads(child.pid)
    assert len(tasks) >= 2
    assert {os.getpriority(os.PRIO_PROCESS, task) for task in tasks} == {HELD_NICE}
    assert {len(os.sched_getaffinity(task)) for task in tasks} == {1}
    assert str(hold) == f"nice {HELD_NICE} and 1 cores"
    hold.release()
    assert {os.getpriority(os.PRIO_PROCESS, task) for task in tasks} == {nice}
    assert os.sched_getaffinity(child.pid) == before


def claims(pid: int) -> dict[int, tuple[int, frozenset[int]]]:
    return {
        task: (os.getpriority(os.PRIO_PROCESS, task), frozenset(os.sched_getaffinity(task)))
        for task in threads(pid)
    }


@needs_nice
def test_a_thread_that_put_itself_aside_gets_its_own_claim_back(child):
    aside = next(task for task in threads(child.pid) if task != child.pid)
    os.setpriority(os.PRIO_PROCESS, aside, 17)
    before = claims(child.pid)
    hold = CpuHold.take(child.pid, cores=0.6)
    assert claims(child.pid)[aside][0] == 17
    hold.release()
    assert claims(child.pid) == before


@needs_nice
def test_a_thread_that_ends_meanwhile_is_passed_over(child, monkeypatch):
    before, listed = claims(child.pid), hold_back._threads
    gone = 2**30  # no kernel gives out such an id
    monkeypatch.setattr(hold_back, "_threads", lambda pid: {gone, *listed(pid)})
    hold = CpuHold.take(child.pid, cores=0.6)
    assert {nice for nice, _ in claims(child.pid).values()} == {HELD_NICE}
    hold.release()
    assert claims(child.pid) == before


@needs_nice
def test_what_a_process_set_for_itself_meanwhile_stays(child):
    hold = CpuHold.take(child.pid, cores=0.6)
    os.setpriority(os.PRIO_PROCESS, child.pid, 18)
    hold.release()
    assert claims(child.pid)[child.pid][0] == 18


def ask(child: subprocess.Popen[str], size: int) -> str:
    assert child.stdin is not None
    assert child.stdout is not None
    child.stdin.write(f"{size}\n")
    child.stdin.flush()
    return child.stdout.readline().strip()


def test_a_memory_hog_may_grow_so_far_and_no_further_until_it_is_released(growing):
    hold = MemoryHold.take(growing.pid, growth_mb=50)
    assert ask(growing, 20 * MB) == "granted"
    assert ask(growing, 200 * MB) == "refused"
    hold.release()
    assert ask(growing, 200 * MB) == "granted"
    assert resource.prlimit(growing.pid, resource.RLIMIT_DATA) == (hold.soft, hold.hard)


def test_who_is_gone_is_not_held(child):
    child.kill()
    child.wait()
    with pytest.raises(HoldRefused, match=f"pid {child.pid}"):
        CpuHold.take(child.pid, cores=1)
    with pytest.raises(HoldRefused, match=f"pid {child.pid}"):
        MemoryHold.take(child.pid, growth_mb=1)
