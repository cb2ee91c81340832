from collections.abc import Iterator
from pathlib import Path

import pytest

from drivers.errors import DeviceMissing, LinkLost
from sim_twin.errors import FaultRefused
from sim_twin.faults import Component, Fault
from sim_twin.faults.fault_server import FaultServer
from sim_twin.faults.table import EFFECTS, faults_of
from sim_twin.harness.lockstep import Lockstep

ELBOW_ID = 3


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Lockstep]:
    """One world for tests that leave no fault behind."""
    lockstep = Lockstep(tmp_path=tmp_path_factory.mktemp("shared"))
    yield lockstep
    lockstep.close()


@pytest.fixture
def lockstep(tmp_path: Path) -> Iterator[Lockstep]:
    lockstep = Lockstep(tmp_path=tmp_path)
    yield lockstep
    lockstep.close()


def ping(lockstep: Lockstep) -> bytes:
    line = lockstep.devices.serial("servos")
    line.write(bytes.fromhex("fffffd0003030001") + b"\x19\x4e")
    return line.read(100, 0)


def test_every_fault_of_the_vocabulary_can_befall_something() -> None:
    assert {fault for component in Component for fault in faults_of(component)} == set(Fault)


def test_a_fault_strikes_and_goes_by_its_timing(lockstep: Lockstep) -> None:
    handle = lockstep.faults.inject("servo", "left_elbow", "off", start_s=0.1, duration_s=0.2)
    heard = []
    for _ in range(4):
        lockstep.run_for(0.05)
        heard.append((bool(ping(lockstep)), handle.is_on))
        lockstep.run_for(0.05)
    assert heard == [(True, False), (False, True), (False, True), (True, False)]
    assert lockstep.faults.pending == ()


def test_a_handle_clears_its_fault_and_a_second_time_does_nothing(lockstep: Lockstep) -> None:
    handle = lockstep.faults.inject("servo", ELBOW_ID, "off")
    assert not ping(lockstep)
    handle.clear()
    handle.clear()
    assert ping(lockstep)


def test_an_intermittent_fault_comes_and_goes(lockstep: Lockstep) -> None:
    lockstep.faults.inject(
        "servo", "left_elbow", "intermittent", of="off", period_s=0.2, duty_ratio=0.5
    )
    heard = []
    for _ in range(4):
        lockstep.run_for(0.05)
        heard.append(bool(ping(lockstep)))
        lockstep.run_for(0.05)
    assert heard == [False, True, False, True]


def test_all_faults_are_cleared_at_once(lockstep: Lockstep) -> None:
    lockstep.faults.inject("servo", "left_elbow", "off")
    lockstep.faults.inject("servo_bus", None, "brown_out", volts_v=3.0, ramp_s=0.0)
    lockstep.run_for(0.1)
    lockstep.faults.clear_all()
    lockstep.run_for(0.5)
    assert ping(lockstep)
    assert lockstep.faults.pending == ()


def test_a_pulled_cable_is_lost_to_who_has_it_open_and_missing_to_who_opens_it(
    lockstep: Lockstep,
) -> None:
    line = lockstep.devices.serial("lidar")
    handle = lockstep.faults.inject("lidar", None, "unplug")
    with pytest.raises(LinkLost, match="unplugged"):
        line.read(1, 0)
    with pytest.raises(DeviceMissing, match="lidar: unplugged"):
        lockstep.devices.serial("lidar")
    handle.clear()
    with pytest.raises(LinkLost):
        line.read(1, 0)
    lockstep.run_for(0.1)
    assert lockstep.devices.serial("lidar").read(100, 0)


def test_a_ramp_lowers_the_voltage_step_by_step(lockstep: Lockstep) -> None:
    lockstep.faults.inject("servo_bus", None, "brown_out", volts_v=8.0, ramp_s=0.4)
    lockstep.run_for(0.2)
    assert lockstep.twin.servo_supplies["main"].volts(lockstep.twin.now_ns) == pytest.approx(
        10.0, abs=0.05
    )
    lockstep.run_for(0.3)
    assert lockstep.twin.servo_supplies["main"].volts(lockstep.twin.now_ns) == 8.0


@pytest.mark.parametrize(
    ("component", "instance", "fault", "details", "reason"),
    [
        ("toaster", None, "off", {}, "component: expected one of servo_bus, servo"),
        ("servo", "left_elbow", "melted", {}, "fault: expected one of off, stuck"),
        ("servo", "left_elbow", "bus_off", {}, "it supports off, stuck, garbage"),
        ("imu", None, "id_clash", {}, "imu: there is no fault 'id_clash' here; it supports off"),
        ("servo", "nose", "off", {}, r"expected a name or an id of left_shoulder_yaw \(1\)"),
        ("servo", None, "off", {}, "expected a name or an id"),
        ("lidar", "left", "off", {}, "there is only one"),
        ("servo", 3, "off", {"volts_v": 1.0}, "volts_v: unknown; expected start_s"),
        ("servo", 3, "delayed", {"delay_s": -1.0}, "delay_s: expected 0.001..60; got -1"),
        ("servo", 3, "off", {"duration_s": "long"}, "duration_s: expected 0.001"),
        ("servo", 3, "off", {"period_s": 1.0}, "period_s: unknown"),
        ("servo", 3, "intermittent", {"period_s": 1.0}, "of: expected one of off"),
        ("servo", 3, "intermittent", {"of": "off"}, "period_s: expected how often"),
        ("servo", 3, "intermittent", {"of": "intermittent", "period_s": 1}, "no fault 'interm"),
        ("servo", 3, "wrong", {"offset_rad": 9.0, "x": 1}, "x: unknown; .*offset_rad: expected"),
    ],
)
def test_what_is_not_supported_is_refused_with_what_is(
    shared: Lockstep,
    component: str,
    instance: str | int | None,
    fault: str,
    details: dict,
    reason: str,
) -> None:
    with pytest.raises(FaultRefused, match=reason):
        shared.faults.inject(component, instance, fault, **details)
    assert shared.faults.pending == ()


def test_the_same_fault_twice_at_one_place_is_refused(lockstep: Lockstep) -> None:
    lockstep.faults.inject("servo", 3, "off", start_s=5.0)
    lockstep.faults.inject("servo", 4, "off")
    with pytest.raises(FaultRefused, match="servo left_elbow: off: is there already as fault 1"):
        lockstep.faults.inject("servo", "left_elbow", "off")


@pytest.mark.gl
@pytest.mark.parametrize(("component", "fault"), list(EFFECTS))
def test_every_effect_begins_and_ends(
    shared: Lockstep, tmp_path: Path, component: Component, fault: Fault
) -> None:
    instances = {
        Component.SERVO: "left_elbow",
        Component.DRIVE: "left_wheel",
        Component.HOME_DEVICE: "lamp",
    }
    shared.twin.begin_home(tmp_path / "mqtt")
    handle = shared.faults.inject(component, instances.get(component), fault)
    shared.run_for(0.04)  # every device has done something by then
    assert handle.is_on
    handle.clear()
    assert not handle.is_on
    shared.run_for(0.04)
    assert shared.faults.pending == ()
    shared.twin.leave_home()


def test_the_fault_server_lists_injects_and_clears(lockstep: Lockstep) -> None:
    desk = FaultServer(lockstep.faults, lockstep.robot).operations
    listed = desk["fault_list"]({})
    (servo,) = [row for row in listed["catalogue"] if row["component"] == "servo"]
    assert servo["instances"]["left_elbow"] == ELBOW_ID
    assert "overheat" in {each["fault"] for each in servo["faults"]}
    assert "servo_off" in listed["scenarios"]
    request = {"op": "fault_inject", "component": "servo", "instance": "3", "fault": "off"}
    assert desk["fault_inject"](request)["injected"] == {
        "id": 1,
        "fault": "servo left_elbow: off",
        "on": True,
    }
    with pytest.raises(FaultRefused, match="there is no fault 7; in force or to come: 1"):
        desk["fault_clear"]({"id": 7})
    assert desk["fault_clear"]({"id": 1}) == {"pending": []}


def test_the_fault_server_plays_a_scenario_by_name_or_text(lockstep: Lockstep) -> None:
    desk = FaultServer(lockstep.faults, lockstep.robot).operations
    played = desk["fault_run"]({"name": "servo_bus_unplug"})
    assert played["expect"]["cause"] == "servo_bus_lost"
    assert [fault["fault"] for fault in played["pending"]] == ["servo_bus: unplug"]
    with pytest.raises(FaultRefused, match="no scenario 'dance'"):
        desk["fault_run"]({"name": "dance"})
    with pytest.raises(FaultRefused, match="mine: faults: expected a list"):
        desk["fault_run"]({"name": "mine", "text": "meanwhile = 'hold'"})
