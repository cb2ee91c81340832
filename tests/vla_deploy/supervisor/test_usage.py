import os
import subprocess
import sys

import psutil
import pytest

from drivers.clock import NS_PER_S
from vla_deploy.supervisor.usage import UsageMeter

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
        usage = UsageMeter(0).sample({"a": family.pid}, NS_PER_S)["a"]
        alone_mb = psutil.Process(family.pid).memory_info().rss / 1e6
        family.communicate(b"\n", timeout=10)
    assert usage.cpu_ratio >= 0.29
    assert usage.rss_mb > 1.5 * alone_mb


def test_memory_is_proportional_and_rss_stands_in_where_that_is_forbidden(monkeypatch):
    meter = UsageMeter(0)
    allowed = meter.sample({"a": os.getpid()}, NS_PER_S)["a"]
    assert allowed.memory_mb < allowed.rss_mb
    assert meter.memory_kind == "pss"

    def forbidden(process: psutil.Process) -> None:
        raise psutil.AccessDenied(process.pid)

    monkeypatch.setattr(psutil.Process, "memory_full_info", forbidden)
    denied = meter.sample({"a": os.getpid()}, NS_PER_S)["a"]
    assert denied.memory_mb == denied.rss_mb
    assert meter.memory_kind == "rss"


def test_a_process_that_has_ended_is_left_out():
    child = subprocess.Popen([sys.executable, "-c", ""])
    child.wait(timeout=20)
    assert UsageMeter(0).sample({"a": child.pid}, NS_PER_S) == {}
