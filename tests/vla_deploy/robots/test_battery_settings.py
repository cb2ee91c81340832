"""A [battery] table is judged like the rest of the robot file, and a robot may have none."""

import re
from pathlib import Path

import pytest

from vla_deploy.robots import RobotFileError, load_robot
from vla_deploy.robots.battery_settings import AtLow, BatterySource

TABLE = re.compile(r"^\[battery\]\n(?:.+\n)*", re.MULTILINE)


def with_table(file: Path, table: str) -> Path:
    text, count = TABLE.subn(table, file.read_text(encoding="utf-8"))
    assert count == 1
    file.write_text(text, encoding="utf-8")
    return file


def test_the_shipped_robot_declares_its_pack_and_where_it_charges() -> None:
    battery = load_robot("butler").battery
    assert battery is not None
    assert (battery.source, battery.at_low) == (BatterySource.POWER_SUPPLY, AtLow.ANNOUNCE)
    assert battery.station == "charging_station"
    assert (battery.cell_curve[0][1], battery.cell_curve[-1][1]) == (0.0, 1.0)


def test_a_robot_without_the_table_has_no_battery(butler_copy: Path) -> None:
    assert load_robot(with_table(butler_copy, "")).battery is None


SERVOS = '[battery]\nsource = "servos"\ncapacity_wh = 50\ncells = 3\n'
CURVE = "cell_curve = [[3.0, 0.0], [4.2, 1.0]]\n"


def test_two_points_of_a_curve_and_no_station_will_do(butler_copy: Path) -> None:
    battery = load_robot(with_table(butler_copy, SERVOS + CURVE)).battery
    assert battery is not None
    assert (battery.cell_curve, battery.station) == (((3.0, 0.0), (4.2, 1.0)), "")
    assert (battery.low_ratio, battery.critical_ratio) == (0.25, 0.1)


@pytest.mark.parametrize(
    ("table", "key", "words"),
    [
        ("[battery]\n", "battery.source", "one of power_supply, servos"),
        (SERVOS, "battery.cell_curve", "servos measure a voltage only"),
        (SERVOS + "cell_curve = [[3.0, 0.0], [2.9, 1.0]]\n", "battery.cell_curve", "both rising"),
        (SERVOS + "cell_curve = [[3.0, 0.1], [4.2, 1.0]]\n", "battery.cell_curve", "from a charge"),
        (SERVOS + "cell_curve = 3.0\n", "battery.cell_curve", "pairs"),
        (SERVOS + CURVE + "low_ratio = 0.1\n", "battery.critical_ratio", "below low_ratio 0.1"),
        (SERVOS + CURVE + "low_ratio = 25\n", "battery.low_ratio", "a number in 0..1"),
        (SERVOS + CURVE + 'supply = "BAT0"\n', "battery.supply", 'source = "power_supply"'),
        (SERVOS + CURVE + 'station = "attic"\n', "battery.station", "a place: bedroom"),
        (SERVOS + CURVE + 'at_low = "charge"\n', "battery.station", "needs it"),
        (SERVOS + CURVE + 'at_low = "panic"\n', "battery.at_low", "one of announce, charge"),
        (SERVOS.replace("servos", "power_supply") + 'supply = "../BAT0"\n', "battery.supply",
         "a folder's name"),
    ],
)  # fmt: skip
def test_each_fault_is_named_with_what_was_expected(
    butler_copy: Path, table: str, key: str, words: str
) -> None:
    with pytest.raises(RobotFileError) as caught:
        load_robot(with_table(butler_copy, table))
    faults = {fault.key: str(fault) for fault in caught.value.faults}
    assert words in faults[key]
