"""Find the processes of a robot's runs that nobody answers for any more."""

import os
from collections.abc import Collection
from typing import Final

import psutil

from vla_deploy.runtime.logs import RUN_ID_VARIABLE
from vla_deploy.supervisor.runs.runtime import PROCESS_VARIABLE

MARK: Final = "VLA_CAMPAIGN_ROBOT"
"""The variable that tells whose robot a process belongs to, whatever its command line says."""


def strays(mark: str, run_id: str, rows: Collection[int] | None) -> list[str]:
    """Return each process of the robot `mark` that is of another run, or of no row of this one.

    `rows` are the pids of the process table; without them this run cannot be judged. A row answers
    for its process, for what descends from that, and for its session: not for what an earlier
    process of the same row has left.
    """
    told = (_stray(process, mark, run_id, rows) for process in psutil.process_iter())
    return [stray for stray in told if stray]


def _stray(process: psutil.Process, mark: str, run_id: str, rows: Collection[int] | None) -> str:
    try:
        environment = process.environ()
        its_run = environment.get(RUN_ID_VARIABLE)
        if environment.get(MARK) != mark or its_run is None:
            return ""
        if its_run != run_id:
            return f"{process.pid} of run {its_run}"
        if rows is None or _answers_for(process) & set(rows):
            return ""
    except (psutil.AccessDenied, psutil.NoSuchProcess, ProcessLookupError):
        return ""  # another user's, or it has ended meanwhile
    return f"{process.pid} of this run and no row, left by {environment.get(PROCESS_VARIABLE)}"


def _answers_for(process: psutil.Process) -> set[int]:
    """Return the pids one of which has to be a row's."""
    ancestors = {ancestor.pid for ancestor in process.parents()}
    return {process.pid, os.getsid(process.pid), *ancestors}
