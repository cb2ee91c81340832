"""What the robot does is one word of a table, whatever its processes say."""

from itertools import product
from typing import Any

import pytest

from vla_deploy.client.activity import (
    ACTIVITY_RULES,
    BY_SKILL,
    COMPLETED_S,
    ProcessStatuses,
    RobotActivity,
    activity_of,
)
from vla_deploy.plans.catalogue import SKILLS

ARMED: dict[str, Any] = {"state": "armed", "cause": ""}
AT_REST: dict[str, Any] = {"state": "idle", "skill": None}
FREE: dict[str, Any] = {"commands": [], "question": None}


def doing(skill: str | None, state: str = "executing") -> dict[str, Any]:
    return {"state": state, "skill": skill}


@pytest.mark.parametrize(
    ("statuses", "expected"),
    [
        ({}, "idle"),
        ({"speech": {"state": "listening"}}, "idle"),
        ({"speech": {"state": "deaf"}}, "idle"),
        ({"speech": {"state": "hearing"}}, "listening"),
        ({"speech": {"state": "transcribing"}}, "listening"),
        ({"planner": {"commands": ["c"], "question": "which?"}}, "listening"),
        ({"planner": {"commands": ["c"], "question": None}}, "processing"),
        ({"executor": doing("navigate_to")}, "navigating"),
        ({"executor": doing("place", "recovering")}, "manipulating"),
        ({"executor": doing("speak")}, "processing"),
        ({"executor": doing(None)}, "processing"),
        ({"executor": doing("navigate_to", "paused")}, "processing"),
        # A person who speaks does not hide that the robot moves.
        ({"executor": doing("pick_up"), "speech": {"state": "hearing"}}, "manipulating"),
        # A plan that goes on needs no planner; without one, no command is taken.
        ({"executor": doing("move"), "planner": None}, "navigating"),
        ({"planner": None}, "stopped"),
        ({"executor": None}, "stopped"),
        ({"control": None}, "stopped"),
        ({"refusal": "the executor was given up"}, "stopped"),
        ({"control": {"state": "protective_stop"}, "executor": doing("move")}, "stopped"),
        ({"control": {"state": "disarmed"}}, "stopped"),
        ({"control": {}}, "stopped"),
        ({"succeeded_s": 1.0}, "completed"),
        ({"succeeded_s": COMPLETED_S}, "idle"),
        ({"succeeded_s": 1.0, "executor": doing("turn")}, "navigating"),
    ],
)
def test_one_word_says_what_goes_on(statuses: dict[str, Any], expected: str) -> None:
    usual = {"control": ARMED, "executor": AT_REST, "planner": FREE}
    assert activity_of(ProcessStatuses(**(usual | statuses))) is RobotActivity(expected)


CONTROLS = (
    None,
    {},
    *(
        {"state": one}
        for one in ("disarmed", "armed", "stopping", "protective_stop", "stopped", "fault", "?")
    ),
)
EXECUTORS = (
    None,
    {},
    AT_REST,
    *(
        doing(skill, state)
        for skill in (None, "wait", "move", "place", "?")
        for state in ("executing", "recovering", "paused", "?")
    ),
)
PLANNERS = (
    None,
    {},
    *(
        {"commands": commands, "question": question}
        for commands in ([], ["c1"])
        for question in (None, "which?")
    ),
)
SPEECHES = (None, *({"state": one} for one in ("listening", "hearing", "transcribing", "deaf", "")))


def test_each_combination_has_one_activity_and_one_at_rest_by_safety_is_stopped() -> None:
    count = 0
    for control, executor, planner, speech, refusal, succeeded_s in product(
        CONTROLS, EXECUTORS, PLANNERS, SPEECHES, ("", "no commands"), (None, 0.0, 60.0)
    ):
        now = ProcessStatuses(
            control=control,
            executor=executor,
            planner=planner,
            speech=speech,
            refusal=refusal,
            succeeded_s=succeeded_s,
        )
        found = activity_of(now)
        is_at_rest = control is None or control.get("state") != "armed"
        assert not is_at_rest or found is RobotActivity.STOPPED
        assert (found is RobotActivity.STOPPED) == bool(now.stopped_by)
        count += 1
    assert count > 40_000


def test_the_table_has_every_activity_and_every_skill_that_it_names() -> None:
    assert {rule.activity for rule in ACTIVITY_RULES} == set(RobotActivity)
    assert BY_SKILL.keys() <= SKILLS.keys()
    moving = {name for name, spec in SKILLS.items() if {"base", "arms", "arm"} & {*spec.resources}}
    assert moving - BY_SKILL.keys() == {"stop"}
