"""Find and end processes that a dead run has left behind, by the run id they carry."""

from collections.abc import Collection

import psutil

RUN_ID_VARIABLE = "VLA_DEPLOY_RUN_ID"
_TERM_WAIT_S = 1.0
_KILL_WAIT_S = 2.0


def end_orphans(run_ids: Collection[str]) -> list[int]:
    """End every process of these runs, SIGTERM first; return their pids."""
    orphans = [process for process in psutil.process_iter() if _run_id(process) in run_ids]
    for process in orphans:
        _signal(process, kill=False)
    _, stubborn = psutil.wait_procs(orphans, timeout=_TERM_WAIT_S)
    for process in stubborn:
        _signal(process, kill=True)
    psutil.wait_procs(stubborn, timeout=_KILL_WAIT_S)
    return [process.pid for process in orphans]


def _run_id(process: psutil.Process) -> str | None:
    try:
        return process.environ().get(RUN_ID_VARIABLE)
    except (psutil.AccessDenied, psutil.NoSuchProcess, OSError):
        return None  # another user's, a kernel thread, or gone meanwhile: not ours


def _signal(process: psutil.Process, *, kill: bool) -> None:
    try:
        process.kill() if kill else process.terminate()
    except psutil.NoSuchProcess:
        return
