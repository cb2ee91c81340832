"""Connect to drives that are not as they should be, or whose EDS file, mode or mapping differ."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drivers.canopen import EDS_PATH, DriveMode, DriveSpec
from drivers.canopen.eds import DriveDictionary
from drivers.canopen.objects import (
    HEARTBEAT_CONSUMER,
    HEARTBEAT_PRODUCER,
    IDENTITY,
    INTERPOLATION_PERIOD,
    MODE_DISPLAY,
    MODE_OF_OPERATION,
    SUPPORTED_MODES,
    TPDO2,
)
from drivers.errors import DeviceMissing, NoReply, WrongDevice
from sim_twin.can import MotorMounting, WheelDrive

MakeBench = Callable[..., Any]
LEFT = DriveSpec(node_id=1, joint="left")
RIGHT = DriveSpec(node_id=2, joint="right")
CYCLIC = DriveSpec(node_id=1, joint="left", mode=DriveMode.CYCLIC_SYNCHRONOUS_VELOCITY)


def eds_without(tmp_path: Path, *indices: int) -> Path:
    """Return an EDS file that lacks objects."""
    text = EDS_PATH.read_text()
    for index in indices:
        text = re.sub(rf"\[{index:04X}(sub\d+)?\]\n(?:[^\[\n].*\n|\n)*", "", text)
    path = tmp_path / "other.eds"
    path.write_text(text)
    return path


def test_a_silent_drive_is_named_with_a_remedy_after_a_bounded_wait(make_bench: MakeBench) -> None:
    bench = make_bench(LEFT, RIGHT, drives=[WheelDrive(1)])
    before_ns = bench.now_ns()
    with pytest.raises(NoReply, match=r"right \(node 2\); check power"):
        bench.bus.connect()
    assert bench.now_ns() - before_ns <= 3_100_000_000


def test_a_drive_that_dies_while_it_is_configured_is_named(single: Any) -> None:
    drive = single.drives[0]
    drive._objects.on_write[HEARTBEAT_PRODUCER, 0] = lambda value: drive.set_supply(on=False)
    with pytest.raises(NoReply, match=r"drive left \(node 1\): writing"):
        single.bus.connect()


def test_a_drive_without_a_heartbeat_is_not_connected(
    single: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(single.drives[0]._producer, "due", lambda now_ns: False)
    with pytest.raises(NoReply, match=r"sends process data and heartbeats.*left \(node 1\).*check"):
        single.bus.connect()


@pytest.mark.parametrize(
    ("spec", "key", "value", "reason"),
    [
        (LEFT, (IDENTITY, 2), 0x1234, "product 0x1018:2 is 0x1234, expected 0x57484C31"),
        (LEFT, (0x1A01, 2), 0x60780010, "PDO mapping 0x1A01:2 is 0x60780010"),
        (CYCLIC, (SUPPORTED_MODES, 0), 4, r"0x4 \(0x6502\), not cyclic synchronous velocity"),
        (CYCLIC, (MODE_DISPLAY, 0), 3, "display 0x6061 is 3, expected 9"),
    ],
    ids=["product", "mapping", "supported modes", "mode display"],
)
def test_a_drive_that_shows_another_value_is_the_wrong_device(
    make_bench: MakeBench, spec: DriveSpec, key: tuple[int, int], value: int, reason: str
) -> None:
    bench = make_bench(spec)
    bench.drives[0]._objects.live[key] = lambda: value
    with pytest.raises(WrongDevice, match=reason):
        bench.bus.connect()


def test_another_encoder_is_the_wrong_device(make_bench: MakeBench) -> None:
    bench = make_bench(drives=[WheelDrive(1, MotorMounting(counts_per_rev=4096))])
    with pytest.raises(WrongDevice, match="encoder increments 0x608F:1 is 0x1000, expected 0x4000"):
        bench.bus.connect()


def test_a_refused_parameter_names_object_and_value(make_bench: MakeBench) -> None:
    bench = make_bench(DriveSpec(node_id=1, joint="left", acceleration_rad_s2=1e-5))
    with pytest.raises(WrongDevice, match=r"node 1: 0x6083:0 .* takes 1..2147483647, not 0"):
        bench.bus.connect()


def test_heartbeats_are_configured_both_ways(single: Any) -> None:
    single.bus.connect()
    assert single.value(HEARTBEAT_PRODUCER) == 25
    assert single.value(HEARTBEAT_CONSUMER, 1) == 0x7F << 16 | 100


def test_two_drives_with_one_node_id_are_refused(make_bench: MakeBench) -> None:
    with pytest.raises(ValueError, match="share a node id"):
        make_bench(LEFT, LEFT)


def test_a_strange_mapping_is_rewritten_and_works(single: Any) -> None:
    objects = single.drives[0]._objects
    changed = {(0x1A01, 1): 0x60770010, (0x1A01, 2): 0x60640020, (0x1800, 2): 255}
    reset = objects.reset

    def reset_to_others(**options: Any) -> None:
        reset(**options)
        for key, value in changed.items():
            objects.set(*key, value)

    objects.reset = reset_to_others
    single.bus.connect()
    assert [single.value(0x1A01, row) for row in range(3)] == [2, *TPDO2.entries]
    assert single.value(0x1800, 2) == 1
    single.bus.enable()
    assert single.run(0.8, [3.0]).velocity_rad_s == pytest.approx([3.0], abs=0.05)


def test_a_right_mapping_is_not_written_again(single: Any) -> None:
    objects = single.drives[0]._objects
    written: list[tuple[int, int]] = []
    write = objects.write

    def listen(index: int, subindex: int, data: bytes) -> None:
        written.append((index, subindex))
        write(index, subindex, data)

    objects.write = listen
    single.bus.connect()
    assert written
    assert not any(0x1400 <= index < 0x1C00 for index, _ in written)


def test_cyclic_synchronous_velocity_is_chosen_shown_and_driven(make_bench: MakeBench) -> None:
    bench = make_bench(CYCLIC)
    bench.bus.connect()
    assert bench.value(MODE_OF_OPERATION) == bench.value(MODE_DISPLAY) == 9
    assert bench.value(INTERPOLATION_PERIOD, 1) == 4
    assert bench.bus.notes == ()
    bench.bus.enable()
    assert bench.run(0.8, [3.0]).velocity_rad_s == pytest.approx([3.0], abs=0.05)


def test_what_an_eds_file_lacks_is_named_all_at_once(make_bench: MakeBench, tmp_path: Path) -> None:
    bench = make_bench(eds_path=eds_without(tmp_path, 0x60FF, 0x1016))
    with pytest.raises(WrongDevice, match=r"0x1016:1 watch over .*0x60FF of 32 bits"):
        bench.bus.connect()


def test_a_drive_without_torque_and_stop_options_runs_and_says_what_is_missing(
    make_bench: MakeBench, tmp_path: Path
) -> None:
    bench = make_bench(eds_path=eds_without(tmp_path, 0x6077, 0x6007))
    bench.bus.connect()
    bench.bus.enable()
    state = bench.run(0.8, [3.0])
    assert state.enabled
    assert np.isnan(state.torque_nm).all()
    assert state.velocity_rad_s == pytest.approx([3.0], abs=0.05)
    assert bench.value(0x1A01, 0) == 1
    assert [note.split(":")[0] for note in bench.bus.notes] == [
        "drive left (node 1) has no 0x6007",
        "drive left (node 1) has no 0x6077",
    ]


def test_an_object_that_cannot_be_mapped_is_named(make_bench: MakeBench, tmp_path: Path) -> None:
    head, tail = EDS_PATH.read_text().split("[606C]\n")
    path = tmp_path / "other.eds"
    path.write_text(f"{head}[606C]\n{tail.replace('PDOMapping=1', 'PDOMapping=0', 1)}")
    with pytest.raises(WrongDevice, match="0x606C of 32 bits that can be mapped"):
        make_bench(eds_path=path).bus.connect()


def test_a_missing_eds_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(DeviceMissing, match=r"none\.eds .*does not exist"):
        DriveDictionary(tmp_path / "none.eds", 1)


@pytest.mark.parametrize("text", ["no eds", "[1000]\nObjectType=7\n", "\x00\xff"])
def test_a_file_that_is_no_eds_file_is_refused_or_lacks_all(
    make_bench: MakeBench, tmp_path: Path, text: str
) -> None:
    path = tmp_path / "bad.eds"
    path.write_text(text)
    with pytest.raises(WrongDevice):
        make_bench(eds_path=path).bus.connect()


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
