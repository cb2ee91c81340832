"""What models are told of the last actions and of the task, read from the rings."""

from pathlib import Path
from typing import Any

import pytest

from drivers.clock import MonotonicClock
from vla_deploy.ipc import SharedSpace, topics
from vla_deploy.planning.dialogue.task_log import TaskLog


@pytest.fixture
def space(tmp_path: Path) -> SharedSpace:
    return SharedSpace(tmp_path / "ipc", MonotonicClock())


def action(number: int, status: str) -> dict[str, Any]:
    return {
        "command_id": "c1", "event": "action", "action_id": f"a{number}", "skill": "move",
        "parameters": {"distance_m": number}, "status": status, "execution_time_s": 1.0,
        "error": None, "retries": 0, "note": None,
    }  # fmt: skip


def test_the_last_five_actions_that_ended_are_kept_the_newest_first(space: SharedSpace) -> None:
    events: Any = space.ring_writer(topics.TASK_EVENT)
    for number in range(8):
        events.publish(action(number, "active"))
        events.publish(action(number, "aborted" if number == 7 else "succeeded"))
    log = TaskLog(space)
    log.step()
    ended = [(one.parameters["distance_m"], one.status) for one in log.last_actions]
    assert ended == [(7, "aborted"), *((n, "succeeded") for n in (6, 5, 4, 3))]


def test_a_command_goes_by_its_words_else_by_the_goal_of_its_plan(space: SharedSpace) -> None:
    utterances: Any = space.ring_writer(topics.UTTERANCE)
    events: Any = space.ring_writer(topics.TASK_EVENT)
    utterances.publish({"command_id": "c1", "source": "cli", "text": "tidy up"})
    utterances.publish({"command_id": "c2", "source": "api", "plan": {}})
    for name in ("c1", "c2"):
        events.publish({"command_id": name, "event": "plan", "plan": {"goal": "all is tidy"}})
    log = TaskLog(space)
    log.step()
    assert [log.words_of(name) for name in ("c1", "c2", "c3")] == ["tidy up", "all is tidy", ""]
