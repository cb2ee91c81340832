"""Find out what a process said last."""

from pathlib import Path

from vla_deploy.runtime.logs import LOGS_DIR
from vla_deploy.supervisor.runs.log_files import as_line, last_output, read_log

LAST_LINES = 12


def last_words(run_dir: Path, process: str) -> list[str]:
    """Return the last lines of a process' log, then what it has written past it."""
    folder = run_dir / LOGS_DIR
    logged = [as_line(line) for line in read_log(folder, process)[-LAST_LINES:]]
    return [*logged, *last_output(folder, process, LAST_LINES)]


def complaint(run_dir: Path, process: str) -> str:
    """Return the last error of a process in one line, without its name; "" when there is none."""
    folder = run_dir / LOGS_DIR
    errors = [line["message"] for line in read_log(folder, process) if line["level"] == "ERROR"]
    if errors:
        return str(errors[-1])
    output = last_output(folder, process, 1)
    return output[-1].removeprefix(f"{process}: ") if output else ""
