import json
import os
import subprocess
import sys

import pytest

CHILD = """
import json, os, resource, sys
from sim_twin.priority import claim_priority  # while whose home it is in may be read
if sys.argv[1] == "limited":
    resource.setrlimit(resource.RLIMIT_RTPRIO, (0, 0))
    resource.setrlimit(resource.RLIMIT_NICE, (0, 0))
    os.setgid(65534)
    os.setuid(65534)
got = claim_priority()
print(json.dumps([got.value, os.sched_getscheduler(0) & 7, os.getpriority(os.PRIO_PROCESS, 0)]))
pid = os.fork()
if pid == 0:
    print(json.dumps(os.sched_getscheduler(0) & 7), flush=True)
    os._exit(0)
os.waitpid(pid, 0)
"""


def claim(mode: str) -> tuple[str, int, int, int]:
    """Return the grant, policy and niceness of a claiming process, and its child's policy."""
    command = [sys.executable, "-u", "-c", CHILD, mode]
    answer = subprocess.run(command, capture_output=True, text=True, check=True)
    (value, policy, niceness), childs_policy = map(json.loads, answer.stdout.splitlines())
    return value, policy, niceness, childs_policy


@pytest.mark.stack
@pytest.mark.skipif(os.geteuid() != 0, reason="needs the right to real-time scheduling")
def test_a_privileged_twin_is_preferred_and_its_children_are_not_in_real_time() -> None:
    value, policy, niceness, childs_policy = claim("privileged")
    assert (value, policy) == ("fifo", os.SCHED_FIFO) or (value, niceness) == ("nice", -10)
    assert childs_policy == os.SCHED_OTHER


@pytest.mark.stack
@pytest.mark.skipif(os.geteuid() != 0, reason="needs root, to give it up")
def test_an_unprivileged_twin_runs_all_the_same() -> None:
    value, policy, niceness, _ = claim("limited")
    assert (value, policy) == ("ordinary", os.SCHED_OTHER)
    assert niceness >= 0
