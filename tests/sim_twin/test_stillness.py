"""A core that does nothing for anybody is noticed from above whatever runs on it."""

import os
import subprocess
import sys

import pytest

from sim_twin.stillness import FINE_STEP_S, HELD_UP_S, PRIORITY, STEP_S, StillnessWatch

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
