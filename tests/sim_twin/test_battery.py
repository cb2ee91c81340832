"""The twin's pack drains by what is drawn, charges at the dock, and shows itself as a gauge."""

import math
from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pytest

from drivers.clock import NS_PER_S
from platforms.probes.battery import CHARGE, PowerSupplySource
from platforms.probes.reading import Reading
from platforms.tree import Tree
from sim_twin.battery import BASE_LOAD_W, CHARGER_W, TwinBattery
from sim_twin.errors import FaultRefused
from sim_twin.twin import Twin
from vla_deploy.robots import RobotDescription, load_robot
from vla_deploy.robots.battery_settings import BatterySettings, BatterySource

SETTINGS = BatterySettings(
    source=BatterySource.POWER_SUPPLY,
    capacity_wh=100.0,
    cells=7,
    cell_curve=((3.0, 0.0), (3.7, 0.5), (4.2, 1.0)),
)


class Pack:
    """A pack with a load and a dock that a test sets."""

    def __init__(self, charge_ratio: float) -> None:
        self.load_w, self.docked = 0.0, False
        self.fed: list[float] = []
        self.battery = TwinBattery(
            SETTINGS, lambda: self.load_w, lambda: self.docked, self.fed.append
        )
        self.battery.charge_ratio = charge_ratio
        self.battery.step(0)
        self._now_ns = 0

    def run(self, minutes: float) -> TwinBattery:
        for _ in range(round(minutes * 60)):
            self._now_ns += NS_PER_S
            self.battery.step(self._now_ns)
        return self.battery


def test_it_loses_what_is_drawn_and_its_voltage_sinks_with_charge_and_current() -> None:
    pack = Pack(0.5)
    idle_v = pack.run(1).voltage_v
    pack.load_w = 170.0
    assert pack.run(1 / 60).voltage_v < idle_v - 0.1
    before = pack.battery.charge_ratio
    drained = before - pack.run(6).charge_ratio
    assert drained == pytest.approx((BASE_LOAD_W + 170.0) * 0.1 / SETTINGS.capacity_wh, rel=1e-6)
    assert pack.battery.current_a == pytest.approx(-200.0 / pack.battery.voltage_v, rel=1e-3)
    assert pack.battery.status == "Discharging"
    assert pack.fed[-1] == pack.battery.voltage_v


def test_an_empty_one_stays_empty() -> None:
    pack = Pack(0.001)
    pack.load_w = 500.0
    assert pack.run(5).charge_ratio == 0.0
    assert pack.battery.voltage_v < 7 * 3.0


def test_at_the_dock_it_charges_beside_the_load_and_less_and_less_up_to_full() -> None:
    pack = Pack(0.5)
    pack.docked, pack.load_w = True, 40.0
    battery = pack.run(6)
    assert battery.charge_ratio == pytest.approx(0.5 + 0.1 * CHARGER_W / 100.0, rel=1e-3)
    assert (battery.status, battery.is_charging) == ("Charging", True)
    first_a = battery.current_a
    assert pack.run(12).current_a < 0.7 * first_a
    assert pack.run(60).charge_ratio == pytest.approx(1.0, abs=0.002)
    assert (battery.status, battery.is_charging, battery.current_a) == ("Full", False, 0.0)


def test_its_gauge_is_a_folder_of_the_kernels_files(tmp_path: Path) -> None:
    pack = Pack(0.5)
    pack.battery.serve(tmp_path)
    pack.run(3)
    folder = tmp_path / "sys/class/power_supply/BAT0"
    told = {name: (folder / name).read_text().strip() for name in ("type", "status", "capacity")}
    assert told == {"type": "Battery", "status": "Discharging", "capacity": "49"}
    assert int((folder / "voltage_now").read_text()) == round(pack.battery.voltage_v * 1e6)
    assert int((folder / "current_now").read_text()) < 0


def test_on_a_full_disk_its_gauge_shows_what_it_showed_before(tmp_path: Path) -> None:
    pack = Pack(0.5)
    pack.battery.serve(tmp_path)
    pack.run(3)
    folder = tmp_path / "sys/class/power_supply/BAT0"
    fresh = folder / ".energy_now"
    fresh.symlink_to("/dev/full")
    before = (folder / "energy_now").read_text()
    pack.run(3)
    assert (folder / "energy_now").read_text() == before
    fresh.unlink()
    pack.run(3)
    assert int((folder / "energy_now").read_text()) < int(before)


@pytest.fixture
def butler() -> RobotDescription:
    return load_robot("butler")


@pytest.fixture
def twin(butler: RobotDescription) -> Iterator[Twin]:
    assert butler.battery is not None
    pack = replace(butler.battery, source=BatterySource.SERVOS, cells=3)
    with closing(Twin(replace(butler, battery=pack))) as twin:
        yield twin


def step_for(twin: Twin, seconds: float) -> None:
    end_ns = twin.now_ns + round(seconds * NS_PER_S)
    while twin.now_ns < end_ns:
        twin.step()


def test_servos_that_hang_on_the_pack_measure_its_voltage_and_a_fault_goes_before(
    twin: Twin,
) -> None:
    battery = twin.battery
    assert battery is not None
    for charge, low_v, high_v in ((0.9, 12.0, 12.6), (0.1, 10.0, 10.6)):
        battery.charge_ratio = charge
        step_for(twin, 0.3)
        volts = twin.servos.register(1, "present_input_voltage") / 10
        assert low_v < volts < high_v
    twin.servo_supplies["main"].ramp_to(11.5, twin.now_ns)
    step_for(twin, 0.3)
    assert twin.servos.register(1, "present_input_voltage") == 115
    twin.servo_supplies["main"].ramp_to(twin.servo_supplies["main"].usual_v, twin.now_ns)
    step_for(twin, 0.3)
    assert twin.servo_supplies["main"].volts(twin.now_ns) == pytest.approx(battery.voltage_v)


def test_it_charges_where_the_station_is_and_nowhere_else(twin: Twin) -> None:
    battery = twin.battery
    assert battery is not None
    for x_m, yaw_rad, charges in (
        *((0.45, 0.0, True), (0.55, 0.1, True)),
        *((0.75, 0.0, False), (0.45, math.pi, False)),
    ):
        twin.engine.place("base", x_m, 2.55, 0.0, yaw_rad)
        step_for(twin, 0.15)
        assert battery.is_charging is charges, (x_m, yaw_rad)


def test_its_gauge_fails_as_others_do_and_comes_back(
    butler: RobotDescription, tmp_path: Path
) -> None:
    with closing(Twin(butler)) as twin:
        battery, source = twin.battery, PowerSupplySource(Tree(tmp_path))
        assert battery is not None
        battery.serve(tmp_path)

        def charge() -> Reading:
            step_for(twin, 1.1)
            return next(one for one in source.readings() if one.name == CHARGE)

        assert charge().value == pytest.approx(0.8, abs=0.01)
        twin.faults.inject("battery", None, "brown_out", charge_ratio=0.3)
        assert charge().value == pytest.approx(0.3, abs=0.01)
        for fault, why in (("unplug", "no battery is in"), ("garbage", "expected a number")):
            handle = twin.faults.inject("battery", None, fault)
            assert why in charge().reason
            handle.clear()
            assert charge().value == pytest.approx(0.3, abs=0.01)
        twin.faults.inject("battery", None, "stuck")
        battery.charge_ratio = 0.9
        assert charge().value == pytest.approx(0.3, abs=0.01)


def test_a_robot_without_a_battery_has_none_of_its_faults(butler: RobotDescription) -> None:
    with (
        closing(Twin(replace(butler, battery=None))) as twin,
        pytest.raises(FaultRefused, match=r"has no \[battery\]"),
    ):
        twin.faults.inject("battery", None, "unplug")
