"""Let the twin answer in time on a busy machine: real hardware never waits for a processor."""

import os
from enum import Enum

FIFO_PRIORITY = 50
NICENESS = -10


class Priority(Enum):
    """Name what the machine granted."""

    FIFO = "fifo"
    NICE = "nice"
    ORDINARY = "ordinary"


def claim_priority() -> Priority:
    """Ask for real-time scheduling, else for a lower niceness; children do not inherit the former.

    The loop sleeps between steps, so it cannot hold a core; an unprivileged user gets neither.
    """
    parameters = os.sched_param(FIFO_PRIORITY)
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, parameters)
    except PermissionError:
        return _claim_niceness()
    return Priority.FIFO


def _claim_niceness() -> Priority:
    try:
        os.setpriority(os.PRIO_PROCESS, 0, NICENESS)
    except PermissionError:
        return Priority.ORDINARY
    return Priority.NICE
