"""Become another Python program that gets SIGTERM when the supervisor ends, however it ends.

Run as a script, `launch.py SUPERVISOR_PID NICE PYTHON COMMAND...`, before the program: so it holds
for programs that know nothing of it, and no Python code runs between fork and exec of a threaded
process.
"""

import ctypes
import os
import resource
import signal
import sys

_PR_SET_PDEATHSIG = 1


def main() -> None:
    """Ask the kernel for the signal, then replace this program by the wanted one."""
    supervisor_pid, nice, program = int(sys.argv[1]), int(sys.argv[2]), sys.argv[3:]
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM, 0, 0, 0)
    if os.getppid() != supervisor_pid:  # it died before the request was in place
        sys.exit(f"the supervisor, pid {supervisor_pid}, has already ended")
    # What an aborted process tells is its traceback; cores of this size would fill the disk.
    resource.setrlimit(resource.RLIMIT_CORE, (0, resource.getrlimit(resource.RLIMIT_CORE)[1]))
    # To load a large program takes seconds, in which it is in the way of what matters more. Less
    # than the supervisor's own may be forbidden: the program asks for that itself, and tells if so.
    os.setpriority(os.PRIO_PROCESS, 0, max(nice, os.getpriority(os.PRIO_PROCESS, 0)))
    os.execv(program[0], program)


if __name__ == "__main__":
    main()
