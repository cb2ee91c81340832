"""The matrix must hold every fault in every phase, and its judge must be able to say no."""

from pathlib import Path

import pytest

from sim_twin.campaigns import fault_matrix
from sim_twin.campaigns.fault_matrix import Cell, cells, play
from sim_twin.campaigns.phases import Phase, Stage
from sim_twin.faults import Component, Fault
from sim_twin.faults.table import faults_of
from sim_twin.stack import LockstepControl
from vla_deploy.robots import load_robot

ROBOT = load_robot("butler")
CELLS = {cell.name: cell for cell in cells(ROBOT)}
EVERYDAY = (
    "servo_bus/unplug/carrying",
    "can_bus/bus_off/driving",
    "servo.left_elbow/overheat/reaching",
    "servo.left_gripper/off/carrying",
    "estop/wrong/carrying",
)


def test_every_supported_fault_is_there_in_every_phase() -> None:
    for component in Component:
        for fault in faults_of(component):
            for phase in Phase:
                assert any(
                    (cell.component, cell.fault, cell.phase) == (component, fault, phase)
                    for cell in CELLS.values()
                ), (component, fault, phase)


@pytest.mark.parametrize("name", EVERYDAY)
def test_a_fault_leaves_the_robot_safe(name: str) -> None:
    case = play(CELLS[name])
    assert case.failures == ()


@pytest.mark.slow
@pytest.mark.gl
@pytest.mark.timeout(120)
@pytest.mark.parametrize("name", [name for name in CELLS if name not in EVERYDAY])
def test_every_fault_in_every_phase_leaves_the_robot_safe(name: str) -> None:
    case = play(CELLS[name])
    print(case.row)
    assert case.failures == ()


def test_arms_that_sag_without_torque_are_unsafe_where_nothing_excuses_them(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    cell = CELLS["servo_bus/brown_out/carrying"]
    assert play(cell).failures == ()
    monkeypatch.setattr(fault_matrix, "_LIMP", ())
    assert any("rest" in failure for failure in play(cell).failures)


def test_carrying_holds_the_payload_and_moves(tmp_path: Path) -> None:
    stack = LockstepControl(tmp_path)
    stack.add_lidar()
    stage = Stage(stack)
    stage.begin(Phase.CARRYING)
    assert stage.holds_payload
    before_m = stack.lockstep.truth()["robot"]["x_m"], stack.lockstep.truth()["robot"]["y_m"]
    stage.run_for(1.0)
    after = stack.lockstep.truth()["robot"]
    assert abs(after["x_m"] - before_m[0]) + abs(after["y_m"] - before_m[1]) > 0.1
    assert stage.holds_payload
    stack.close()


def test_only_what_servos_do_themselves_excuses_a_limp_joint() -> None:
    def cell(component: Component, fault: Fault) -> Cell:
        return Cell(component=component, instance=None, fault=fault, of=None, phase=Phase.IDLE)

    assert cell(Component.SERVO_BUS, Fault.BROWN_OUT).goes_limp
    assert not cell(Component.SERVO_BUS, Fault.UNPLUG).goes_limp
    assert not cell(Component.DRIVE, Fault.OVERHEAT).goes_limp
