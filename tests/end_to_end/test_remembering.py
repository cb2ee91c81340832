"""What the robot saw in one run, it looks for there first in the next one."""

from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from sim_twin.harness.lockstep_stack import LockstepStack, armed_lockstep
from vla_deploy.memory import EpisodeOutcome, MemoryStore

pytestmark = pytest.mark.gl
COMMAND = "find the red cup"


def first_drive(stack: LockstepStack) -> str | None:
    """Return the place to which the plan of the last command goes first, None for none."""
    plans: list[Any] = [one["plan"] for one in stack.events if one["event"] == "plan"]
    first = plans[-1]["actions"][0]
    return first["parameters"].get("place")


@pytest.mark.timeout(240)
def test_a_cup_is_sought_first_where_the_run_before_saw_it(tmp_path: Path, coarse: str) -> None:
    memory = tmp_path / "memory.sqlite3"
    with armed_lockstep(tmp_path / "first", profile=coarse, memory=memory) as stack:
        assert stack.say(COMMAND)["success"]
        assert first_drive(stack) is None
        stack.pause(5.0)  # what is seen is noted every two seconds
    with closing(MemoryStore(memory)) as store:
        seen = store.last_seen("cup", "red")[0]
        (told,) = store.newest()
        assert (told.command, told.outcome) == (COMMAND, EpisodeOutcome.SUCCEEDED)
        assert [(one.skill, one.kind) for one in told.actions] == [("find_object", "cup")]
    with armed_lockstep(tmp_path / "second", profile=coarse, memory=memory) as stack:
        assert stack.say(COMMAND)["success"]
        assert first_drive(stack) == seen.place
