"""A core that does nothing for anybody is noticed from above whatever runs on it."""

import os
import subprocess
import sys

import psutil
import pytest

from sim_twin.stillness import (
    FINE_STEP_S,
    HELD_UP_S,
    PRIORITY,
    STEP_S,
    Stall,
    StillnessWatch,
    StolenTime,
    worst_together_s,
)

ABOVE = f"""
import os, time
os.sched_setaffinity(0, {{0}})
os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param({PRIORITY + 1}))
end_s = time.monotonic() + 0.06
while time.monotonic() < end_s:
    pass
"""


def may_be_real_time() -> bool:
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))
    except PermissionError:
        return False
    os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    return True


@pytest.mark.skipif(not may_be_real_time(), reason="needs CAP_SYS_NICE")
@pytest.mark.parametrize("step_s", [STEP_S, FINE_STEP_S])
def test_a_core_that_stands_still_is_told_once(step_s: float) -> None:
    watch = StillnessWatch(step_s)
    try:
        watch.worst_s()
        subprocess.run([sys.executable, "-c", ABOVE], check=True)
        assert watch.worst_s() > HELD_UP_S
        assert watch.worst_s() < 0.06
    finally:
        watch.close()


def stalls(*at: tuple[float, float]) -> list[Stall]:
    return [Stall(due_ns=round(due_s * 1e9), seconds=seconds) for due_s, seconds in at]


@pytest.mark.parametrize(
    ("found", "worst_s"),
    [
        ([], 0.0),
        (stalls((1.0, 0.012)), 0.012),
        (stalls((1.0, 0.012), (1.03, 0.015)), 0.027),
        (stalls((1.03, 0.015), (1.0, 0.012)), 0.027),  # told core by core
        (stalls((1.0, 0.012), (1.002, 0.012)), 0.014),  # both cores at once
        (stalls((1.0, 0.012), (1.06, 0.015)), 0.015),
    ],
)
def test_what_one_core_after_the_other_holds_up_adds_up(found: list[Stall], worst_s: float) -> None:
    assert worst_together_s(found) == pytest.approx(worst_s)


def test_what_the_host_took_is_a_share_of_all_cores_since_the_last_call(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    times = psutil.cpu_times()
    told = [
        times,
        times._replace(user=times.user + 6.0, idle=times.idle + 3.0, steal=times.steal + 1.0),
        # A guest's time is in the user's.
        times._replace(
            user=times.user + 8.0, guest=2.0, idle=times.idle + 3.0, steal=times.steal + 3.0
        ),
    ]
    monkeypatch.setattr(psutil, "cpu_times", lambda: told.pop(0))
    stolen = StolenTime()
    assert stolen.ratio() == pytest.approx(0.1)
    assert stolen.ratio() == pytest.approx(0.5)
