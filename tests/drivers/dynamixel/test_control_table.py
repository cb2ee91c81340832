"""The register maps are consistent, and their round trip is exact."""

import pytest

from drivers.dynamixel.tables.control_table import (
    BAUD_RATES,
    MODELS,
    MODELS_BY_NUMBER,
    OperatingMode,
    ServoDatasheet,
)
from drivers.servo.hardware_error import HardwareError

ALL_MODELS = pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)


@ALL_MODELS
def test_registers_do_not_overlap_and_are_found_by_address(model: ServoDatasheet) -> None:
    end = 0
    for register in model.registers.values():
        assert register.address >= end
        end = register.address + register.size
        assert model.registers_by_address[register.address] is register


@ALL_MODELS
def test_the_block_read_each_cycle_has_no_gap(model: ServoDatasheet) -> None:
    effort = model.registers_by_address[126]
    assert effort.name == ("present_load" if model.current_unit_a is None else "present_current")
    assert effort.size == 2
    assert model.registers["present_velocity"].address == 128
    assert model.registers["present_position"].address == 132
    assert model.registers["present_position"].size == 4


@ALL_MODELS
def test_eeprom_ends_where_ram_begins(model: ServoDatasheet) -> None:
    assert all(register.eeprom == (register.address < 64) for register in model.registers.values())


@ALL_MODELS
def test_initial_values_are_in_range_and_limits_fit_the_bytes(model: ServoDatasheet) -> None:
    for register in model.registers.values():
        limits = (register.minimum, register.initial, register.maximum)
        known = [value for value in limits if value is not None]
        assert known == sorted(known), register.name
        assert [register.from_bytes(register.to_bytes(value)) for value in known] == known


def test_models_are_distinguished_by_their_numbers() -> None:
    numbers = {model.number: model.name for model in MODELS_BY_NUMBER.values()}
    assert len(numbers) == len(MODELS)
    assert numbers == {
        1010: "XH430-W210",
        1020: "XM430-W350",
        1030: "XM430-W210",
        1060: "XL430-W250",
        1070: "XC430-W150",
        1090: "2XL430-W250",
        1100: "XH540-W270",
        1110: "XH540-W150",
        1120: "XM540-W270",
        1160: "2XC430-W250",
        1190: "XL330-M077",
        1200: "XL330-M288",
        1210: "XC330-T181",
        1220: "XC330-T288",
        1230: "XC330-M181",
        1240: "XC330-M288",
    }


def test_a_smaller_series_differs_where_its_pages_say() -> None:
    registers = MODELS["XL330-M288"].registers
    assert registers["baud_rate"].maximum == 6
    assert registers["current_limit"].initial == 1750
    assert registers["min_voltage_limit"].initial == 35
    assert registers["pwm_slope"].address == 62
    assert registers["shutdown"].initial == 53
    assert MODELS["XL330-M288"].current_unit_a == pytest.approx(1e-3)
    assert "pwm_slope" not in MODELS["XM430-W350"].registers
    assert "startup_configuration" not in MODELS["2XL430-W250"].registers


@pytest.mark.parametrize(
    ("name", "firmware", "banks"),
    [
        ("XM430-W350", 45, [(168, 224, 28), (578, 634, 28)]),
        ("XL330-M288", 52, [(168, 208, 20)]),
        ("XL330-M288", 53, [(168, 224, 28)]),
    ],
)
def test_indirect_slots_are_where_model_and_firmware_put_them(
    name: str, firmware: int, banks: list[tuple[int, int, int]]
) -> None:
    found = MODELS[name].indirect_banks(firmware)
    assert [(bank.addresses, bank.data, bank.slots) for bank in found] == banks


@pytest.mark.parametrize(
    ("name", "firmware", "has"),
    [
        ("XM430-W350", 44, False),
        ("XM430-W350", 45, True),
        ("XL330-M077", 45, False),
        ("XL330-M077", 46, True),
        ("2XL430-W250", 99, False),
    ],
)
def test_fast_sync_read_needs_a_model_and_a_firmware(name: str, firmware: int, has: bool) -> None:
    assert MODELS[name].has_fast_sync(firmware) is has


def test_models_without_current_sensing_have_no_current_modes() -> None:
    assert OperatingMode.CURRENT in MODELS["XM430-W350"].operating_modes
    assert OperatingMode.CURRENT not in MODELS["XL430-W250"].operating_modes
    assert "goal_current" not in MODELS["XC430-W150"].registers


def test_one_ampere_of_stall_current_is_its_share_of_effort() -> None:
    model = MODELS["XM430-W350"]
    assert model.effort_unit_ratio * round(2.3 / 2.69e-3) == pytest.approx(1.0, abs=1e-3)
    assert MODELS["XL430-W250"].effort_unit_ratio * 1000 == pytest.approx(1.0)


def test_negative_values_are_two_s_complement() -> None:
    velocity = MODELS["XL430-W250"].registers["present_velocity"]
    assert velocity.from_bytes(b"\xfd\xff\xff\xff") == -3
    assert MODELS["XL430-W250"].registers["bus_watchdog"].from_bytes(b"\xff") == -1


def test_documented_constants() -> None:
    assert BAUD_RATES[3] == 1_000_000
    assert HardwareError(52) == (
        HardwareError.OVERLOAD | HardwareError.ELECTRICAL_SHOCK | HardwareError.OVERHEATING
    )
