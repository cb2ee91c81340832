import errno
import os
import threading
from collections.abc import Mapping

import pytest

from drivers.clock import MonotonicClock
from platforms.probes import Reading
from vla_deploy.supervisor.budgets import BackgroundSampler
from vla_deploy.supervisor.processes import usage
from vla_deploy.supervisor.processes.usage import read_all_stats

HEAT = Reading(name="temperature_c", value=50.0, unit="degC", reason="")


class Board:
    """Fail in the first rounds as a test says, then measure; `enough` is set in the seventh."""

    def __init__(self, *errors: Exception) -> None:
        self.errors = [*errors]
        self.rounds = 0
        self.closed = threading.Event()
        self.enough = threading.Event()

    def read(self) -> Mapping[str, Reading]:
        self.rounds += 1
        if self.errors:
            raise self.errors.pop(0)
        if self.rounds >= 7:
            self.enough.set()
        return {HEAT.name: HEAT}

    def close(self) -> None:
        self.closed.set()


@pytest.fixture
def board() -> Board:
    return Board(
        OSError(errno.EMFILE, os.strerror(errno.EMFILE)),
        OSError(errno.EMFILE, os.strerror(errno.EMFILE)),
        ValueError("no number"),
    )


def test_a_round_that_fails_is_logged_and_counted_and_the_next_one_is_tried(board, caplog):
    sampler = BackgroundSampler(lambda: board, MonotonicClock(), MonotonicClock(), period_s=0.001)
    assert board.enough.wait(10.0)
    sampler.close()
    newest = sampler.latest()
    assert newest is not None
    assert newest.readings == {HEAT.name: HEAT}
    assert sampler.failures == 3
    told = [record.message for record in caplog.records]
    assert len(told) == 2
    assert "Too many open files" in told[0]
    assert board.closed.wait(10.0)  # `close` itself waits for two periods


def test_a_late_reader_gets_every_round(board):
    board.errors.clear()
    sampler = BackgroundSampler(lambda: board, MonotonicClock(), MonotonicClock(), period_s=0.001)
    assert board.enough.wait(10.0)
    sampler.close()
    every = sampler.since(0)
    assert len(every) >= 3
    assert sampler.since(every[0].stamp_ns) == every[1:]


def test_processes_that_may_not_be_known_are_left_out(monkeypatch):
    known = usage.read_stat

    def guarded(pid: int) -> usage.ProcessStat | None:
        if pid != os.getpid():
            raise PermissionError(errno.EPERM, os.strerror(errno.EPERM))
        return known(pid)

    monkeypatch.setattr(usage, "read_stat", guarded)
    assert read_all_stats().keys() == {os.getpid()}
