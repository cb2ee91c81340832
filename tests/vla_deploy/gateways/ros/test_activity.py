"""What the robot does is told in one word, from what its processes say."""

import pytest

from vla_deploy.gateways.ros.outward.activity import Activity, CapstoneState, PlanState, activity_of

ARMED, AT_REST = {"state": "armed"}, {"state": "idle", "skill": None}


def of(control=ARMED, executor=AT_REST, planner=None, speech=None, **ended):
    return activity_of(control, executor, planner, speech, **ended)


def doing(skill, state="executing"):
    return {"state": state, "skill": skill}


@pytest.mark.parametrize(
    ("activity", "capstone", "plan"),
    [
        (of(), "IDLE", "idle"),
        (of(speech={"state": "listening"}), "IDLE", "idle"),
        (of(speech={"state": "hearing"}), "LISTENING", "idle"),
        (of(planner={"commands": ["c"], "question": None}), "PROCESSING", "planning"),
        (of(planner={"commands": ["c"], "question": "which?"}), "LISTENING", "paused"),
        (of(executor=doing("navigate_to")), "NAVIGATING", "executing"),
        (of(executor=doing("pick_up")), "MANIPULATING", "executing"),
        (of(executor=doing("speak")), "PROCESSING", "executing"),
        (of(executor=doing("place", "recovering")), "MANIPULATING", "blocked"),
        (of(executor=doing("navigate_to", "paused")), "NAVIGATING", "paused"),
        (of({"state": "protective_stop"}, doing("move")), "NAVIGATING", "paused"),
        (of({"state": "stopped"}, doing("move")), "STOPPED", "paused"),
        (of({"state": "disarmed"}), "STOPPED", "idle"),
        (of(None, None), "STOPPED", "idle"),
        (Activity(), "STOPPED", "idle"),
        (of(has_succeeded=True, ended_s=1.0), "COMPLETED", "completed"),
        (of(has_succeeded=True, ended_s=9.0), "IDLE", "completed"),
        (of(has_succeeded=False, ended_s=1.0), "IDLE", "failed"),
    ],
)
def test_one_word_says_what_goes_on(activity, capstone, plan) -> None:
    assert activity.capstone is CapstoneState(capstone)
    assert activity.plan is PlanState(plan)
