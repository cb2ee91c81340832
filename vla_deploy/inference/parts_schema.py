"""Check what every manifest of several files must keep: its role, and the files it cannot lack."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from vla_deploy.robots.schema import RobotFileFault


def parts_faults(
    document: Mapping[str, Any], *, table: str, role: str, needed: Sequence[str]
) -> Iterator[RobotFileFault]:
    """Find a role that is not that of the manifest's `[table]`, and parts that are missing."""
    if document["role"] != role:
        yield RobotFileFault(key="role", got=document["role"], expected=f"{role}, for [{table}]")
    paths = [part["path"] for part in document["parts"]]
    for name in needed:
        if name not in paths:
            yield RobotFileFault(key="parts", got=f"{paths}", expected=f"{name} among them")
