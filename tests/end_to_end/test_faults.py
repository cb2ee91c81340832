"""Every fault of the vocabulary has a scenario that says what the stack must do, and it does it."""

from pathlib import Path

import pytest

from sim_twin.faults.rehearsal import Rehearsal
from sim_twin.faults.scenario import load_scenario, scenario_paths
from vla_deploy.robots import load_robot

ROBOT = load_robot("butler")
SCENARIOS = [load_scenario(path, ROBOT) for path in scenario_paths()]


def marked(scenario):
    marks = [pytest.mark.gl] if scenario.meanwhile.takes_all else []
    return pytest.param(scenario, id=scenario.name, marks=marks)


@pytest.mark.parametrize("scenario", [marked(scenario) for scenario in SCENARIOS])
def test_the_stack_does_what_the_scenario_says(scenario, tmp_path: Path) -> None:
    outcome = Rehearsal(scenario, tmp_path).run()
    print(outcome.row)
    assert outcome.failures == ()
