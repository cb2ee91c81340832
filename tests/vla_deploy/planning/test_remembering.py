"""What the planner remembers of its commands, and what it makes of memories."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from platforms import load_profile
from vla_deploy.memory import (
    NO_EXPERIENCE,
    Episode,
    EpisodeOutcome,
    Experience,
    LastSeen,
    MemoryStore,
    PastAction,
    experience_of,
)
from vla_deploy.memory.episode import unix_s
from vla_deploy.memory.experience import OLDEST_S
from vla_deploy.planning.assembly import open_memory
from vla_deploy.planning.interfaces import Forbidden, PlanRequest, Prohibition, Proposal
from vla_deploy.planning.patterns.backend import Patterns
from vla_deploy.planning.planner import checked
from vla_deploy.plans.plan import Plan

BOUNDS = load_profile("desktop").planning
NOW_S = 1_000_000_000.0


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


def seen(*things: LastSeen, **more: Any) -> Experience:
    return Experience(has_memory=True, now_s=NOW_S, last_seen=things, **more)


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
    request = ask("where are my keys?", experience=seen(keys(NOW_S - 7200.0)))
    plan = Patterns().propose(request, deadline=None).plan
    said, looked = plan.actions
    assert said.parameters["text"] == (
        "I saw the grey keys at the bedside table, 2 hours ago. I will look for it."
    )
    assert looked.skill == "find_object"


def test_another_thing_than_asked_for_is_not_told(ask: Callable[..., PlanRequest]) -> None:
    request = ask("where is the phone?", experience=seen(keys(NOW_S)))
    plan = Patterns().propose(request, deadline=None).plan
    assert [one.skill for one in plan.actions] == ["find_object"]


def test_what_is_too_old_is_not_called_up(memory: MemoryStore) -> None:
    memory.add([], [keys(NOW_S - OLDEST_S - 60.0)])
    assert experience_of(memory, "", NOW_S).last_seen == ()
    memory.add([], [keys(NOW_S - 60.0)])
    assert [one.place for one in experience_of(memory, "", NOW_S).last_seen] == ["bedside_table"]


def test_a_memory_that_cannot_be_read_is_done_without(memory: MemoryStore) -> None:
    memory.close()
    assert experience_of(memory, "the keys", NOW_S) == NO_EXPERIENCE


def test_a_memory_that_cannot_be_opened_is_done_without(tmp_path: Path) -> None:
    (tmp_path / "run-state").write_text("a file where a folder should be")
    assert open_memory(BOUNDS, tmp_path / "run") is None


def took(hand: str, succeeded: bool, ago_s: float, **changes: Any) -> PastAction:
    return replace(
        PastAction(
            skill="pick_up", succeeded=succeeded, kind="cup", hand=hand, done_s=NOW_S - ago_s
        ),
        **changes,
    )


def steps_of(plan: Plan) -> list[tuple[str, dict[str, Any]]]:
    return [(one.skill, one.parameters) for one in plan.actions]


AT_BED = ("navigate_to", "bedside_table")
KEYS_THERE = {"last_seen": (keys(NOW_S - 7200.0),)}
IN_VAIN = PastAction(skill="find_object", succeeded=False, kind="keys", done_s=NOW_S - 60.0)
BLOCKED = PastAction(
    skill="navigate_to", succeeded=False, place="bedside_table", done_s=NOW_S - 60.0
)
NO_BEDROOM = Prohibition(what=Forbidden.PLACE, words="bedroom")


@pytest.mark.parametrize(
    ("steps", "remembered", "changes", "first"),
    [
        ([("find_object", {"object": "keys"})], KEYS_THERE, {}, AT_BED),
        ([("pick_up", {"object": "keys"})], KEYS_THERE, {}, AT_BED),
        ([("pick_up", {"object": "red keys"})], KEYS_THERE, {}, ("find_object", None)),
        ([("find_object", {"object": "phone"})], KEYS_THERE, {}, ("find_object", None)),
        # Who made the plan says where to go.
        (
            [("navigate_to", {"place": "kitchen"}), ("find_object", {"object": "keys"})],
            KEYS_THERE,
            {},
            ("navigate_to", "kitchen"),
        ),
        # It was sought in vain since, the way was blocked just now, or it may not go there.
        (
            [("find_object", {"object": "keys"})],
            KEYS_THERE | {"actions": (IN_VAIN,)},
            {},
            ("find_object", None),
        ),
        (
            [("find_object", {"object": "keys"})],
            KEYS_THERE | {"actions": (BLOCKED,)},
            {},
            ("find_object", None),
        ),
        (
            [("find_object", {"object": "keys"})],
            KEYS_THERE,
            {"prohibitions": (NO_BEDROOM,)},
            ("find_object", None),
        ),
        (
            [("find_object", {"object": "keys"})],
            KEYS_THERE,
            {"failed": ("not found there",)},
            ("find_object", None),
        ),
        ([("find_object", {"object": "keys"})], KEYS_THERE, {"scene": None}, ("find_object", None)),
    ],
)
def test_every_plan_looks_first_where_an_unseen_thing_was(
    ask: Callable[..., PlanRequest],
    propose: Callable[..., Proposal],
    steps: list[tuple[str, dict[str, Any]]],
    remembered: dict[str, Any],
    changes: dict[str, Any],
    first: tuple[str, str | None],
) -> None:
    experience = Experience(has_memory=True, now_s=NOW_S, **remembered)
    request = ask("a test", experience=experience, **changes)
    plan = checked(propose(*steps).plan, request)
    assert (plan.actions[0].skill, plan.actions[0].parameters.get("place")) == first
    # A plan is checked again before a yes lets it run.
    assert steps_of(checked(plan, request)) == steps_of(plan)


@pytest.mark.parametrize(
    ("actions", "holding", "arm"),
    [
        ((took("left", False, 60.0),), {"left": None, "right": None}, "right"),
        ((took("right", False, 60.0),), {"left": None, "right": None}, "left"),
        ((took("left", True, 10.0), took("left", False, 60.0)), {"left": None, "right": None}, ""),
        ((took("left", False, 60.0, kind="ball"),), {"left": None, "right": None}, ""),
        ((took("left", False, 90_000.0),), {"left": None, "right": None}, ""),
        # No other hand is free.
        ((took("left", False, 60.0),), {"left": None, "right": "ball"}, "left"),
    ],
)
def test_the_hand_that_failed_with_such_a_thing_is_not_tried_first(
    ask: Callable[..., PlanRequest],
    propose: Callable[..., Proposal],
    actions: tuple[PastAction, ...],
    holding: dict[str, str | None],
    arm: str,
) -> None:
    experience = Experience(has_memory=True, now_s=NOW_S, actions=actions)
    request = ask("a test", holding=holding, experience=experience)
    plan = checked(propose(("pick_up", {"object": "red cup"})).plan, request)
    taken = next(one for one in plan.actions if one.skill == "pick_up")
    assert taken.parameters.get("arm", "") == arm


def test_patterns_take_with_the_other_hand_what_slipped_the_last_time(
    open_desk: Callable, memory: MemoryStore
) -> None:
    slipped = took("left", False, 0.0, done_s=unix_s() - 60.0)
    told = Episode(told_s=1.0, command="the cup", outcome=EpisodeOutcome.FAILED, actions=(slipped,))
    memory.add([told])
    desk = open_desk(memory=memory)
    desk.sees("red cup_1")
    desk.executor_is("idle", left=None, right=None)
    for judged, arm in ((None, "right"), (EpisodeOutcome.SUCCEEDED, None)):
        if judged is not None:
            memory.update_outcome(1, judged, "it was in the hand")
        (order,) = desk.plans_for("pick up the red cup")
        desk.executor_tells(
            command_id=order["command_id"], event="finished", success=False, error="cancelled"
        )
        taken = next(one for one in order["plan"]["actions"] if one["skill"] == "pick_up")
        assert taken["parameters"].get("arm") == arm


def test_a_person_corrects_what_came_of_the_last_command(
    open_desk: Callable, memory: MemoryStore
) -> None:
    desk = open_desk(memory=memory)
    desk.plans_for("go to the kitchen")
    desk.executor_tells(command_id="c1", event="finished", success=True, error=None, actions=[])
    desk.answers()
    (order,) = desk.plans_for("That was wrong, because I meant the bedroom")
    (said,) = order["plan"]["actions"]
    assert said["parameters"]["text"] == "Sorry. I will remember that this was wrong."
    desk.planner.stop()
    again = MemoryStore(memory.path)
    (kept,) = again.newest()
    assert (kept.outcome, kept.judged_from) == (EpisodeOutcome.FAILED, EpisodeOutcome.SUCCEEDED)
    assert kept.why == "I meant the bedroom"
    again.close()


@pytest.mark.parametrize("with_memory", [True, False])
def test_a_judgement_that_can_be_about_nothing_is_refused(
    open_desk: Callable, memory: MemoryStore, with_memory: bool
) -> None:
    desk = open_desk(memory=memory if with_memory else None)
    (refused,) = [one for one in desk.answers_to("that was wrong") if one["event"] == "rejected"]
    assert ("no command has ended" if with_memory else "no memory") in refused["reason"]
