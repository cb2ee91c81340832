"""Declare which keys a robot file has and what each may hold; collect every fault, stop at none."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from math import isfinite
from typing import Any, TypeGuard

from drivers.estop.open_estop import MODELS as ESTOP_MODELS
from drivers.registry import SensorKind, model_names


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotFileFault:
    """Say what is wrong with one key of a file."""

    key: str
    got: str
    expected: str

    def __str__(self) -> str:
        return f"{self.key}: got {self.got}, expected {self.expected}"


@dataclass(frozen=True, slots=True, kw_only=True)
class ValueCheck:
    """Say what a value must be, in words and as a test."""

    expected: str
    holds: Callable[[Any], bool]
    is_optional: bool = False


def is_number(value: object) -> TypeGuard[int | float]:
    """Return whether a value is a finite number; TOML's booleans are none."""
    return isinstance(value, int | float) and not isinstance(value, bool) and isfinite(value)


def _integer(low: int, high: int) -> ValueCheck:
    def holds(value: Any) -> bool:
        return is_number(value) and isinstance(value, int) and low <= value <= high

    return ValueCheck(expected=f"an integer in {low}..{high}", holds=holds)


def one_of(*choices: Any, is_optional: bool = False) -> ValueCheck:
    """Return the check that a value is one of `choices`."""
    listed = ", ".join(str(choice) for choice in choices)
    return ValueCheck(
        expected=f"one of {listed}", holds=lambda value: value in choices, is_optional=is_optional
    )


NUMBER = ValueCheck(expected="a number", holds=is_number)
POSITIVE = ValueCheck(
    expected="a number above 0", holds=lambda value: is_number(value) and value > 0
)
TEXT = ValueCheck(expected="a text", holds=lambda value: isinstance(value, str) and value != "")
TABLE = ValueCheck(expected="a table", holds=lambda value: isinstance(value, dict))
OPTIONAL_TABLE = ValueCheck(expected="a table", holds=TABLE.holds, is_optional=True)
OPTIONAL_TEXT = ValueCheck(expected="a text", holds=TEXT.holds, is_optional=True)
OPTIONAL_POSITIVE = ValueCheck(expected=POSITIVE.expected, holds=POSITIVE.holds, is_optional=True)
TABLES = ValueCheck(
    expected="a list of tables",
    holds=lambda value: isinstance(value, list) and all(isinstance(row, dict) for row in value),
)
TEXTS = ValueCheck(
    expected="a list of texts",
    holds=lambda value: isinstance(value, list) and all(isinstance(row, str) for row in value),
)
POLYGON = ValueCheck(
    expected="three or more [x, y] corners",
    holds=lambda value: isinstance(value, list) and len(value) >= 3 and all(map(_is_point, value)),
)


def _is_point(value: Any) -> bool:
    return isinstance(value, list) and len(value) == 2 and all(map(is_number, value))


Shape = Mapping[str, ValueCheck]

ROBOT: Shape = {
    "name": TEXT,
    "mjcf": TEXT,
    "servo_bus": TABLE,
    "servo_models": TABLE,
    "can_bus": TABLE,
    "base": TABLE,
    "lidar": TABLE,
    "imu": TABLE,
    "camera": TABLE,
    "estop": OPTIONAL_TABLE,
    "microphone": OPTIONAL_TABLE,
    "speaker": OPTIONAL_TABLE,
    "voice": OPTIONAL_TABLE,
    "ros": OPTIONAL_TABLE,
    "limits": TABLE,
    "groups": TABLE,
    "hands": TABLE,
    "poses": TABLE,
    "home": TABLE,
    "planning": OPTIONAL_TABLE,
    "zones": OPTIONAL_TABLE,
    "workspace": OPTIONAL_TABLE,
    "clearance": OPTIONAL_TABLE,
    "tip_over": OPTIONAL_TABLE,
    "contact": OPTIONAL_TABLE,
}
SERVO_BUS: Shape = {
    "device": TEXT,
    "path": TEXT,
    "baud": one_of(57600, 115200, 1000000, 2000000, 3000000, 4000000, 4500000),
    "protocol": one_of(2),
    "servos": TABLES,
}
SERVO: Shape = {
    "id": _integer(0, 252),
    "model": TEXT,
    "joint": TEXT,
    "sign": one_of(-1, 1),
    "offset": NUMBER,
    "travel_per_rad": POSITIVE,
}
SERVO_MODEL: Shape = {
    "stall_torque_nm": POSITIVE,
    "no_load_speed_rad_s": POSITIVE,
    "mass_kg": POSITIVE,
    "source": TEXT,
}
CAN_BUS: Shape = {
    "device": TEXT,
    "path": TEXT,
    "bitrate": one_of(125000, 250000, 500000, 800000, 1000000),
    "protocol": one_of("cia402", "odrive", is_optional=True),
    "eds": OPTIONAL_TEXT,
    "endpoints": OPTIONAL_TEXT,
    "drives": TABLES,
}
DRIVE: Shape = {
    "node_id": _integer(0, 127),
    "joint": TEXT,
    "sign": one_of(-1, 1),
    "gear_ratio": POSITIVE,
    "mode": one_of("profile_velocity", "cyclic_synchronous_velocity", is_optional=True),
    "counts_per_rev": ValueCheck(
        expected="an integer above 0",
        holds=lambda value: POSITIVE.holds(value) and isinstance(value, int),
        is_optional=True,
    ),
    "current_limit_a": OPTIONAL_POSITIVE,
}
BASE: Shape = {
    "wheel_radius_m": POSITIVE,
    "track_m": POSITIVE,
    "max_speed_m_s": POSITIVE,
    "max_turn_rad_s": POSITIVE,
    "max_acceleration_m_s2": POSITIVE,
    "max_turn_acceleration_rad_s2": POSITIVE,
    "stop_deceleration_m_s2": OPTIONAL_POSITIVE,
    "footprint_radius_m": POSITIVE,
}
LIDAR: Shape = {
    "device": TEXT,
    "path": TEXT,
    "model": one_of(*model_names(SensorKind.LIDAR)),
    "site": TEXT,
}
IMU: Shape = {
    "device": TEXT,
    "path": TEXT,
    "model": one_of(*model_names(SensorKind.IMU)),
    "site": TEXT,
}
CAMERA: Shape = {
    "device": TEXT,
    "path": TEXT,
    "model": one_of(*model_names(SensorKind.CAMERA)),
    "site": TEXT,
    "width": _integer(16, 1920),
    "height": _integer(16, 1080),
    "fovy_rad": ValueCheck(
        expected="an angle in 0.1..2.8 rad",
        holds=lambda value: is_number(value) and 0.1 <= value <= 2.8,
    ),
}
ESTOP: Shape = {
    "device": TEXT,
    "path": TEXT,
    "model": one_of(*ESTOP_MODELS),
    "number": _integer(0, 767),
}
AUDIO: Shape = {
    "device": TEXT,
    "path": TEXT,
    "rate_hz": one_of(8000, 16000, 22050, 24000, 32000, 44100, 48000),
    "channels": _integer(1, 8),
}
VOICE: Shape = {
    "voice": OPTIONAL_TEXT,
    "program": OPTIONAL_TEXT,
    "words_per_minute": replace(_integer(80, 450), is_optional=True),
    "pitch": replace(_integer(0, 99), is_optional=True),
    "volume_ratio": ValueCheck(
        expected="a number in 0..1",
        holds=lambda value: is_number(value) and 0.0 <= value <= 1.0,
        is_optional=True,
    ),
}
LIMITS: Shape = {
    "min": NUMBER,
    "max": NUMBER,
    "velocity": POSITIVE,
    "acceleration": POSITIVE,
    "jerk": POSITIVE,
}
GROUP: Shape = {
    "joints": TEXTS,
    "stop_category": one_of(0, 1, 2),
    "drop_payload": one_of(False, True, is_optional=True),
}
HAND: Shape = {"arm": TEXT, "gripper": TEXT, "grip_site": TEXT, "opening_ratio": POSITIVE}
HOME: Shape = {"map": TEXT, "start": TEXT, "places": TABLE, "zones": TABLES}
FLOOR_POSE: Shape = {"x_m": NUMBER, "y_m": NUMBER, "yaw_rad": NUMBER}
PLACE: Shape = {**FLOOR_POSE, "aliases": TEXTS, "viewpoints": TABLES}
ZONE: Shape = {"name": TEXT, "reason": TEXT, "polygon_m": POLYGON}
PLANNING: Shape = {
    "payload_kg": OPTIONAL_POSITIVE,
    "max_actions": replace(_integer(1, 100), is_optional=True),
    "max_duration_s": OPTIONAL_POSITIVE,
    "require_confirmation": one_of("never", "risky", "always", is_optional=True),
    "further_plans": replace(_integer(0, 20), is_optional=True),
    "action_timeout_s": OPTIONAL_POSITIVE,
}


def check_record(record: Mapping[str, Any], key: str, shape: Shape) -> tuple[RobotFileFault, ...]:
    """Return the faults of one table: missing keys, unknown keys, values of the wrong kind."""
    prefix = f"{key}." if key else ""
    missing = [
        RobotFileFault(key=prefix + name, got="nothing", expected=check.expected)
        for name, check in shape.items()
        if name not in record and not check.is_optional
    ]
    unknown = [
        RobotFileFault(
            key=prefix + name, got="an unknown key", expected=f"one of {', '.join(shape)}"
        )
        for name in record
        if name not in shape
    ]
    wrong = [
        RobotFileFault(key=prefix + name, got=repr(record[name]), expected=check.expected)
        for name, check in shape.items()
        if name in record and not check.holds(record[name])
    ]
    return (*missing, *unknown, *wrong)
