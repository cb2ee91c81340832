"""Real processes stand for the kernel's workers here: the name in /proc is what makes one."""

import errno
import logging
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from drivers.clock import NS_PER_S
from sim_twin.contracts.scripted import ManualClock
from vla_deploy.supervisor.runs.serial_workers import PRIORITY, SerialWorkers

needs_real_time = pytest.mark.skipif(
    os.geteuid() != 0, reason="needs the right to real-time scheduling"
)
ORDINARY = (os.SCHED_OTHER, 0)
RAISED = (os.SCHED_FIFO, PRIORITY)


class Computer:
    """Lay out a /proc of processes that sleep, under names of the kernel's."""

    def __init__(self, proc: Path) -> None:
        self.proc = proc
        self.clock = ManualClock(NS_PER_S)
        self.started: list[subprocess.Popen[bytes]] = []
        (proc / "loadavg").write_text("0.15 0.10 0.04 1/180 2\n")
        self.workers = SerialWorkers(self.clock, proc)

    def begin(self, name: str) -> int:
        command = [sys.executable, "-c", "import time; time.sleep(600)"]
        process = subprocess.Popen(command)
        self.started.append(process)
        (self.proc / str(process.pid)).mkdir()
        self.name(process.pid, name)
        return process.pid

    def name(self, pid: int, name: str) -> None:
        (self.proc / str(pid) / "comm").write_text(f"{name}\n")

    def tell_newest(self, pid: int) -> None:
        (self.proc / "loadavg").write_text(f"0.15 0.10 0.04 1/180 {pid}\n")

    def look(self, *, wanted: bool = True, after_s: float = 1.0) -> None:
        self.clock.ns += round(after_s * NS_PER_S)
        self.workers.step(wanted=wanted)

    def close(self) -> None:
        for process in self.started:
            process.kill()
            process.wait()


@pytest.fixture
def computer(tmp_path: Path) -> Iterator[Computer]:
    (tmp_path / "self").mkdir()
    laid_out = Computer(tmp_path)
    yield laid_out
    laid_out.close()


def scheduling(pid: int) -> tuple[int, int]:
    return os.sched_getscheduler(pid), os.sched_getparam(pid).sched_priority


@needs_real_time
def test_only_workers_bound_to_no_processor_are_raised(computer: Computer) -> None:
    worker = computer.begin("kworker/u8:3-events_unbound")
    bound, flusher = computer.begin("kworker/1:1H-kblockd"), computer.begin("kswapd0")
    computer.look()
    assert scheduling(worker) == RAISED
    assert scheduling(bound) == scheduling(flusher) == ORDINARY


@needs_real_time
def test_one_that_the_kernel_makes_later_is_raised_within_a_second(computer: Computer) -> None:
    computer.look()
    worker = computer.begin("kworker/u8:4")
    computer.look(after_s=0.5)
    assert scheduling(worker) == ORDINARY
    computer.look(after_s=0.5)
    assert scheduling(worker) == RAISED


@needs_real_time
def test_one_that_the_kernel_tells_of_is_raised_at_once(computer: Computer) -> None:
    computer.look()
    worker = computer.begin("kthreadd")
    computer.tell_newest(worker)
    computer.look(after_s=0.05)
    assert scheduling(worker) == ORDINARY
    computer.name(worker, "kworker/u8:4-events_unbound")
    computer.tell_newest(worker + 1)
    computer.look(after_s=0.05)
    assert scheduling(worker) == RAISED


@needs_real_time
def test_one_that_somebody_else_has_scheduled_is_left_as_it_is(computer: Computer) -> None:
    worker = computer.begin("kworker/u8:4")
    os.sched_setscheduler(worker, os.SCHED_FIFO, os.sched_param(7))
    computer.look()
    computer.workers.close()
    assert scheduling(worker) == (os.SCHED_FIFO, 7)


@pytest.mark.parametrize(
    "end",
    [lambda computer: computer.workers.close(), lambda computer: computer.look(wanted=False)],
    ids=["run over", "profile without real time"],
)
def test_they_are_ordinary_again_in_the_end(
    computer: Computer, end: Callable[[Computer], None]
) -> None:
    worker, gone = computer.begin("kworker/u8:4"), computer.begin("kworker/u8:5")
    computer.look()
    (computer.proc / str(gone) / "comm").unlink()
    end(computer)
    assert scheduling(worker) == ORDINARY


def test_without_the_right_it_is_told_once_and_not_tried_again(
    computer: Computer, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    asked = []

    def refuse(pid: int, *_: object) -> None:
        asked.append(pid)
        raise PermissionError(errno.EPERM, "Operation not permitted")

    worker = computer.begin("kworker/u8:4")
    monkeypatch.setattr(os, "sched_setscheduler", refuse)
    with caplog.at_level(logging.INFO):
        computer.look()
        computer.begin("kworker/u8:5")
        computer.look()
    assert asked == [worker]
    assert caplog.text.count("CAP_SYS_NICE") == 1
