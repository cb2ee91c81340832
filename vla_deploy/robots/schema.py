"""Declare which keys a robot file has and what each may hold."""

from drivers.estop.open_estop import MODELS as ESTOP_MODELS
from drivers.power_relay.open_relay import RELAY_MODELS
from drivers.registry import SensorKind, model_names
from vla_deploy.runtime.table_schema import (
    NUMBER,
    POSITIVE,
    TABLE,
    TABLES,
    TEXT,
    TEXTS,
    Shape,
    ValueCheck,
    integer,
    number,
    numbers,
    one_of,
)

_POINT = numbers(2)
POLYGON = ValueCheck(
    expected="three or more [x, y] corners",
    holds=lambda value: (
        isinstance(value, list) and len(value) >= 3 and all(map(_POINT.holds, value))
    ),
)
DISTANCES = ValueCheck(
    expected="a list of one or more distances above 0 in m, the best first",
    holds=lambda value: isinstance(value, list) and bool(value) and all(map(POSITIVE.holds, value)),
)
NUMBERS = ValueCheck(
    expected="a list of one or more numbers",
    holds=lambda value: isinstance(value, list) and bool(value) and all(map(NUMBER.holds, value)),
)
_IDS = ValueCheck(
    expected="a list of servo ids, such as [1, 2]",
    holds=lambda value: isinstance(value, list) and all(map(integer(0, 253).holds, value)),
)

ROBOT: Shape = {
    "name": TEXT,
    "mjcf": TEXT,
    "read_only": one_of(False, True).optional,
    "servo_bus": TABLE,
    "servo_models": TABLE,
    "can_bus": TABLE.optional,
    "base": TABLE.optional,
    "lidar": TABLE.optional,
    "imu": TABLE.optional,
    "camera": TABLE.optional,
    "estop": TABLE.optional,
    "power_relay": TABLE.optional,
    "microphone": TABLE.optional,
    "speaker": TABLE.optional,
    "voice": TABLE.optional,
    "ros": TABLE.optional,
    "twin": TABLE.optional,
    "battery": TABLE.optional,
    "mqtt": TABLE.optional,
    "devices": TABLES.optional,
    "things": TABLES.optional,
    "words": TABLES.optional,
    "limits": TABLE,
    "groups": TABLE,
    "hands": TABLE.optional,
    "reach": TABLE.optional,
    "head": TABLE.optional,
    "poses": TABLE.optional,
    "home": TABLE.optional,
    "planning": TABLE.optional,
    "zones": TABLE.optional,
    "workspace": TABLE.optional,
    "clearance": TABLE.optional,
    "tip_over": TABLE.optional,
    "contact": TABLE.optional,
    "calibration": TABLE.optional,
}
SERVO_BUS: Shape = {
    "device": TEXT,
    "path": TEXT,
    "baud": integer(1),
    "protocol": one_of(2).optional,
    "servos": TABLES,
    "shadows": TABLES.optional,
    "wheels": TABLES.optional,
    "supplies": TABLES.optional,
}
SUPPLY: Shape = {"name": TEXT, "voltage_v": POSITIVE, "servos": _IDS}
SERVO: Shape = {
    "id": integer(0, 253),
    "model": TEXT,
    "joint": TEXT,
    "sign": one_of(-1, 1),
    "offset": NUMBER,
    "travel_per_rad": POSITIVE,
}
WHEEL: Shape = {key: SERVO[key] for key in ("id", "model", "joint", "sign")}
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
    "protocol": one_of("cia402", "odrive").optional,
    "eds": TEXT.optional,
    "endpoints": TEXT.optional,
    "drives": TABLES,
}
DRIVE: Shape = {
    "node_id": integer(0, 127),
    "joint": TEXT,
    "sign": one_of(-1, 1),
    "gear_ratio": POSITIVE,
    "mode": one_of("profile_velocity", "cyclic_synchronous_velocity").optional,
    "counts_per_rev": integer(1).optional,
    "current_limit_a": POSITIVE.optional,
}
BASE: Shape = {
    "wheel_radius_m": POSITIVE,
    "track_m": POSITIVE.optional,
    "base_radius_m": POSITIVE.optional,
    "wheel_bearings_rad": NUMBERS.optional,
    "max_wheel_rad_s": POSITIVE.optional,
    "max_speed_m_s": POSITIVE,
    "max_turn_rad_s": POSITIVE,
    "max_acceleration_m_s2": POSITIVE,
    "max_turn_acceleration_rad_s2": POSITIVE,
    "stop_deceleration_m_s2": POSITIVE.optional,
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
    "width": integer(16, 1920),
    "height": integer(16, 1080),
    "fovy_rad": number(0.1, 2.8, "rad", kind="an angle"),
}
ESTOP: Shape = {
    "device": TEXT,
    "path": TEXT,
    "model": one_of(*ESTOP_MODELS),
    "number": integer(0, 767),
}
POWER_RELAY: Shape = {
    "device": TEXT,
    "path": TEXT,
    "model": one_of(*RELAY_MODELS),
    "number": integer(0, 255),
    "hold_s": number(0.3, 60.0, "s", kind="a time").optional,
    "control_silence_s": number(1.0, 120.0, "s", kind="a time").optional,
}
AUDIO: Shape = {
    "device": TEXT,
    "path": TEXT,
    "rate_hz": one_of(8000, 16000, 22050, 24000, 32000, 44100, 48000),
    "channels": integer(1, 8),
}
VOICE: Shape = {
    "voice": TEXT.optional,
    "program": TEXT.optional,
    "words_per_minute": integer(80, 450).optional,
    "pitch": integer(0, 99).optional,
    "volume_ratio": number(0, 1).optional,
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
    "drop_payload": one_of(False, True).optional,
}
HAND: Shape = {
    "arm": TEXT,
    "gripper": TEXT,
    "grip_site": TEXT,
    "opening_ratio": POSITIVE,
    "opening_offset_m": NUMBER.optional,
    "fixed_pad_m": POSITIVE.optional,
    "travel_pose": TEXT.optional,
    "carry_point_m": numbers(3).optional,
}
TWIN: Shape = {"world": TEXT.optional, "demo": TEXT.optional}
HEAD: Shape = {"pan": TEXT, "tilt": TEXT}
REACH: Shape = {
    "distances_m": DISTANCES,
    "least_ahead_m": NUMBER,
    "most_aside_m": POSITIVE,
    "grip_heights_m": numbers(2),
    "clear_height_m": POSITIVE,
    "out_m": NUMBER,
    "above_m": POSITIVE,
    "put_ahead_m": DISTANCES,
    "put_aside_m": NUMBERS,
    "apart_m": POSITIVE,
}
HOME: Shape = {"map": TEXT, "start": TEXT, "places": TABLE, "zones": TABLES}
FLOOR_POSE: Shape = {"x_m": NUMBER, "y_m": NUMBER, "yaw_rad": NUMBER}
PLACE: Shape = {
    **FLOOR_POSE,
    "aliases": TEXTS,
    "viewpoints": TABLES,
    "floor_m": POLYGON.optional,
}
ZONE: Shape = {"name": TEXT, "reason": TEXT, "polygon_m": POLYGON}
MAP_BOUNDS = ValueCheck(
    expected="the least x and y and the most x and y in m, such as [-10.0, -10.0, 10.0, 10.0]",
    holds=lambda value: numbers(4).holds(value) and value[0] < value[2] and value[1] < value[3],
)
PLANNING: Shape = {
    "payload_kg": POSITIVE.optional,
    "max_actions": integer(1, 100).optional,
    "max_duration_s": POSITIVE.optional,
    "require_confirmation": one_of("never", "risky", "always").optional,
    "further_plans": integer(0, 20).optional,
    "action_timeout_s": POSITIVE.optional,
    "map_bounds_m": MAP_BOUNDS.optional,
}
