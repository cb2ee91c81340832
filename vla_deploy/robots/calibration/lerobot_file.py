"""Read and write the calibration files of LeRobot, which has one for each arm.

A file is a JSON object of motors by name, five whole numbers each, at
`~/.cache/huggingface/lerobot/calibration/robots/<kind>/<id>.json`. Format and meaning:
huggingface/lerobot v0.6.2, motors/motors_bus.py (`MotorCalibration`), robots/robot.py.
"""

import json
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

from vla_deploy.robots.calibration.replacing import replace_text
from vla_deploy.robots.errors import RobotFileError
from vla_deploy.runtime.table_schema import (
    Shape,
    TableFault,
    ValueCheck,
    build,
    check_record,
    integer,
    one_of,
)

TOP_PULSE: Final = 4095
"""The last position of a turn."""
MAX_HOMING: Final = 1_044_479
"""Of a Dynamixel X (e-manual, Homing Offset); a FEETECH servo has 11 bits and a sign."""
RANGE: Shape = {
    "drive_mode": one_of(0, 1),
    "homing_offset": integer(-MAX_HOMING, MAX_HOMING),
    "range_min": integer(0, TOP_PULSE),
    "range_max": integer(0, TOP_PULSE),
}
MOTOR: Shape = {"id": integer(0, 253), **RANGE}


@dataclass(frozen=True, slots=True, kw_only=True)
class LeRobotMotor:
    """Hold one motor of a file; positions are pulses that the servo shows with its offset."""

    id: int
    drive_mode: int
    homing_offset: int
    range_min: int
    range_max: int


def read_lerobot(file: Path) -> dict[str, LeRobotMotor]:
    """Return the motors of a file by name.

    Raises:
        RobotFileError: it cannot be read, or has faults; all of them are listed.
    """
    try:
        document = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise _unusable(file, str(error)) from error
    if not isinstance(document, dict) or not document:
        raise _unusable(file, type(document).__name__ if document else "nothing")
    faults = tuple(_faults(document))
    if faults:
        raise RobotFileError(file, faults)
    return {name: build(LeRobotMotor, row) for name, row in document.items()}


def write_lerobot(file: Path, motors: Mapping[str, LeRobotMotor]) -> None:
    """Replace a file in one act, as LeRobot formats it; the one before stays as `<file>.bak`.

    Raises:
        RobotFileError: it cannot be written; the old file stays.
    """
    rows = {name: asdict(motor) for name, motor in motors.items()}
    replace_text(file, json.dumps(rows, indent=4), expected="a file that can be written")


def range_faults(row: Mapping[str, Any], key: str) -> Iterator[TableFault]:
    """Yield the fault of a range that is none; LeRobot divides by its width."""
    if not row["range_min"] < row["range_max"]:
        expected = f"above range_min {row['range_min']}"
        yield TableFault(key=f"{key}.range_max", got=str(row["range_max"]), expected=expected)


def _faults(document: Mapping[str, Any]) -> Iterator[TableFault]:
    is_table = ValueCheck(expected="five numbers", holds=lambda row: isinstance(row, dict))
    yield from check_record(document, "", dict.fromkeys(document, is_table))
    for name, row in document.items():
        if isinstance(row, dict):
            yield from check_record(row, name, MOTOR) or range_faults(row, name)


def _unusable(file: Path, got: str) -> RobotFileError:
    expected = "a JSON object of motors by name, as LeRobot writes it"
    return RobotFileError(file, (TableFault(key="(file)", got=got, expected=expected),))
