"""A gauge is read as its driver shows it; what it does not tell is missing with a reason."""

import errno
import shutil
from collections.abc import Mapping
from pathlib import Path

import pytest

from platforms.probes.battery import (
    CHARGE,
    CHARGING,
    CURRENT,
    FOLDER,
    VOLTAGE,
    PowerSupplySource,
)
from platforms.probes.reading import Reading
from platforms.tree import Tree

# As drivers show one: sbs-battery, an ACPI laptop by energy, a max17042 by charge.
SMART = {"type": "Battery", "status": "Discharging", "capacity": "63",
         "voltage_now": "25900000", "current_now": "-2100000"}  # fmt: skip
LAPTOP = {"type": "Battery", "status": "Charging", "energy_now": "30000000",
          "energy_full": "60000000", "voltage_now": "12000000",
          "power_now": "24000000"}  # fmt: skip
GAUGE = {"type": "Battery", "status": "Full", "charge_now": "4000000", "charge_full": "4000000",
         "voltage_now": "4200000", "current_now": "0"}  # fmt: skip
MOUSE = {**SMART, "scope": "Device", "capacity": "7"}


def lay_out(root: Path, **supplies: Mapping[str, str]) -> Path:
    for name, files in supplies.items():
        folder = root / FOLDER.lstrip("/") / name
        folder.mkdir(parents=True)
        for file, text in files.items():
            (folder / file).write_text(f"{text}\n")
    return root


def read(root: Path, name: str = "") -> dict[str, Reading]:
    return {one.name: one for one in PowerSupplySource(Tree(root), name).readings()}


@pytest.mark.parametrize(
    ("files", "charge", "volts", "amperes", "charging"),
    [
        (SMART, 0.63, 25.9, -2.1, 0.0),
        ({**SMART, "current_now": "2100000"}, 0.63, 25.9, -2.1, 0.0),  # drivers differ in the sign
        (LAPTOP, 0.5, 12.0, 2.0, 1.0),
        (GAUGE, 1.0, 4.2, 0.0, 0.0),
    ],
)
def test_charge_voltage_current_and_state_are_read(
    tmp_path: Path,
    files: Mapping[str, str],
    charge: float,
    volts: float,
    amperes: float,
    charging: float,
) -> None:
    found = read(lay_out(tmp_path, pack=files))
    values = [found[name].value for name in (CHARGE, VOLTAGE, CURRENT, CHARGING)]
    assert values == pytest.approx([charge, volts, amperes, charging])


def test_the_first_battery_is_taken_that_is_no_mouses_or_the_one_that_is_named(
    tmp_path: Path,
) -> None:
    mains = {"type": "Mains", "online": "1"}
    root = lay_out(tmp_path, a_mouse=MOUSE, ac=mains, pack=SMART, spare={**SMART, "capacity": "9"})
    assert read(root)[CHARGE].value == 0.63
    assert read(root, "spare")[CHARGE].value == 0.09


@pytest.mark.parametrize(
    ("changes", "name", "reason"),
    [
        ({"capacity": "many"}, CHARGE, "holds 'many', expected a number"),
        ({"capacity": "255"}, CHARGE, "holds 255, expected 0 to 100 %"),
        ({"voltage_now": ""}, VOLTAGE, "is empty, expected a number"),
        ({"status": "Unknown"}, CHARGING, "holds 'Unknown', expected one of Charging"),
        ({"status": "Unknown"}, CURRENT, "holds 'Unknown', expected one of Charging"),
    ],
)
def test_garbage_is_missing_with_its_reason_and_the_rest_is_read(
    tmp_path: Path, changes: Mapping[str, str], name: str, reason: str
) -> None:
    found = read(lay_out(tmp_path, pack={**SMART, **changes}))
    assert found[name].value is None
    assert reason in found[name].reason
    assert any(one.value is not None for one in found.values())


def test_a_gauge_that_sleeps_or_goes_is_missing_until_it_is_back(
    tmp_path: Path, failing_reads: dict[Path, int]
) -> None:
    root = lay_out(tmp_path, pack=SMART)
    folder = root / FOLDER.lstrip("/") / "pack"
    source = PowerSupplySource(Tree(root))
    assert {one.name: one.value for one in source.readings()}[CHARGE] == 0.63
    failing_reads[folder / "capacity"] = errno.EAGAIN
    asleep = {one.name: one for one in source.readings()}
    assert asleep[CHARGE].reason.endswith(f"{FOLDER}/pack/capacity is asleep")
    assert asleep[VOLTAGE].value == 25.9
    failing_reads.clear()
    shutil.rmtree(folder)
    for one in source.readings():
        assert one.value is None
        assert one.reason == f"missing, because no battery is in {FOLDER}, which has: nothing"
    lay_out(tmp_path, pack=SMART)
    assert {one.name: one.value for one in source.readings()}[CHARGE] == 0.63
