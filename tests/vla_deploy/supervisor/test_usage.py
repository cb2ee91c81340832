import os
import subprocess
import sys
from dataclasses import replace

import psutil
import pytest

from drivers.clock import NS_PER_S
from vla_deploy.supervisor.processes import usage
from vla_deploy.supervisor.processes.usage import ProcessStat, UsageMeter

BURN = "import time\nwhile time.process_time() < 0.3: pass\nprint('done', flush=True)\ninput()"


@pytest.fixture
def burnt():
    """Start processes that have used 0.3 s of CPU and wait."""
    children = []

    def start() -> int:
        child = subprocess.Popen(
            [sys.executable, "-c", BURN], stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )
        children.append(child)
        child.stdout.readline()
        return child.pid

    yield start
    for child in children:
        child.communicate(b"\n", timeout=10)


@pytest.mark.stack
def test_cpu_counts_over_the_run_and_all_restarts(burnt):
    meter = UsageMeter(0)
    first = meter.sample({"a": burnt()}, NS_PER_S)["a"].cpu_ratio
    assert 0.29 <= first < 0.6
    both = meter.sample({"a": burnt()}, 2 * NS_PER_S)["a"].cpu_ratio
    assert 0.29 <= both < 0.6


@pytest.mark.stack
def test_the_peak_is_kept_of_all_processes_together(burnt):
    meter, pids = UsageMeter(0), {"a": burnt(), "b": burnt()}
    both = meter.sample(pids, NS_PER_S)
    assert meter.peak_memory_mb == both["a"].memory_mb + both["b"].memory_mb
    peak = meter.peak_memory_mb
    meter.sample({"a": pids["a"]}, NS_PER_S)
    assert meter.peak_memory_mb == peak


@pytest.mark.stack
def test_what_a_process_started_itself_counts_as_its_own():
    script = (
        "import subprocess, sys;"
        "subprocess.Popen([sys.executable, '-c', sys.argv[1]], start_new_session=True).wait()"
    )
    with subprocess.Popen(
        [sys.executable, "-c", script, BURN], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as family:
        family.stdout.readline()
        measured = UsageMeter(0).sample({"a": family.pid}, NS_PER_S)["a"]
        alone_mb = psutil.Process(family.pid).memory_info().rss / 1e6
        family.communicate(b"\n", timeout=10)
    assert measured.cpu_ratio >= 0.29
    assert measured.rss_mb > 1.5 * alone_mb


def test_memory_is_proportional_and_rss_stands_in_where_that_is_forbidden(monkeypatch):
    def forbidden(pid: int) -> None:
        raise PermissionError(pid)

    meter = UsageMeter(0)
    waiting = "print(flush=True); input()"
    with subprocess.Popen(
        [sys.executable, "-c", waiting], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as child:
        child.stdout.readline()
        allowed = meter.sample({"a": child.pid}, NS_PER_S)["a"]
        assert allowed.memory_mb < allowed.rss_mb
        assert meter.memory_kind == "pss"
        monkeypatch.setattr(usage, "read_pss_bytes", forbidden)
        denied = meter.sample({"a": child.pid}, NS_PER_S)["a"]
        child.communicate(b"\n", timeout=10)
    assert denied.memory_mb == denied.rss_mb
    assert meter.memory_kind == "rss"


def test_a_process_that_has_ended_is_left_out():
    child = subprocess.Popen([sys.executable, "-c", ""])
    child.wait(timeout=20)
    assert UsageMeter(0).sample({"a": child.pid}, NS_PER_S) == {}


def test_memory_is_measured_in_turns_and_at_once_where_it_has_changed(monkeypatch):
    rss_mb = {1: 50.0, 2: 50.0, 3: 50.0}
    asked: list[int] = []

    def stat(pid: int) -> ProcessStat:
        return ProcessStat(
            pid=pid,
            parent=os.getpid(),
            ended=False,
            start_ticks=7,
            cpu_s=0.0,
            rss_bytes=round(rss_mb[pid] * 1e6),
        )

    def pss_bytes(pid: int) -> int:
        asked.append(pid)
        return round(rss_mb[pid] * 0.5e6)

    monkeypatch.setattr(usage, "read_stat", stat)
    monkeypatch.setattr(usage, "read_pss_bytes", pss_bytes)
    own = replace(stat(1), pid=os.getpid(), parent=0)
    monkeypatch.setattr(
        usage, "read_all_stats", lambda: {own.pid: own, **{pid: stat(pid) for pid in rss_mb}}
    )
    meter, pids = UsageMeter(0), {"a": 1, "b": 2, "c": 3}
    asked_each = []
    for second in range(1, 5):
        asked.clear()
        measured = meter.sample(pids, second * NS_PER_S)
        asked_each.append(list(asked))
    assert asked_each == [[1, 2, 3], [1], [2], [3]]
    assert {each.memory_mb for each in measured.values()} == {25.0}
    rss_mb[3] = 52.0
    assert meter.sample(pids, 5 * NS_PER_S)["c"].memory_mb == 27.0
    rss_mb[3] = 60.0
    assert meter.sample(pids, 6 * NS_PER_S)["c"].memory_mb == 30.0
