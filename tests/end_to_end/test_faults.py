"""Every fault of the vocabulary has a scenario that says what the stack must do, and it does it."""

from pathlib import Path

import pytest

from sim_twin.campaigns.faulting.rehearsal import Rehearsal
from sim_twin.faults import Fault
from sim_twin.faults.scenario import Scenario, load_scenario, scenario_paths
from vla_deploy.robots import load_robot

ROBOT = load_robot("butler")
SCENARIOS = {path.stem: load_scenario(path, ROBOT) for path in scenario_paths()}
EVERYDAY = (
    *("servo_off", "servo_wrong", "servo_overheat", "servo_overload", "servo_id_clash"),
    *("servo_bus_stuck", "servo_bus_garbage", "servo_bus_delayed", "servo_bus_intermittent"),
    *("servo_bus_unplug", "servo_bus_brown_out", "servo_bus_wrong_baud", "servo_bus_echo"),
    *("can_bus_unplug", "can_bus_bus_off", "can_bus_arbitration_loss"),
    *("drive_off", "drive_stuck", "drive_wrong", "drive_id_clash", "estop_unplug", "estop_wrong"),
    "imu_slow",  # the only word that needs the whole stack, where it takes the least time
)
"""Every word of the vocabulary at least once; the campaign plays the rest."""


def marks(scenario: Scenario) -> list[pytest.MarkDecorator]:
    needed = [pytest.mark.gl] if scenario.meanwhile.takes_all else []
    return needed if scenario.name in EVERYDAY else [*needed, pytest.mark.slow]


def test_every_fault_of_the_vocabulary_is_played_every_day() -> None:
    assert {fault.fault for name in EVERYDAY for fault in SCENARIOS[name].faults} == set(Fault)


@pytest.mark.timeout(120)
@pytest.mark.parametrize(
    "scenario",
    [pytest.param(each, id=name, marks=marks(each)) for name, each in SCENARIOS.items()],
)
def test_the_stack_does_what_the_scenario_says(scenario: Scenario, tmp_path: Path) -> None:
    outcome = Rehearsal(scenario, tmp_path).run()
    print(outcome.row)
    assert outcome.failures == ()
