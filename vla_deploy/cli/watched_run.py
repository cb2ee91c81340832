"""Describe the run of this machine, a robot's or a replay's, to a node that only watches it."""

from pathlib import Path

from vla_deploy.cli.session import Session
from vla_deploy.runtime.node import NodeContext


def watched_run(session: Session) -> NodeContext:
    """Return what the node is started with."""
    head = session.document("process_table") or session.document("replay_status") or {}
    return NodeContext(
        run_dir=Path(session.run_dir),
        robot=str(head.get("robot", "butler")),
        profile=str(head.get("profile", "")),
        devices_dir=None,
        clock=session.clock,
    )
