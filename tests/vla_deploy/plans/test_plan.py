"""A plan has an order, or the cycle is named; its schema is the published one."""

import json
from itertools import pairwise
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st

from vla_deploy.plans.plan import (
    Action,
    Plan,
    dependency_faults,
    execution_order,
    plan_schema,
)

NAMES = "abcdefg"
PUBLISHED = Path(__file__).parents[3] / "docs" / "plan.schema.json"


def actions_of(edges: set[tuple[str, str]]) -> list[Action]:
    return [
        Action(id=name, skill="stop", depends_on=tuple(b for a, b in sorted(edges) if a == name))
        for name in NAMES
    ]


EDGES = st.sets(st.tuples(st.sampled_from(NAMES), st.sampled_from(NAMES)), max_size=14)


@given(EDGES)
def test_a_plan_either_has_an_order_or_a_cycle_that_really_is_one(
    edges: set[tuple[str, str]],
) -> None:
    actions = actions_of(edges)
    faults = dependency_faults(actions)
    if faults:
        cycle = faults[0].partition(": ")[2].split(" -> ")
        assert cycle[0] == cycle[-1]
        assert all(pair in edges for pair in pairwise(cycle))
        return
    order = [action.id for action in execution_order(actions)]
    assert sorted(order) == list(NAMES)
    assert all(order.index(b) < order.index(a) for a, b in edges)


def test_dependencies_come_first_and_priority_second() -> None:
    actions = [
        Action(id="low", skill="stop", priority="low"),
        Action(id="high", skill="stop", priority=1, depends_on=("low",)),
        Action(id="medium", skill="stop"),
    ]
    assert [action.id for action in execution_order(actions)] == ["medium", "low", "high"]


def test_duplicates_and_unknown_dependencies_are_named() -> None:
    actions = [Action(id="a", skill="stop"), Action(id="a", skill="stop", depends_on=("q",))]
    found = dependency_faults(actions)
    assert any("used twice" in fault for fault in found)
    assert any('"q", which is not in the plan' in fault for fault in found)


def test_the_published_schema_is_the_one_in_force() -> None:
    """Mend with: vla-deploy schema > docs/plan.schema.json."""
    assert json.loads(PUBLISHED.read_text(encoding="utf-8")) == plan_schema()


def test_the_example_in_the_documentation_is_a_plan() -> None:
    text = (PUBLISHED.parent / "plans.md").read_text(encoding="utf-8")
    example = text.split("```json\n")[1].split("```")[0]
    assert len(Plan.model_validate_json(example).actions) == 3
