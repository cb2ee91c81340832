"""Run the servo commands as a person does, on emulated servos behind a pseudo-terminal."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from drivers.clock import MonotonicClock
from drivers.dynamixel.tables.control_table import BAUD_RATES
from drivers.recording.recording import RecordKind, read_recording
from drivers.serial_port import SerialPort
from drivers.servo.hardware_error import HardwareError
from drivers.servo.tools.bench import FoundServo
from drivers.servo.tools.scan import SpeedReport
from vla_deploy.cli.devices import servo_bus, servo_scan
from vla_deploy.cli.devices.servo_bus import SPEEDS
from vla_deploy.robots.calibration.calibration import read_calibration

from .conftest import Bus


@pytest.fixture
def bus(make_bus: Callable[..., Bus]) -> Bus:
    return make_bus(1, 3, 7)


@pytest.fixture
def servo(vla: Callable[..., Any]) -> Callable[..., Any]:
    def run(bus: Bus | None, *words: object) -> Any:
        return vla("servo", *words, *([] if bus is None else ["--port", bus.port]))

    return run


def fails(said: Any, words: str) -> None:
    assert said.code != 0
    assert words in said.err
    assert said.err.count("\n") == 1


def test_scan_lists_the_servos(bus, servo):
    said = servo(bus, "scan")
    assert said.code == 0
    assert [line.split() for line in said.out.splitlines()] == [
        ["id", "baud", "model", "firmware"],
        ["1", "1000000", "XM430-W350", "48"],
        ["3", "1000000", "XM430-W350", "48"],
        ["7", "1000000", "XM430-W350", "48"],
    ]


def test_scan_for_a_robot_names_joints_and_what_is_missing(bus, servo):
    said = servo(bus, "scan", "--robot", "butler", "--json")
    assert said.code == 1
    document = said.document
    assert [row["joint"] for row in document["servos"]] == [
        "left_shoulder_yaw",
        "left_elbow",
        "left_gripper",
    ]
    assert document["missing"][:2] == [2, 4]
    assert "no answer from servo 2 (left_shoulder_pitch), servo 4 (left_forearm_roll)" in said.err


def test_scan_finds_a_servo_of_another_model_than_declared(bus, servo):
    said = servo(bus, "scan", "--robot", "butler", "--ids", "1-1")
    fails(said, "servo 1 (left_shoulder_yaw) is XM430-W350, the robot file says XM540-W270")


def test_scan_of_a_range_asks_only_that(bus, servo):
    said = servo(bus, "scan", "--ids", "2-3", "--json")
    assert [row["id"] for row in said.document["servos"]] == [3]


@pytest.mark.parametrize(
    ("report", "words"),
    [
        ({"clashes": (5,)}, "the answers of id 5 are damaged: more than one servo has it"),
        (
            {"other_family_ids": (1, 18)},
            "id 1, 18 answers in another protocol",
        ),
        ({"noise_bytes": 9}, "bytes came at 57600 baud, but no packet"),
        ({}, "no servo answers at 57600 baud; check power, cable and port"),
    ],
)
def test_scan_ends_with_one_line_about_what_is_wrong(bus, servo, monkeypatch, report, words):
    def found(link: object, ids: object, progress: object, expected: object) -> SpeedReport:
        return SpeedReport(baud=57_600, **report)

    monkeypatch.setattr(servo_scan, "scan_speed", found)
    fails(servo(bus, "scan", "--baud", "57600"), words)


def test_scan_asks_at_every_speed_of_a_real_line_and_tells_of_servos_at_several(
    bus, servo, monkeypatch
):
    asked = []

    def found(link: object, ids: object, progress: object, expected: object) -> SpeedReport:
        asked.append(link.baud)
        one = FoundServo(
            servo_id=len(asked), model_number=1020, model_name="XM430-W350", firmware="48"
        )
        there = link.baud in (57_600, 1_000_000)
        return SpeedReport(baud=link.baud, servos=(one,) if there else ())

    monkeypatch.setattr(servo_scan, "scan_speed", found)
    monkeypatch.setattr(servo_bus.ServoBusPort, "is_pseudo_terminal", False)
    said = servo(bus, "scan")
    assert sorted(asked) == sorted(set(SPEEDS) & set(BAUD_RATES.values()))
    assert asked[0] == 1_000_000
    assert "servos at 2 speeds (1000000, 57600): on one bus all need the same" in said.out


def test_scan_asks_a_pseudo_terminal_again_only_where_nobody_answers(bus, servo, monkeypatch):
    asked = []

    def found(link: object, ids: object, progress: object, expected: object) -> SpeedReport:
        asked.append(link.baud)
        one = FoundServo(servo_id=1, model_number=1020, model_name="XM430-W350", firmware="48")
        return SpeedReport(baud=link.baud, servos=(one,) if link.baud == 57_600 else ())

    monkeypatch.setattr(servo_scan, "scan_speed", found)
    assert "1     57600  XM430-W350" in servo(bus, "scan").out
    assert asked == [1_000_000, 9_600, 57_600]


def test_scan_that_finds_nothing_prints_no_empty_table(bus, servo):
    assert servo(bus, "scan", "--ids", "8-8", "--baud", "57600").out == ""


def test_ping_tells_who_answers(bus, servo):
    said = servo(bus, "ping", 1, 7)
    assert said.code == 0
    assert said.out.startswith("servo 1: XM430-W350, firmware 48, ")
    rows = servo(bus, "ping", 3, "--json").document
    assert rows[0]["model_number"] == 1020


def test_ping_of_a_silent_id_fails_and_tells_the_others(bus, servo):
    said = servo(bus, "ping", 9, 1, 8)
    fails(said, "bus0 at 1000000 baud: no answer from servo 9, servo 8; check power")
    assert said.out.startswith("servo 1: XM430-W350")
    assert [row["id"] for row in servo(bus, "ping", 9, 1, "--json").document] == [1]


def test_info_prints_every_register_and_marks_what_is_not_factory(make_bus, servo):
    bus = make_bus(4, temperature_limit=60)
    said = servo(bus, "info", 4)
    assert "temperature_limit               60  EEPROM  factory 80 *" in said.out
    registers = servo(bus, "info", 4, "--json").document["registers"]
    assert registers["present_input_voltage"]["value"] == 120
    assert registers["id"]["value"] == 4


def test_monitor_prints_as_often_as_it_is_told(bus, servo):
    bus.bank.set_alert(3, HardwareError.OVERHEATING)
    said = servo(bus, "monitor", "--count", 2, "--rate", 100)
    lines = said.out.splitlines()
    assert len(lines) == 2 * 5
    assert lines[0].split()[:3] == ["id", "rad", "rad/s"]
    assert "overheating" in lines[2]
    assert lines[4].startswith("wire: timeouts 0, crc errors 0")


def test_monitor_names_silent_servos_and_counts(bus, servo):
    document = servo(bus, "monitor", 1, 3, "--count", 1, "--json").document
    assert [row["id"] for row in document["servos"]] == [1, 3]
    assert document["servos"][0]["voltage_v"] == 12.0
    bus.bank.corrupt_next(3)
    counted = servo(bus, "monitor", 1, 3, "--count", 1, "--json").document["counters"]
    assert counted["crc_errors"] >= 1


def test_set_id_changes_the_id_and_reads_it_back(bus, servo):
    said = servo(bus, "set-id", 3, 9, "--yes")
    assert said.code == 0
    assert said.out == "servo 3 (bench, XM430-W350) has the id 9 now\n"
    assert bus.bank.register(1, "id") == 1
    assert servo(bus, "ping", 9).code == 0
    assert servo(bus, "ping", 3).code != 0


@pytest.mark.parametrize("new", [1, 3])
def test_set_id_refuses_an_id_that_is_taken(bus, servo, new):
    fails(servo(bus, "set-id", 3, new, "--yes"), f"id {new} is taken")


def test_what_can_hurt_needs_a_yes(bus, servo):
    for words in (["set-id", 3, 9], ["set-baud", 57600, 3], ["factory-reset", 3]):
        fails(servo(bus, *words), "repeat it with --yes")
    assert bus.bank.register(3, "baud_rate") == 1
    assert servo(bus, "ping", 3).code == 0


@pytest.mark.parametrize(("answer", "code"), [("yes", 0), ("Yes ", 0), ("y", 1), ("", 1)])
def test_only_a_whole_yes_counts(bus, servo, monkeypatch, answer, code):
    monkeypatch.setattr("sys.stdin.isatty", lambda: True, raising=False)
    monkeypatch.setattr(servo_bus.confirm, "__defaults__", (lambda question: answer,))
    assert servo(bus, "set-id", 3, 9).code == code
    assert (servo(bus, "ping", 9).code == 0) == (code == 0)


def test_torque_goes_off_with_the_change_and_the_question_says_so(bus, servo):
    with_torque(bus, 3)
    fails(servo(bus, "set-id", 3, 9), "The torque of servo 3 (bench, XM430-W350) goes off")
    assert bus.bank.register(3, "torque_enable") == 1
    assert servo(bus, "set-id", 3, 9, "--yes").code == 0


def with_torque(bus: Bus, servo_id: int) -> None:
    link = servo_bus.ServoBusPort(port=Path(bus.port), baud=1_000_000)
    with link.open() as opened:
        opened.write(opened.servo(servo_id), "torque_enable", 1)


def test_set_baud_writes_the_code_of_the_speed_and_asks_at_it(bus, servo):
    said = servo(bus, "set-baud", 3000000, 1, 7, "--yes", "--json")
    assert said.document == {"ids": [1, 7], "baud": 3_000_000, "old_baud": 1_000_000}
    assert [bus.bank.register(one, "baud_rate") for one in (1, 3, 7)] == [5, 1, 5]


def test_a_servo_that_does_not_answer_at_its_new_speed_is_told_with_the_way_back(
    bus, servo, monkeypatch
):
    opened = servo_bus.ServoBusPort.open

    def deaf_when_fast(wire: servo_bus.ServoBusPort, baud: int | None = None) -> object:
        bus.bank.silence(3, silent=baud == 3_000_000)
        return opened(wire, baud)

    monkeypatch.setattr(servo_bus.ServoBusPort, "open", deaf_when_fast)
    said = servo(bus, "set-baud", 3000000, 3, "--yes")
    fails(said, "took 3000000 baud, but does not answer at it")
    assert f"servo set-baud 1000000 3 --port {bus.port} --baud 3000000" in said.err


def test_reboot_clears_an_error_and_asks_only_when_torque_is_on(bus, servo):
    bus.bank.set_alert(3, HardwareError.OVERLOAD)
    said = servo(bus, "reboot", 3)
    assert said.out.endswith("is back, torque off; hardware error 32 before, 0 now\n")
    with_torque(bus, 3)
    fails(servo(bus, "reboot", 3), "goes off: what it carries falls")
    assert servo(bus, "reboot", 3, "--yes").code == 0


def test_factory_reset_keeps_the_id_unless_told_otherwise(make_bus, servo):
    bus = make_bus(5, temperature_limit=60, baud_rate=3)
    said = servo(bus, "factory-reset", 5, "--yes", "--json")
    assert said.document == {"id": 5, "old_id": 5, "baud": 57_600, "kept": "id"}
    assert bus.bank.register(5, "temperature_limit") == 80
    assert servo(bus, "factory-reset", 5, "--yes", "--keep", "nothing").code == 0
    assert servo(bus, "ping", 1).code == 0


def test_factory_reset_refuses_an_id_that_is_taken(bus, servo):
    said = servo(bus, "factory-reset", 3, "--yes", "--keep", "nothing")
    fails(said, "would get the id 1, which is taken; use --keep id")


def test_a_bus_that_another_holds_is_not_touched(bus, servo):
    holder = SerialPort(Path(bus.port), 1_000_000, MonotonicClock())
    try:
        for words in (["scan"], ["set-id", 3, 9, "--yes"], ["monitor", "--count", 1]):
            fails(servo(bus, *words), "stop the process that holds it")
    finally:
        holder.close()


def test_a_session_is_recorded_on_request(bus, servo, tmp_path):
    file = tmp_path / "session.wire"
    servo(bus, "ping", 3, "--record", file)
    records = read_recording(file)
    assert [record.kind for record in records] == [
        RecordKind.NOTE,
        RecordKind.WRITE,  # does the adapter hear itself?
        RecordKind.WRITE,
        RecordKind.READ,
    ]
    assert records[0].payload.endswith(b"bus0 at 1000000 baud")


def test_a_port_that_is_not_there_is_one_line_with_those_that_are(servo, monkeypatch):
    monkeypatch.setattr(servo_bus, "SERIAL_NAMES", ("ptmx",))
    said = servo(None, "scan", "--port", "/nowhere/tty")
    fails(said, "/nowhere/tty: No such file or directory")
    assert said.err.endswith("/dev/ptmx\n")


def test_calibration_takes_the_pose_in_which_the_joints_stand(make_bus, servo, tmp_path):
    bus = make_bus(21, 22, model="XL430-W250")
    bus.turn(0, 0.25)
    bus.turn(1, -0.1)
    file = tmp_path / "mine.toml"
    words = ("--robot", "butler", "--from-pose", "head_pan=0,head_tilt=0.3", "--output", file)
    said = servo(bus, "calibrate", *words, "--json")
    assert said.code == 0
    assert {row["joint"]: row["offset"] for row in said.document["joints"]} == pytest.approx(
        {"head_pan": -0.25, "head_tilt": 0.2}, abs=0.002
    )
    assert read_calibration(file)["head_pan"].method == "pose"


def test_a_person_is_guided_through_a_sweep_at_the_terminal(make_bus, tmp_path):
    bus = make_bus(21, 22, model="XL430-W250")
    file = tmp_path / "mine.toml"
    command = (
        f"{sys.executable} -m vla_deploy.cli.main servo calibrate --robot butler "
        f"--joint head_pan --port {bus.port} --output {file}"
    )
    pipe = subprocess.PIPE
    with subprocess.Popen(command.split(), stdin=pipe, stdout=pipe, text=True) as process:
        told = [process.stdout.readline()]
        bus.turn(0, -1.5)
        process.stdin.write("\n")
        process.stdin.flush()
        told.append(process.stdout.readline())
        for step in range(1, 33):
            bus.turn(0, -1.5 + 0.1 * step)
        process.stdin.write("\n")
        process.stdin.flush()
        told += process.stdout.readlines()
    assert process.returncode == 0, told
    assert told[0] == "head_pan: move it to its LOWER end (-1.6), hold it, then press Enter\n"
    assert told[1] == "head_pan: move it to its UPPER end (1.6), hold it, then press Enter\n"
    assert read_calibration(file)["head_pan"].offset == pytest.approx(-0.1, abs=0.003)


def test_calibration_ends_in_one_line_when_the_input_does(make_bus, servo, tmp_path, monkeypatch):
    bus = make_bus(21, 22, model="XL430-W250")
    words = ("--robot", "butler", "--joint", "head_pan", "--output", tmp_path / "mine.toml")
    with Path("/dev/null").open() as ended:
        monkeypatch.setattr("sys.stdin", ended)
        said = servo(bus, "calibrate", *words)
    assert said.code == 1
    assert said.err == "vla-deploy: the input ended; what was written before stays\n"


@pytest.mark.parametrize("family", ["dynamixel", "feetech"])
def test_the_limits_of_a_servo_are_set_for_its_whole_turn_or_as_said(make_bus, servo, family):
    bus = make_bus(3) if family == "dynamixel" else make_bus.feetech(3)
    words = (3, "--yes", "--family", family)
    said = servo(bus, "set-limits", *words, "--pulses", 100, 3000, "--json")
    assert (said.document["old_limits"], said.document["limits"]) == ("0..4095", [100, 3000])
    assert bus.bank.register(3, "max_position_limit") == 3000
    assert "position limits 0..4095 (were 100..3000)" in servo(bus, "set-limits", *words).out
    fails(servo(bus, "set-limits", *words, "--pulses", 9, 5000), "within 0..4095")


def test_feetech_servos_are_found_read_and_changed_like_the_others(make_bus, servo):
    bus = make_bus.feetech(1, 2)
    fails(servo(bus, "scan", "--baud", 1_000_000), "another protocol: a servo of another make")
    feetech = ("--family", "feetech")
    said = servo(bus, "scan", *feetech, "--json")
    assert [(row["id"], row["model"]) for row in said.document["servos"]] == [
        (1, "STS3215"),
        (2, "STS3215"),
    ]
    assert servo(bus, "set-id", 2, 6, "--yes", *feetech).code == 0
    assert servo(bus, "set-baud", 500_000, 6, "--yes", *feetech).code == 0
    assert "servo 6: STS3215, firmware 3.10" in servo(bus, "ping", 6, *feetech).out
    registers = servo(bus, "info", 6, *feetech, "--json").document["registers"]
    assert (registers["id"]["value"], registers["baud_rate"]["value"]) == (6, 1)
    assert registers["lock"]["value"] == 1
    assert servo(bus, "monitor", 6, "--count", 1, *feetech, "--json").document["silent"] == []
    said = servo(bus, "factory-reset", 6, "--keep", "nothing", "--yes", *feetech)
    fails(said, "a reset can keep id, not nothing")
    fails(servo(bus, "set-baud", 3_000_000, 6, "--yes", *feetech), "speeds are 115200, 128000")
