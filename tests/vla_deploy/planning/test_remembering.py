"""What the planner remembers of its commands, and what it makes of memories."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from platforms import load_profile
from vla_deploy.memory import EpisodeOutcome, LastSeen, MemoryStore
from vla_deploy.memory.episode import unix_s
from vla_deploy.planning.assembly import open_memory
from vla_deploy.planning.dialogue.situation import OLDEST_S, recalled
from vla_deploy.planning.interfaces import PlanRequest
from vla_deploy.planning.patterns.backend import Patterns

BOUNDS = load_profile("desktop").planning


@pytest.fixture
def memory(tmp_path: Path) -> Iterator[MemoryStore]:
    store = MemoryStore(tmp_path / "memory.sqlite3")
    yield store
    store.close()


def keys(seen_s: float, place: str = "bedside_table") -> LastSeen:
    return LastSeen(
        run_id="yesterday",
        thing_id="keys_1",
        kind="keys",
        colour="grey",
        place=place,
        position_m=(0.3, 3.8, 0.5),
        seen_s=seen_s,
    )


def test_a_command_and_its_end_are_remembered(open_desk: Callable, memory: MemoryStore) -> None:
    desk = open_desk(memory=memory)
    desk.give(text="go to the kitchen")
    desk.answers_to("sing a sea shanty")
    desk.executor_tells(command_id="c1", event="finished", success=True, error=None)
    desk.answers()
    desk.planner.stop()
    again = MemoryStore(memory.path)
    outcomes = {one.command: one.outcome for one in again.newest()}
    assert outcomes == {
        "go to the kitchen": EpisodeOutcome.SUCCEEDED,
        "sing a sea shanty": EpisodeOutcome.REFUSED,
    }
    again.close()


def test_status_tells_of_the_memory(open_desk: Callable, memory: MemoryStore) -> None:
    assert open_desk(memory=memory).status()["memory"]["file"] == str(memory.path)


def test_where_a_thing_was_days_ago_is_said_before_it_is_looked_for(
    ask: Callable[..., PlanRequest],
) -> None:
    request = ask("where are my keys?", last_seen=(keys(unix_s() - 7200.0),))
    plan = Patterns().propose(request, deadline=None).plan
    said, looked = plan.actions
    assert said.parameters["text"] == (
        "I saw the grey keys at the bedside table, 2 hours ago. I will look for it."
    )
    assert looked.skill == "find_object"


def test_another_thing_than_asked_for_is_not_told(ask: Callable[..., PlanRequest]) -> None:
    request = ask("where is the phone?", last_seen=(keys(unix_s()),))
    plan = Patterns().propose(request, deadline=None).plan
    assert [one.skill for one in plan.actions] == ["find_object"]


def test_what_is_too_old_is_not_called_up(memory: MemoryStore) -> None:
    memory.add([], [keys(unix_s() - OLDEST_S - 60.0)])
    assert recalled(memory, None)[1] == ()
    memory.add([], [keys(unix_s() - 60.0)])
    assert [one.place for one in recalled(memory, None)[1]] == ["bedside_table"]


def test_a_memory_that_cannot_be_read_is_done_without(memory: MemoryStore) -> None:
    memory.close()
    assert recalled(memory, "the keys") == ((), ())


def test_a_memory_that_cannot_be_opened_is_done_without(tmp_path: Path) -> None:
    (tmp_path / "run-state").write_text("a file where a folder should be")
    assert open_memory(BOUNDS, tmp_path / "run") is None
