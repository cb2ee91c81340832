"""Keep what calibration has measured in a file next to the robot file, and lay it over that file.

`calibration.toml` has a table per calibrated joint; sign and offset replace those of `robot.toml`.
It names the servo too: when another one is mounted, the old measurement is refused.
"""

import json
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from vla_deploy.robots.calibration.lerobot_file import RANGE, range_faults
from vla_deploy.robots.calibration.replacing import replace_text
from vla_deploy.robots.consistency import rows, subtables, table, unknown_name
from vla_deploy.robots.errors import RobotFileError
from vla_deploy.robots.schema import SERVO
from vla_deploy.runtime.table_schema import (
    TABLE,
    TEXT,
    Shape,
    TableFault,
    ValueCheck,
    build,
    check_record,
    check_tables,
    parse_toml,
)

CALIBRATION_FILE = "calibration.toml"
CALIBRATION: Shape = {"joints": TABLE}
JOINT: Shape = {
    "servo_id": SERVO["id"],
    "sign": SERVO["sign"],
    "offset": SERVO["offset"],
    "method": TEXT,
    "made_at": TEXT,
    "lerobot": TABLE.optional,
}
LEROBOT: Shape = {
    **RANGE,
    "homing_in_servo": ValueCheck(
        expected="true or false", holds=lambda value: isinstance(value, bool)
    ),
}
HEADER = """\
# Written by `vla-deploy servo calibrate`; replaces sign and offset of these joints in robot.toml.
"""
Document = Mapping[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class LeRobotOrigin:
    """Keep what LeRobot's file says of a joint that was imported from one, to export it as it was.

    `homing_in_servo` is whether the servo itself held the homing offset then.
    """

    drive_mode: int
    homing_offset: int
    range_min: int
    range_max: int
    homing_in_servo: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class JointCalibration:
    """Hold what was measured of one joint; `made_at` is a date for people."""

    servo_id: int
    sign: int
    offset: float
    method: str
    made_at: str
    lerobot: LeRobotOrigin | None = None

    @property
    def expected_homing_offset(self) -> int | None:
        """Return the homing offset with which the joint was calibrated; None: it is not known."""
        if self.lerobot is None:
            return None
        return self.lerobot.homing_offset if self.lerobot.homing_in_servo else 0


def read_calibration(file: Path) -> dict[str, JointCalibration]:
    """Return the calibrations by joint; none when there is no file.

    Raises:
        RobotFileError: the file cannot be used; all its faults are listed.
    """
    document = _parse(file)
    faults = tuple(_faults(document))
    if faults:
        raise RobotFileError(file, faults)
    return {
        name: build(JointCalibration, row) for name, row in subtables(document, "joints").items()
    }


def write_calibration(file: Path, calibrations: Mapping[str, JointCalibration]) -> None:
    """Replace the file in one act; the one before stays as `<file>.bak`.

    Raises:
        RobotFileError: it cannot be written; the old file stays.
    """
    replace_text(file, _as_toml(calibrations))


def calibrated(document: Document, directory: Path) -> tuple[Document, tuple[TableFault, ...]]:
    """Return a robot document with the calibration of its directory, and that file's faults."""
    file = directory / CALIBRATION_FILE
    try:
        calibrations = read_calibration(file)
    except RobotFileError as error:
        return document, tuple(_with_file_name(fault) for fault in error.faults)
    if not calibrations:
        return document, ()
    bus = table(document, "servo_bus")
    servos = rows(bus, "servos")
    faults = tuple(_with_file_name(fault) for fault in _mismatches(servos, calibrations))
    laid_over = [_laid_over(row, calibrations) for row in servos]
    return {**document, "servo_bus": {**bus, "servos": laid_over}}, faults


def _laid_over(row: Document, calibrations: Mapping[str, JointCalibration]) -> Document:
    joint = row.get("joint")
    measured = calibrations.get(joint) if isinstance(joint, str) else None
    return row if measured is None else {**row, "sign": measured.sign, "offset": measured.offset}


def _mismatches(
    servos: list[Document], calibrations: Mapping[str, JointCalibration]
) -> Iterator[TableFault]:
    ids = {row.get("joint"): row.get("id") for row in servos}
    names = sorted(name for name in ids if isinstance(name, str))
    for joint, measured in calibrations.items():
        key = f"joints.{joint}"
        if joint not in ids:
            yield unknown_name(key, joint, "a servo's joint", names)
        elif ids[joint] != measured.servo_id:
            expected = f"{ids[joint]}, the id in the robot file: calibrate the joint again"
            yield TableFault(key=f"{key}.servo_id", got=str(measured.servo_id), expected=expected)


def _with_file_name(fault: TableFault) -> TableFault:
    return TableFault(
        key=f"{CALIBRATION_FILE}: {fault.key}", got=fault.got, expected=fault.expected
    )


def _parse(file: Path) -> Document:
    try:
        return parse_toml(file.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return {"joints": {}}
    except (OSError, tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        fault = TableFault(key="(file)", got=str(error), expected="a TOML document")
        raise RobotFileError(file, (fault,)) from error


def _faults(document: Document) -> Iterator[TableFault]:
    yield from check_record(document, "", CALIBRATION)
    yield from check_tables(document, {"joints.*": JOINT})
    for name, row in subtables(document, "joints").items():
        if isinstance(origin := row.get("lerobot"), dict):
            key = f"joints.{name}.lerobot"
            yield from check_record(origin, key, LEROBOT) or range_faults(origin, key)


def _as_toml(calibrations: Mapping[str, JointCalibration]) -> str:
    parts = [HEADER]
    for joint, row in calibrations.items():
        parts.append(f"\n[joints.{json.dumps(joint)}]\n")
        parts += [
            f"{key} = {_toml_value(value)}\n"
            for key, value in asdict(row).items()
            if value is not None
        ]
    return "".join(parts)


def _toml_value(value: object) -> str:
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {json.dumps(one)}" for key, one in value.items()) + " }"
    return json.dumps(value)
