"""A stalled core is detected by a real-time thread."""

import os
import subprocess
import sys

import pytest

from sim_twin.campaigns.switching.host_stalls import PRIORITY, HostStallMonitor

STALL_S = 0.06
ABOVE = f"""
import os, time
os.sched_setaffinity(0, {{0}})
os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param({PRIORITY + 1}))
end_s = time.monotonic() + {STALL_S}
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
def test_a_core_that_stands_still_is_noticed() -> None:
    monitor = HostStallMonitor()
    try:
        monitor.stalls()  # it has begun to look by now
        subprocess.run([sys.executable, "-c", ABOVE], check=True)
        assert max(stall.seconds for stall in monitor.stalls()) > STALL_S / 2
    finally:
        monitor.close()
