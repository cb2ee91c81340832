"""Mark a run as a replay: no process but the replay itself gets a writer for what a robot hears."""

import json
from pathlib import Path
from typing import Any, Final

from vla_deploy.ipc.errors import ReplayOnly
from vla_deploy.ipc.topics import Topic

MARK_FILE: Final = "replay.json"
LIVE_OWNERS: Final = frozenset({"dashboard", "stop_door"})
"""Processes that run beside a replay and tell of themselves: no file speaks for them."""
_OPEN_RINGS: Final = frozenset({"replay_request", "profile_answer"})


def mark_replay(directory: Path, file: str) -> None:
    """Make the shared memory in `directory` a replay's, before any other process opens it.

    Raises:
        OSError: the mark cannot be written.
    """
    directory.mkdir(mode=0o700, parents=True, exist_ok=True)
    (directory / MARK_FILE).write_text(json.dumps({"file": file}))


def refuse_in_replay(directory: Path, topic: Topic[Any]) -> None:
    """Let nobody write a topic of a replay.

    Raises:
        ReplayOnly: the run is a replay, and the topic is what a robot would hear or say.
    """
    mark = directory / MARK_FILE
    if topic.owner in LIVE_OWNERS or topic.name in _OPEN_RINGS or not mark.exists():
        return
    file = json.loads(mark.read_text())["file"]
    raise ReplayOnly(
        f"topic {topic.name}: this is a replay of {file}, expected a robot; nothing can be asked "
        "of it; end it by Ctrl-C where it was started, or: vla-deploy shutdown"
    )
