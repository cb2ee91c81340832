import pytest

from vla_deploy.planning.command_parser.grammar import STEPS
from vla_deploy.planning.command_parser.read_back import question

NO_PLAN = {"nothing", "impossible", "unknown"}


@pytest.mark.parametrize("do", sorted(STEPS.keys() - NO_PLAN))
def test_every_step_that_may_be_planned_can_be_read_back(do: str) -> None:
    fields = {name.strip("[]"): "left" for name in STEPS[do]}
    whole, bare = question([{"do": do, **fields}]), question([{"do": do}])
    assert whole.startswith("Shall I ") and bare.startswith("Shall I ")
    assert whole.endswith("?")


def test_steps_are_read_back_in_their_order() -> None:
    steps = [{"do": "tidy", "where": "kitchen"}, {"do": "go", "where": "dock"}]
    assert question(steps) == "Shall I tidy up kitchen, then go to dock?"
