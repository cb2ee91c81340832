"""Become another Python program that gets SIGTERM when the supervisor ends, however it ends.

Run as a script, `launch.py SUPERVISOR_PID NICE PYTHON COMMAND...`: so it works for every program,
and no Python code runs between fork and exec of a threaded process.
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
    # An aborted process writes its traceback; core files of this size would fill the disk.
    resource.setrlimit(resource.RLIMIT_CORE, (0, resource.getrlimit(resource.RLIMIT_CORE)[1]))
    # A large program loads for seconds and must not delay the others. A lower nice than the
    # supervisor's may be forbidden: the program asks for that itself, and logs a refusal.
    os.setpriority(os.PRIO_PROCESS, 0, max(nice, os.getpriority(os.PRIO_PROCESS, 0)))
    os.execv(program[0], program)


if __name__ == "__main__":
    main()
