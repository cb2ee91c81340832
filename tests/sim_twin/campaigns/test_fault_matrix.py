"""The matrix holds every fault in every phase, and its judge can fail a case."""

import json
from collections.abc import Iterator
from pathlib import Path

import pytest

from sim_twin.campaigns.faulting import fault_matrix
from sim_twin.campaigns.faulting.choreography import Phase
from sim_twin.campaigns.faulting.fault_matrix import Cell, cells, play
from sim_twin.campaigns.faulting.phases import NotSet, PhaseStage
from sim_twin.campaigns.faulting.separation import Separation
from sim_twin.campaigns.report import CampaignCase
from sim_twin.faults import Component, Fault
from sim_twin.faults.table import faults_of
from sim_twin.harness.lockstep_stack import LockstepControl
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


@pytest.mark.timeout(120)
def test_arms_that_sag_without_torque_are_unsafe_where_nothing_excuses_them(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    cell = CELLS["servo_bus/brown_out/carrying"]
    assert play(cell).failures == ()
    monkeypatch.setattr(fault_matrix, "_LIMP", ())
    assert any("rest" in failure for failure in play(cell).failures)


def test_a_robot_too_near_to_the_wall_is_unsafe(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fault_matrix, "_LEAST_GAP_M", 0.2)
    case = play(CELLS["servo.left_elbow/off/driving"])
    assert any("to furniture" in failure for failure in case.failures)


def test_a_stage_that_cannot_be_set_fails_its_case_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(stage: PhaseStage, phase: Phase) -> None:
        raise NotSet(f"{phase.value}: stopped")

    monkeypatch.setattr(PhaseStage, "begin", refuse)
    case = play(CELLS["servo.left_elbow/off/idle"])
    assert case.failures == ("the stage could not be set: idle: stopped",)


def test_a_case_that_never_stopped_has_no_way_to_rest_in_the_sum() -> None:
    def case(name: str, rest_s: float | None, gap_m: float | None) -> CampaignCase:
        return CampaignCase(name=name, figures={"rest_s": rest_s, "gap_m": gap_m})

    cases = (case("a/driving", None, 0.04), case("b/driving", 0.4, None), case("c/idle", 0.1, 0.13))
    summary = fault_matrix._summary(cases)
    assert summary["longest_rest_s_driving"] == 0.4
    assert summary["least_gap_m"] == 0.04
    json.dumps(summary, allow_nan=False)


@pytest.fixture
def stack(tmp_path: Path) -> Iterator[LockstepControl]:
    stack = LockstepControl(tmp_path)
    stack.add_senses()
    yield stack
    stack.close()


def test_driving_ends_before_the_wall_without_any_fault(stack: LockstepControl) -> None:
    stage = PhaseStage(stack)
    stage.begin(Phase.DRIVING)
    engine = stack.lockstep.twin.engine
    separation = Separation(engine.model, engine.data)
    stage.run_for(3.5)
    separation.look()
    assert 0.005 < separation.least_m < 0.1


def test_carrying_holds_the_payload_and_moves(stack: LockstepControl) -> None:
    stage = PhaseStage(stack)
    stage.begin(Phase.CARRYING)
    assert stage.holds_payload
    before_m = stack.lockstep.truth()["robot"]["x_m"], stack.lockstep.truth()["robot"]["y_m"]
    stage.run_for(1.0)
    after = stack.lockstep.truth()["robot"]
    assert abs(after["x_m"] - before_m[0]) + abs(after["y_m"] - before_m[1]) > 0.1
    assert stage.holds_payload


def test_only_what_servos_do_themselves_excuses_a_limp_joint() -> None:
    def limp(component: Component, instance: str | None, fault: Fault) -> frozenset[str]:
        cell = Cell(component=component, instance=instance, fault=fault, of=None, phase=Phase.IDLE)
        return cell.limp_joints(ROBOT)

    assert limp(Component.SERVO_BUS, None, Fault.BROWN_OUT) == frozenset(ROBOT.joint_names)
    assert limp(Component.SERVO, "left_elbow", Fault.OVERHEAT) == {"left_elbow"}
    assert not limp(Component.SERVO_BUS, None, Fault.UNPLUG)
    assert not limp(Component.DRIVE, "left_wheel", Fault.OVERHEAT)
