"""The keeper publishes what is measured, or why it is not, and never waits for a gauge."""

import shutil
from concurrent.futures import Executor, Future
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from drivers.clock import NS_PER_S
from sim_twin.contracts.payloads import payload_faults
from sim_twin.contracts.scripted import ManualClock
from vla_deploy.ipc import SharedSpace, topics
from vla_deploy.robots.battery_settings import BatterySettings, BatterySource
from vla_deploy.runtime.executors import InlineExecutor
from vla_deploy.supervisor.battery import open_battery

GAUGE = BatterySettings(source=BatterySource.POWER_SUPPLY, capacity_wh=240.0, cells=7)
SERVOS = replace(
    GAUGE, source=BatterySource.SERVOS, cells=3, cell_curve=((3.0, 0.0), (3.7, 0.5), (4.2, 1.0))
)
FILES = {"type": "Battery", "status": "Discharging", "capacity": "63",
         "voltage_now": "25900000", "current_now": "2000000"}  # fmt: skip


class HungExecutor(InlineExecutor):
    """Take work while a gauge hangs: it ends when the test lets it."""

    def __init__(self) -> None:
        self.hangs = True
        self.waiting: list[Future[Any]] = []

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> "Future[Any]":
        if not self.hangs:
            return super().submit(fn, *args, **kwargs)
        self.waiting.append(Future())
        return self.waiting[-1]


class Battery:
    """A keeper on a clock of its own, whose files and topics a test writes."""

    def __init__(self, root: Path, settings: BatterySettings, executor: Executor) -> None:
        self.clock = ManualClock(NS_PER_S)
        self.folder = root / "sys/class/power_supply/pack"
        self.space = SharedSpace(root / "ipc", self.clock)
        self.control = self.space.cell_writer("control_status")
        self.keeper = open_battery(settings, self.space, self.clock, root, executor)

    def files(self, **changes: str) -> None:
        self.folder.mkdir(parents=True, exist_ok=True)
        for name, text in {**FILES, **changes}.items():
            (self.folder / name).write_text(text)

    def servo_volts(self, *volts: float | None) -> None:
        self.control.put_document({"joints": {"voltage_v": list(volts)}})

    def after(self, seconds: int = 1) -> dict[str, Any]:
        for _ in range(seconds):
            self.clock.ns += NS_PER_S
            self.keeper.step()
        sample = self.space.cell_reader(topics.BATTERY).latest()
        assert sample is not None
        assert payload_faults(self.space)["battery"] == []
        return {**sample.document()}


def test_what_the_gauge_tells_is_published_and_a_low_one_once_it_has_lasted(tmp_path: Path) -> None:
    battery = Battery(tmp_path, GAUGE, InlineExecutor())
    battery.files()
    told = battery.after()
    assert (told["charge_ratio"], told["voltage_v"], told["current_a"]) == (0.63, 25.9, -2.0)
    assert (told["is_charging"], told["is_estimate"], told["low"]) == (False, False, False)
    battery.files(capacity="20")
    assert not battery.after(4)["low"]
    assert battery.after(2)["low"]
    battery.files(capacity="5")
    assert battery.after(7)["critical"]
    battery.files(capacity="30", status="Charging")
    told = battery.after()
    assert (told["low"], told["critical"], told["is_charging"]) == (False, False, True)


@pytest.mark.parametrize(
    ("changes", "key", "why"),
    [
        ({"capacity": "?!"}, "charge_ratio", "holds '?!', expected a number"),
        ({"status": "Unknown"}, "is_charging", "holds 'Unknown'"),
    ],
)
def test_garbage_of_the_gauge_is_missing_with_its_reason(
    tmp_path: Path, changes: dict[str, str], key: str, why: str
) -> None:
    battery = Battery(tmp_path, GAUGE, InlineExecutor())
    battery.files(**changes)
    told = battery.after()
    assert told[key] is None
    assert why in told["missing"][key]
    assert told["voltage_v"] == 25.9


def test_a_gauge_that_goes_leaves_its_reason_and_the_level_as_it_was(tmp_path: Path) -> None:
    battery = Battery(tmp_path, GAUGE, InlineExecutor())
    battery.files(capacity="20")
    assert battery.after(8)["low"]
    shutil.rmtree(battery.folder)
    told = battery.after(8)
    assert (told["charge_ratio"], told["voltage_v"], told["is_charging"]) == (None, None, None)
    assert "no battery is in /sys/class/power_supply" in told["missing"]["charge_ratio"]
    assert told["low"]


def test_where_the_gauge_knows_no_charge_the_curve_estimates_one(tmp_path: Path) -> None:
    settings = replace(GAUGE, cell_curve=((3.0, 0.0), (3.7, 0.5), (4.2, 1.0)))
    battery = Battery(tmp_path, settings, InlineExecutor())
    battery.files(capacity="none")
    told = battery.after()
    assert (told["charge_ratio"], told["is_estimate"]) == (pytest.approx(0.5), True)
    assert "charge_ratio" not in told["missing"]


def test_a_gauge_that_hangs_holds_nothing_up_and_is_taken_up_again(tmp_path: Path) -> None:
    executor = HungExecutor()
    battery = Battery(tmp_path, GAUGE, executor)
    battery.files()
    told = battery.after(9)
    assert len(executor.waiting) == 1, "a gauge that hangs is not asked again"
    assert told["missing"]["charge_ratio"].endswith("the gauge has not answered for 8 s")
    executor.waiting[0].set_exception(OSError("the bus was reset"))
    assert "failed: OSError('the bus was reset')" in battery.after()["missing"]["charge_ratio"]
    executor.hangs = False
    executor.waiting[1].set_exception(OSError("the bus was reset"))
    assert battery.after()["charge_ratio"] == 0.63


def test_servos_tell_a_voltage_and_the_curve_a_charge_that_is_called_an_estimate(
    tmp_path: Path,
) -> None:
    battery = Battery(tmp_path, SERVOS, InlineExecutor())
    battery.servo_volts(11.1, None, 11.2, 11.0)
    told = battery.after()
    assert (told["voltage_v"], told["charge_ratio"], told["is_estimate"]) == (11.1, 0.5, True)
    assert (told["current_a"], told["is_charging"]) == (None, None)
    assert told["missing"]["is_charging"] == "servos measure the voltage only"


def test_a_moment_under_load_hardly_moves_the_estimate(tmp_path: Path) -> None:
    battery = Battery(tmp_path, SERVOS, InlineExecutor())
    for _ in range(29):
        battery.servo_volts(11.1)
        battery.after()
    battery.servo_volts(9.0)
    assert battery.after()["charge_ratio"] == pytest.approx(0.5, abs=0.04)


def test_a_control_that_falls_silent_measures_nothing(tmp_path: Path) -> None:
    battery = Battery(tmp_path, SERVOS, InlineExecutor())
    assert "control tells no voltage" in battery.after()["missing"]["voltage_v"]
    battery.servo_volts(11.1)
    assert battery.after()["voltage_v"] == 11.1
    told = battery.after(3)  # its topic has grown stale
    assert told["voltage_v"] is None
    assert told["missing"]["voltage_v"] == "missing, because control tells no voltage of the servos"
