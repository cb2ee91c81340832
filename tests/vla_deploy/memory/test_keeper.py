"""What the keeper makes of the topics, and how it bears a disk that takes nothing."""

import sqlite3
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from drivers.clock import NS_PER_S
from vla_deploy.ipc import SharedSpace
from vla_deploy.memory import EpisodeOutcome, MemoryStore
from vla_deploy.memory.keeper import AGAIN_S, MOST_OPEN, MOST_THINGS, MemoryKeeper
from vla_deploy.runtime.executors import InlineExecutor

PLAN = {"goal": "the cup is in the box", "reasoning": "one red cup", "actions": []}
PLACES = {"coffee_table": (2.2, 1.5)}


class StepClock:
    def __init__(self) -> None:
        self.ns = NS_PER_S

    def now_ns(self) -> int:
        return self.ns

    def sleep_until(self, deadline_ns: int) -> None:
        self.ns = max(self.ns, deadline_ns)


class Desk:
    """Be whoever talks to the robot, and the rest of the robot."""

    def __init__(self, folder: Path) -> None:
        self.clock = StepClock()
        self.space = SharedSpace(folder / "ipc", self.clock)
        self._utterances = self.space.ring_writer("utterance")
        self._events = self.space.ring_writer("task_event")
        self._scene = self.space.cell_writer("scene")
        self.store = MemoryStore(folder / "memory.sqlite3", patience_s=0.01)
        self.keeper = MemoryKeeper(
            self.store,
            self.space,
            self.clock,
            InlineExecutor(),
            run_id="run-1",
            places=PLACES,
            wall_s=lambda: 1000.0 + self.clock.ns / NS_PER_S,
        )

    def say(self, text: str, command_id: str = "c1", **more: Any) -> None:
        self._utterances.publish({"command_id": command_id, "text": text, "source": "cli"} | more)

    def tell(self, event: str, command_id: str = "c1", **details: Any) -> None:
        self._events.publish({"command_id": command_id, "event": event} | details)

    def see(self, *objects: dict[str, Any]) -> None:
        self._scene.put_document({"stamp_ns": self.clock.ns, "objects": list(objects)})

    def step(self, after_s: float = 0.0) -> None:
        self.clock.ns += round(after_s * NS_PER_S)
        self.keeper.step()
        self.keeper.step()


@pytest.fixture
def desk(tmp_path: Path) -> Iterator[Desk]:
    desk = Desk(tmp_path)
    yield desk
    desk.store.close()


def cup(now_ns: int, x_m: float = 2.2, **changes: Any) -> dict[str, Any]:
    return {
        "id": "cup_1",
        "class": "cup",
        "colour": "red",
        "position_m": [x_m, 1.5, 0.5],
        "size_m": [0.07, 0.07, 0.1],
        "yaw_rad": 0.0,
        "last_seen_ns": now_ns,
        "seen_count": 9,
        "confidence": 0.9,
        "rests": {"relation": "on", "of": "coffee_table"},
    } | changes


def test_a_command_is_remembered_from_its_words_to_its_end(desk: Desk) -> None:
    desk.say("put the cup in the box")
    desk.step()
    desk.tell("accepted")
    desk.tell("plan", plan=PLAN, rung="rules")
    desk.step(after_s=30.0)
    assert desk.store.newest() == []
    desk.tell("finished", success=True, error=None)
    desk.step(after_s=12.0)
    (kept,) = desk.store.newest()
    assert (kept.command, kept.outcome, kept.rung) == (
        "put the cup in the box",
        EpisodeOutcome.SUCCEEDED,
        "rules",
    )
    assert (kept.goal, kept.plan, kept.source) == (PLAN["goal"], PLAN, "cli")
    assert (kept.told_s, kept.duration_s) == (1001.0, 42.0)


@pytest.mark.parametrize(
    ("event", "details", "outcome", "error"),
    [
        (
            "rejected",
            {"reason": "I know no such place"},
            EpisodeOutcome.REFUSED,
            "I know no such place",
        ),
        (
            "finished",
            {"success": False, "error": "it slipped"},
            EpisodeOutcome.FAILED,
            "it slipped",
        ),
        ("answered", {"of": "c0"}, EpisodeOutcome.SUCCEEDED, ""),
    ],
)
def test_every_end_is_remembered(
    desk: Desk, event: str, details: dict[str, Any], outcome: EpisodeOutcome, error: str
) -> None:
    desk.say("go to the moon")
    desk.tell(event, **details)
    desk.step()
    (kept,) = desk.store.newest()
    assert (kept.outcome, kept.error) == (outcome, error)


def test_what_nobody_said_is_not_remembered(desk: Desk) -> None:
    desk.say("")
    desk.tell("finished", success=True)
    desk.tell("finished", "never-heard-of", success=True)
    desk.step()
    assert desk.store.newest() == []


def test_commands_that_never_end_are_bounded(desk: Desk) -> None:
    for number in range(MOST_OPEN + 5):
        desk.say(f"go to place {number}", f"c{number}")
        desk.step()
    for number in range(MOST_OPEN + 5):
        desk.tell("finished", f"c{number}", success=True)
        desk.step()
    assert len(desk.store.newest(100)) == MOST_OPEN


def test_things_are_remembered_where_they_are_and_again_when_they_have_moved(desk: Desk) -> None:
    desk.see(cup(desk.clock.ns))
    desk.step()
    (seen,) = desk.store.last_seen("cup")
    assert (seen.place, seen.colour, seen.run_id) == ("coffee_table", "red", "run-1")
    desk.see(cup(desk.clock.ns, x_m=2.25))  # the same place, within a hand's breadth
    desk.step(after_s=5.0)
    assert desk.store.last_seen("cup") == [seen]
    desk.see(cup(desk.clock.ns, x_m=4.2, rests={"relation": "in", "of": "box_1"}))
    desk.step(after_s=5.0)
    assert [one.place for one in desk.store.last_seen("cup")] == ["box_1"]


def see_many(desk: Desk) -> None:
    """Let perception tell of more things than the keeper knows at a time, 64 in a look."""
    for first in range(0, MOST_THINGS + 64, 64):
        desk.see(*(cup(desk.clock.ns, id=f"cup_{first + number + 2}") for number in range(64)))
        desk.step(after_s=2.0)


def test_things_of_a_long_run_are_known_by_number_and_written_anew_after_that(desk: Desk) -> None:
    desk.see(cup(desk.clock.ns))
    desk.step()
    (before,) = (one for one in desk.store.last_seen("cup", count=1000) if one.thing_id == "cup_1")
    see_many(desk)
    desk.see(cup(desk.clock.ns))
    desk.step(after_s=2.0)
    (again,) = (one for one in desk.store.last_seen("cup", count=1000) if one.thing_id == "cup_1")
    assert 0.0 < again.seen_s - before.seen_s < AGAIN_S, "it was known all the time"


def test_things_that_wait_for_the_disk_are_bounded(desk: Desk) -> None:
    other = sqlite3.connect(desk.store.path)
    other.execute("BEGIN IMMEDIATE")
    see_many(desk)
    desk.step(after_s=60.0)
    assert desk.keeper.document()["trouble"]
    assert desk.keeper.document()["waiting"] == MOST_THINGS
    other.close()


def test_what_has_no_name_is_not_remembered(desk: Desk) -> None:
    desk.see(cup(desk.clock.ns, id="object_1", **{"class": "object"}))
    desk.step()
    assert desk.store.last_seen() == []


def test_a_scene_that_cannot_be_read_is_passed_over(desk: Desk) -> None:
    desk.see({"id": "cup_1"})
    desk.step()
    desk.see(cup(desk.clock.ns))
    desk.step(after_s=5.0)
    assert len(desk.store.last_seen()) == 1


def test_what_cannot_be_written_now_is_told_and_written_later(desk: Desk) -> None:
    other = sqlite3.connect(desk.store.path)
    other.execute("BEGIN IMMEDIATE")
    desk.say("go to the kitchen")
    desk.tell("finished", success=True)
    desk.step()
    told = desk.keeper.document()
    assert "database is locked" in told["trouble"]
    assert told["waiting"] == 1
    other.close()
    desk.step(after_s=60.0)
    assert desk.keeper.document()["trouble"] == ""
    assert [one.command for one in desk.store.newest()] == ["go to the kitchen"]


def test_how_each_action_went_is_remembered_with_its_thing_and_hand(desk: Desk) -> None:
    def result(skill: str, status: str, error: str | None = None, **given: Any) -> dict[str, Any]:
        return {"skill": skill, "parameters": given, "status": status, "error": error, "note": None}

    desk.say("bring the red cup to the kitchen")
    desk.tell(
        "finished",
        success=False,
        error="it slipped",
        actions=[
            result("navigate_to", "succeeded", place="kitchen"),
            result("pick_up", "aborted", "the left hand does not hold the cup", object="red cup"),
            result("pick_up", "succeeded", object="cup_2", arm="right"),
            result("place", "cancelled", destination="kitchen"),
        ],
    )
    desk.step()
    (kept,) = desk.store.newest()
    went = [
        (one.skill, one.succeeded, one.kind, one.colour, one.hand, one.place)
        for one in kept.actions
    ]
    assert went == [
        ("navigate_to", True, "", "", "", "kitchen"),
        ("pick_up", False, "cup", "red", "left", ""),
        ("pick_up", True, "cup", "", "right", ""),
    ]
    assert [one.skill for one in desk.store.past_actions()] == ["pick_up", "pick_up", "navigate_to"]


def test_that_was_wrong_is_about_the_command_that_ended_last(desk: Desk) -> None:
    desk.say("that was wrong", "c0")
    desk.step()
    for number, command in enumerate(("go to the kitchen", "wait"), 1):
        desk.say(command, f"c{number}")
        desk.tell("finished", f"c{number}", success=True, error=None)
        desk.step()
    desk.say("that was right: heard badly", "c3", heard={"doubted": True, "confidence": 0.4})
    desk.say("that was wrong: I meant the bedroom", "c4")
    desk.step()
    outcomes = [(one.command, one.outcome.value, one.why) for one in desk.store.newest()]
    assert outcomes == [
        ("wait", "failed", "I meant the bedroom"),
        ("go to the kitchen", "succeeded", ""),
    ]
