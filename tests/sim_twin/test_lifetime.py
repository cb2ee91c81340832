import subprocess
import sys

import pytest

CHILD = """
import signal, sys
from sim_twin.lifetime import die_with_parent
die_with_parent(int(sys.argv[1]))
print("alive", flush=True)
signal.pause()
"""
PARENT = """
import os, subprocess, sys
child = subprocess.Popen([sys.executable, "-c", sys.argv[1], str(os.getpid())])
print(child.pid, flush=True)
child.wait()
"""


@pytest.mark.stack
def test_a_child_ends_when_its_parent_is_killed() -> None:
    command = [sys.executable, "-c", PARENT, CHILD]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as parent:
        assert parent.stdout is not None
        parent.stdout.readline()
        assert parent.stdout.readline() == b"alive\n"
        parent.kill()
        # The child holds the other end of this pipe: its end is the end of the pipe.
        assert parent.stdout.read() == b""


@pytest.mark.stack
def test_a_parent_that_is_already_gone_ends_the_child_at_once() -> None:
    ended = subprocess.run(
        [sys.executable, "-c", CHILD, "999999999"], capture_output=True, text=True, check=False
    )
    assert ended.returncode == 1
    assert "parent 999999999 has ended before its child was ready" in ended.stderr
