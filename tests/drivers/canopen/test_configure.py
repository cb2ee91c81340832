"""Configure drives whose EDS file, mode or process data are not the usual ones."""

import re
from pathlib import Path
from typing import Any

import can
import numpy as np
import pytest

from drivers.canopen import EDS_PATH, DriveMode, DriveSpec, WheelDriveBus
from drivers.canopen.eds import DriveDictionary
from drivers.canopen.error_codes import CODE_RULES, CODE_TEXTS, GROUP_RULES, code_text, reset_rule
from drivers.canopen.objects import (
    INTERPOLATION_PERIOD,
    MODE_DISPLAY,
    MODE_OF_OPERATION,
    SUPPORTED_MODES,
    TPDO2,
)
from drivers.errors import DeviceMissing, WrongDevice
from drivers.wheel_drives.bus import ResetRule
from sim_twin.can import MemoryBus, WheelDrive
from sim_twin.can.free_wheel import FreeWheel, FreeWheelWorld

CYCLIC = DriveMode.CYCLIC_SYNCHRONOUS_VELOCITY
LEFT = DriveSpec(node_id=1, joint="left")


class Setup:
    """One drive and its driver."""

    def __init__(self, spec: DriveSpec = LEFT, eds_path: Path = EDS_PATH) -> None:
        self.drive = WheelDrive(1)
        self.world = FreeWheelWorld([FreeWheel(self.drive)])
        bus = MemoryBus(self.world.wire)
        self.bus = WheelDriveBus(bus, self.world, [spec], heartbeat_s=0.1, eds_path=eds_path)

    def value(self, index: int, subindex: int = 0) -> int:
        return self.drive._objects.get(index, subindex)

    def boots_with(self, changed: dict[tuple[int, int], int]) -> None:
        """Let the drive come up with other values than its EDS file says."""
        reset = self.drive._objects.reset

        def altered(**options: Any) -> None:
            reset(**options)
            for key, value in changed.items():
                self.drive._objects.set(*key, value)

        self.drive._objects.reset = altered  # type: ignore[method-assign]

    def run(self, ticks: int, velocity: float) -> Any:
        for _ in range(ticks):
            state = self.bus.cycle(np.array([velocity]))
            self.world.sleep_until(self.world.now_ns() + 4_000_000)
        return state


def without(tmp_path: Path, *indices: int) -> Path:
    """Return an EDS file that lacks objects."""
    text = EDS_PATH.read_text()
    for index in indices:
        text = re.sub(rf"\[{index:04X}(sub\d+)?\]\n(?:[^\[\n].*\n|\n)*", "", text)
    path = tmp_path / "other.eds"
    path.write_text(text)
    return path


def test_a_strange_mapping_is_rewritten_and_works() -> None:
    setup = Setup()
    setup.boots_with({(0x1A01, 1): 0x60770010, (0x1A01, 2): 0x60640020, (0x1800, 2): 255})
    setup.bus.connect()
    assert [setup.value(0x1A01, row) for row in range(3)] == [2, *TPDO2.entries]
    assert setup.value(0x1800, 2) == 1
    setup.bus.enable()
    assert setup.run(200, 3.0).velocity_rad_s == pytest.approx([3.0], abs=0.05)
    setup.bus.close()


def test_a_right_mapping_is_not_written_again() -> None:
    setup = Setup()
    written: list[tuple[int, int]] = []
    write = setup.drive._objects.write

    def listen(index: int, subindex: int, data: bytes) -> None:
        written.append((index, subindex))
        write(index, subindex, data)

    setup.drive._objects.write = listen  # type: ignore[method-assign]
    setup.bus.connect()
    assert not any(0x1400 <= index < 0x1C00 for index, _ in written)
    setup.bus.close()


def test_cyclic_synchronous_velocity_is_chosen_shown_and_driven() -> None:
    setup = Setup(DriveSpec(node_id=1, joint="left", mode=CYCLIC))
    setup.bus.connect()
    assert setup.value(MODE_OF_OPERATION) == setup.value(MODE_DISPLAY) == 9
    assert setup.value(INTERPOLATION_PERIOD, 1) == 4
    assert setup.bus.notes == ()
    setup.bus.enable()
    assert setup.run(200, 3.0).velocity_rad_s == pytest.approx([3.0], abs=0.05)
    setup.bus.close()


def test_a_mode_that_the_drive_does_not_support_is_refused() -> None:
    setup = Setup(DriveSpec(node_id=1, joint="left", mode=CYCLIC))
    setup.drive._objects.live[SUPPORTED_MODES, 0] = lambda: 0x4
    with pytest.raises(WrongDevice, match=r"0x4 \(0x6502\), not cyclic synchronous velocity"):
        setup.bus.connect()
    setup.bus.close()


def test_a_mode_that_is_not_taken_over_is_noticed_on_the_display() -> None:
    setup = Setup(DriveSpec(node_id=1, joint="left", mode=CYCLIC))
    setup.drive._objects.live[MODE_DISPLAY, 0] = lambda: 3
    with pytest.raises(WrongDevice, match="display 0x6061 is 3, expected 9"):
        setup.bus.connect()
    setup.bus.close()


def test_what_an_eds_file_lacks_is_named_all_at_once(tmp_path: Path) -> None:
    setup = Setup(eds_path=without(tmp_path, 0x60FF, 0x1016))
    with pytest.raises(WrongDevice, match=r"0x1016:1 watch over .*0x60FF of 32 bits"):
        setup.bus.connect()
    setup.bus.close()


def test_a_drive_without_torque_and_stop_options_runs_and_says_what_is_missing(
    tmp_path: Path,
) -> None:
    setup = Setup(eds_path=without(tmp_path, 0x6077, 0x6007))
    setup.bus.connect()
    setup.bus.enable()
    state = setup.run(200, 3.0)
    assert state.enabled
    assert np.isnan(state.torque_nm).all()
    assert state.velocity_rad_s == pytest.approx([3.0], abs=0.05)
    assert setup.value(0x1A01, 0) == 1
    assert [note.split(":")[0] for note in setup.bus.notes] == [
        "drive left (node 1) has no 0x6007",
        "drive left (node 1) has no 0x6077",
    ]
    setup.bus.close()


def test_an_object_that_cannot_be_mapped_is_named(tmp_path: Path) -> None:
    text = EDS_PATH.read_text()
    head, tail = text.split("[606C]\n")
    path = tmp_path / "other.eds"
    path.write_text(f"{head}[606C]\n{tail.replace('PDOMapping=1', 'PDOMapping=0', 1)}")
    setup = Setup(eds_path=path)
    with pytest.raises(WrongDevice, match="0x606C of 32 bits that can be mapped"):
        setup.bus.connect()
    setup.bus.close()


def test_a_missing_eds_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(DeviceMissing, match=r"none\.eds .*does not exist"):
        DriveDictionary(tmp_path / "none.eds", 1)


@pytest.mark.parametrize("text", ["no eds", "[1000]\nObjectType=7\n", "\x00\xff"])
def test_a_file_that_is_no_eds_file_is_refused_or_lacks_all(tmp_path: Path, text: str) -> None:
    path = tmp_path / "bad.eds"
    path.write_text(text)
    setup = Setup(eds_path=path)
    with pytest.raises(WrongDevice):
        setup.bus.connect()
    setup.bus.close()


def test_values_are_checked_against_the_declared_range_and_type() -> None:
    dictionary = DriveDictionary(EDS_PATH, 1)
    assert dictionary.encode(0x6060, 0, -1) == b"\xff"
    with pytest.raises(WrongDevice, match=r"takes 0\.\.3, not 4"):
        dictionary.encode(0x6007, 0, 4)
    with pytest.raises(WrongDevice, match="does not take 300"):
        dictionary.encode(0x6060, 0, 300)
    assert not dictionary.has(0x5FFF)
    assert dictionary.mappable(0x60FF, 32)
    assert not dictionary.mappable(0x60FF, 16)


def test_every_listed_code_has_a_rule_and_damage_is_never_reset() -> None:
    assert all(reset_rule(code) for code in CODE_TEXTS)
    assert set(CODE_RULES) <= set(CODE_TEXTS)
    assert reset_rule(0x2340) is reset_rule(0x5410) is ResetRule.NEVER
    assert reset_rule(0x8130) is ResetRule.AUTOMATIC
    assert reset_rule(0x3220) is reset_rule(0xFF42) is ResetRule.OPERATOR
    assert set(GROUP_RULES.values()) == {ResetRule.NEVER}


def test_an_unlisted_code_is_told_by_its_group() -> None:
    assert code_text(0x2399) == "0x2399 current at the motor"
    assert code_text(0x7999) == "0x7999 additional modules"
    assert code_text(0xE000) == "0xE000 reserved code"


@pytest.mark.parametrize(("code", "stays"), [(0x8140, False), (0x4310, True)])
def test_only_a_communication_fault_found_at_connect_is_reset_without_the_operator(
    code: int, stays: bool
) -> None:
    setup = Setup()

    def fail_at_start(frame: can.Message) -> None:
        if frame.arbitration_id == 0 and frame.data[0] == 0x01:
            setup.drive.raise_fault(code)

    setup.world.wire.attach(fail_at_start)
    setup.bus.connect()
    assert setup.run(20, 0.0).faulted == (stays,)
    setup.bus.close()
