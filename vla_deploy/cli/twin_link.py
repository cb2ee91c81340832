"""Speak JSON lines to the twin of a run, where the run has one."""

from pathlib import Path
from typing import Any, Final

from vla_deploy.cli.errors import CommandFailed, UsageError
from vla_deploy.client.unix_rpc import request

_SOCKET: Final = Path("dev") / "referee"


def has_twin(run_dir: Path) -> bool:
    """Tell whether the run's robot is a twin."""
    return (run_dir / _SOCKET).is_socket()


def ask_twin(run_dir: Path, op: str, **details: Any) -> dict[str, Any]:
    """Return the twin's answer.

    Raises:
        UsageError: the run has no twin, or the twin refuses.
        CommandFailed: the twin is there and does not answer.
    """
    path = run_dir / _SOCKET
    if not has_twin(run_dir):
        raise UsageError(
            f"this run has no twin ({path} is not there): faults are for the twin alone; "
            "start one: vla-deploy run --twin"
        )
    try:
        answer = request(path, {"op": op, **details})
    except OSError as error:
        raise CommandFailed(f"{path}: {error.strerror or error}; is the twin alive?") from error
    if not answer.pop("ok"):
        raise UsageError(f"the twin refuses: {answer['error']}")
    return answer
