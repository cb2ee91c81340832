"""Find and end processes that a dead run has left behind, by the run id they carry."""

from collections.abc import Collection, Mapping

import psutil

from vla_deploy.runtime.logs import RUN_ID_VARIABLE

PROCESS_VARIABLE = "VLA_DEPLOY_PROCESS"
_TERM_WAIT_S = 1.0
_KILL_WAIT_S = 2.0


def run_id_of(process: psutil.Process) -> str | None:
    """Return the run that a living process belongs to, None where it belongs to none of ours."""
    return _environment(process).get(RUN_ID_VARIABLE)


def end_orphans(run_ids: Collection[str]) -> list[int]:
    """End every process of these runs, SIGTERM first; return their pids."""
    orphans = [process for process in psutil.process_iter() if run_id_of(process) in run_ids]
    for process in orphans:
        _signal(process, kill=False)
    _, stubborn = psutil.wait_procs(orphans, timeout=_TERM_WAIT_S)
    for process in stubborn:
        _signal(process, kill=True)
    psutil.wait_procs(stubborn, timeout=_KILL_WAIT_S)
    return [process.pid for process in orphans]


def end_leftovers(run_id: str, process_name: str | None = None) -> list[int]:
    """Kill what a run's ended processes have started, wherever it has moved; return the pids.

    With a name, only what that process of the table has started.
    """
    leftovers = []
    for process in psutil.process_iter():
        environment = _environment(process)
        named = process_name in (None, environment.get(PROCESS_VARIABLE))
        if environment.get(RUN_ID_VARIABLE) == run_id and named:
            _signal(process, kill=True)
            leftovers.append(process.pid)
    return leftovers


def _environment(process: psutil.Process) -> Mapping[str, str]:
    try:
        return process.environ()
    except (psutil.AccessDenied, psutil.NoSuchProcess, OSError):
        return {}  # another user's, a kernel thread, ended or gone: not ours


def _signal(process: psutil.Process, *, kill: bool) -> None:
    try:
        process.kill() if kill else process.terminate()
    except psutil.NoSuchProcess:
        return
