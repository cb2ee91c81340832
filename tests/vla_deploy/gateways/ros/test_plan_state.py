"""How the newest plan stands is told in one word, from what the processes say."""

import pytest

from vla_deploy.gateways.ros.outward.plan_state import PlanState, plan_state_of

ARMED, AT_REST = {"state": "armed"}, {"state": "idle"}
EXECUTING = {"state": "executing", "skill": "move"}
ASKED = {"commands": ["c"], "question": "which?"}


@pytest.mark.parametrize(
    ("control", "executor", "planner", "has_succeeded", "expected"),
    [
        (ARMED, AT_REST, None, None, "idle"),
        (ARMED, AT_REST, {"commands": ["c"], "question": None}, None, "planning"),
        (ARMED, AT_REST, ASKED, None, "paused"),
        (ARMED, EXECUTING, None, None, "executing"),
        (ARMED, {"state": "recovering"}, None, None, "blocked"),
        (ARMED, {"state": "paused"}, None, None, "paused"),
        ({"state": "protective_stop"}, EXECUTING, None, None, "paused"),
        ({"state": "stopped"}, EXECUTING, None, None, "paused"),
        (None, None, None, None, "idle"),
        (ARMED, AT_REST, None, True, "completed"),
        (ARMED, AT_REST, None, False, "failed"),
    ],
)
def test_one_word_says_how_the_plan_stands(
    control: dict[str, str],
    executor: dict[str, str] | None,
    planner: dict[str, object] | None,
    has_succeeded: bool | None,
    expected: str,
) -> None:
    state = plan_state_of(control, executor, planner, has_succeeded=has_succeeded)
    assert state is PlanState(expected)
