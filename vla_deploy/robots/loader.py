"""Load a robot file: read, judge everything, then build; never half a robot."""

import tomllib
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar
from xml.etree import ElementTree

from platforms.profile_source import merged
from vla_deploy.robots import home_devices, known_things, protection_schema, schema, supplies
from vla_deploy.robots.battery_settings import BATTERY, BatterySettings
from vla_deploy.robots.calibration import stop_approach
from vla_deploy.robots.calibration.calibration import calibrated
from vla_deploy.robots.calibration.camera_calibration import with_calibration
from vla_deploy.robots.camera import CameraDescription
from vla_deploy.robots.consistency import CHECKS, missing_files, mjcf_file, subtables
from vla_deploy.robots.description import (
    BaseGeometry,
    Hand,
    Head,
    Home,
    JointLimits,
    KeepOutZone,
    Place,
    RobotDescription,
    RobotParts,
    StopGroup,
)
from vla_deploy.robots.devices import (
    Audio,
    CanBus,
    EstopButtonDescription,
    PowerRelayDescription,
    SerialSensor,
    ServoBus,
    ServoModel,
    VoiceSettings,
)
from vla_deploy.robots.errors import RobotFileError
from vla_deploy.robots.home_devices import HomeDevice, MqttBroker
from vla_deploy.robots.kinematics.mjcf import mjcf_faults, read_mjcf_names
from vla_deploy.robots.plan_bounds import PlanBounds
from vla_deploy.robots.reach import Reach
from vla_deploy.robots.ros_settings import ROS, RosSettings
from vla_deploy.robots.servos import wheel_checks
from vla_deploy.robots.twin_settings import twin_settings
from vla_deploy.runtime.table_schema import (
    Shape,
    TableFault,
    build,
    check_record,
    check_tables,
    parse_toml,
)

P = TypeVar("P")

ROBOTS_DIR = Path(__file__).parent
ROBOT_FILE = "robot.toml"
OVERRIDES_FILE = "overrides.toml"
"""What differs on this one robot, in the folder of its robot file."""
Document = Mapping[str, Any]

SHAPES: Mapping[str, Shape] = {
    "servo_bus": schema.SERVO_BUS,
    "servo_bus.servos": schema.SERVO,
    "servo_bus.shadows": schema.SERVO,
    "servo_bus.wheels": schema.WHEEL,
    "servo_bus.supplies": schema.SUPPLY,
    "servo_models.*": schema.SERVO_MODEL,
    "can_bus": schema.CAN_BUS,
    "can_bus.drives": schema.DRIVE,
    "base": schema.BASE,
    "lidar": schema.LIDAR,
    "imu": schema.IMU,
    "camera": schema.CAMERA,
    "estop": schema.ESTOP,
    "power_relay": schema.POWER_RELAY,
    "microphone": schema.AUDIO,
    "speaker": schema.AUDIO,
    "voice": schema.VOICE,
    "ros": ROS,
    "twin": schema.TWIN,
    "battery": BATTERY,
    "limits.*": schema.LIMITS,
    "groups.*": schema.GROUP,
    "hands.*": schema.HAND,
    "reach": schema.REACH,
    "head": schema.HEAD,
    "home": schema.HOME,
    "home.places.*": schema.PLACE,
    "home.places.*.viewpoints": schema.FLOOR_POSE,
    "home.zones": schema.ZONE,
    "planning": schema.PLANNING,
    "things": known_things.THING,
    "words": known_things.WORD,
    "zones.*": protection_schema.ZONE,
    "workspace.*": protection_schema.WORKSPACE,
    "clearance": protection_schema.CLEARANCE,
    "tip_over": protection_schema.TIP_OVER,
    "contact": protection_schema.CONTACT,
    **home_devices.SHAPES,
    **stop_approach.SHAPES,
}
"""What each table of a robot file holds, by its path."""


def load_robot(name_or_path: str | Path, *, despite: Collection[str] = ()) -> RobotDescription:
    """Return the robot of that name under `vla_deploy/robots`, or of that file or folder.

    Faults of the keys `despite` are passed over, by who helps to mend them.

    What `overrides.toml` in the same folder says goes before the robot file, and what its
    `calibration.toml` has measured replaces signs and offsets; the camera
    gets the lens of `camera.yaml` and the place of `camera_mounting.toml`, if they are there.

    Raises:
        RobotFileError: the file is missing, is not TOML, or has faults; all of them are listed.
    """
    file = robot_file(name_or_path)
    own = _parse(file)
    overrides, override_faults = read_overrides(file.parent)
    document, calibration_faults = calibrated(merged(own, overrides), file.parent)
    found = (_traced(fault, overrides, own) for fault in _faults(document, file.parent))
    faults = (
        *override_faults,
        *calibration_faults,
        *(one for one in found if one.key not in despite),
    )
    if faults:
        raise RobotFileError(file, faults)
    camera = None
    if "camera" in document:
        camera, faults = with_calibration(CameraDescription(**document["camera"]), file.parent)
        if faults:
            raise RobotFileError(file, faults)
    return _build(document, file.parent, camera)


def robot_file(name_or_path: str | Path) -> Path:
    """Return the file of a robot, given its name, its folder or the file itself.

    Raises:
        RobotFileError: there is none.
    """
    given = Path(name_or_path)
    candidates = (given, given / ROBOT_FILE, ROBOTS_DIR / given / ROBOT_FILE)
    for candidate in candidates:
        if candidate.is_file():
            return candidate
    expected = f"a robot file, its folder, or one of {', '.join(robot_names())}"
    raise RobotFileError(given, (TableFault(key="(file)", got="no such file", expected=expected),))


def robot_names() -> tuple[str, ...]:
    """Return the names of the robots that come with the stack."""
    return tuple(sorted(path.parent.name for path in ROBOTS_DIR.glob(f"*/{ROBOT_FILE}")))


def _parse(file: Path) -> Document:
    try:
        return parse_toml(file.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        fault = TableFault(key="(file)", got=str(error), expected="a TOML document")
        raise RobotFileError(file, (fault,)) from error


def read_overrides(directory: Path) -> tuple[Document, tuple[TableFault, ...]]:
    """Return the overrides of a robot's folder, empty where it has none, and the file's faults."""
    try:
        text = (directory / OVERRIDES_FILE).read_text(encoding="utf-8")
        return parse_toml(text), ()
    except FileNotFoundError:
        return {}, ()
    except (OSError, tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        return {}, (
            TableFault(key=f"{OVERRIDES_FILE}: (file)", got=str(error), expected="a TOML file"),
        )


def _traced(fault: TableFault, overrides: Document, own: Document) -> TableFault:
    """Return the fault of a merged document, with the name of the overrides where they made it.

    A value that lacks in a table is theirs where the robot file itself has no such table.
    """
    above: Any = overrides
    below: Any = own
    for part in fault.key.partition("[")[0].split("."):
        if not isinstance(above, dict):
            break  # a value of theirs, in which something is wrong
        if part not in above:
            if above is not overrides and not isinstance(below, dict):
                break
            return fault
        above = above[part]
        below = below.get(part) if isinstance(below, dict) else None
    return replace(fault, key=f"{OVERRIDES_FILE}: {fault.key}")


def _faults(document: Document, directory: Path) -> Iterator[TableFault]:
    yield from check_record(document, "", schema.ROBOT)
    yield from check_tables(document, SHAPES)
    yield from missing_files(document, directory)
    for check in (
        *CHECKS,
        *supplies.CHECKS,
        *wheel_checks.CHECKS,
        *protection_schema.CHECKS,
        *home_devices.CHECKS,
        *stop_approach.CHECKS,
    ):
        yield from check(document)
    yield from _faults_against_mjcf(document, directory)


def _faults_against_mjcf(document: Document, directory: Path) -> Iterator[TableFault]:
    name = document.get("mjcf")
    if not isinstance(name, str) or not (file := mjcf_file(name, directory)).is_file():
        return
    try:
        mjcf = read_mjcf_names(file)
    except ElementTree.ParseError as error:
        yield TableFault(key="mjcf", got=f"{name}: {error}", expected="an MJCF file")
    else:
        yield from mjcf_faults(document, mjcf)
        yield from stop_approach.missing_stops(document, mjcf)


def _build(
    document: Document, directory: Path, camera: CameraDescription | None
) -> RobotDescription:
    return RobotDescription(
        name=document["name"],
        folder=directory,
        mjcf_path=mjcf_file(document["mjcf"], directory),
        read_only=document.get("read_only", False),
        servo_bus=build(ServoBus, document["servo_bus"]),
        servo_models={k: ServoModel(**row) for k, row in document["servo_models"].items()},
        parts=_parts(document, directory, camera),
        estop=EstopButtonDescription(**document["estop"]) if "estop" in document else None,
        power_relay=(
            PowerRelayDescription(**document["power_relay"]) if "power_relay" in document else None
        ),
        microphone=Audio(**document["microphone"]) if "microphone" in document else None,
        speaker=Audio(**document["speaker"]) if "speaker" in document else None,
        voice=VoiceSettings(**document.get("voice", {})),
        ros=build(RosSettings, document.get("ros", {})),
        battery=build(BatterySettings, document["battery"]) if "battery" in document else None,
        limits={name: JointLimits(**row) for name, row in document["limits"].items()},
        groups={
            name: build(StopGroup, {"name": name, **row})
            for name, row in document["groups"].items()
        },
        hands={
            name: build(Hand, {"name": name, **row})
            for name, row in document.get("hands", {}).items()
        },
        poses=subtables(document, "poses"),
        protection=protection_schema.build_protection(document),
        planning=build(PlanBounds, document.get("planning", {})),
        twin=twin_settings(document),
        against_stops=stop_approach.read_approaches(document),
        broker=_broker(document.get("mqtt"), directory),
        things=known_things.read_things(document.get("things", [])),
        words=tuple(build(known_things.OwnWord, row) for row in document.get("words", [])),
        devices={row["name"]: _home_device(row, directory) for row in document.get("devices", ())},
    )


def _parts(document: Document, directory: Path, camera: CameraDescription | None) -> RobotParts:
    def made(key: str, make: Callable[[Document], P]) -> P | None:
        return make(document[key]) if key in document else None

    return RobotParts(
        base=made("base", lambda row: build(BaseGeometry, row)),
        can_bus=made("can_bus", lambda row: _can_bus(row, directory)),
        lidar=made("lidar", lambda row: SerialSensor(**row)),
        imu=made("imu", lambda row: SerialSensor(**row)),
        camera=camera,
        home=made("home", lambda row: _home(row, directory)),
        reach=made("reach", lambda row: build(Reach, row)),
        head=made("head", lambda row: Head(**row)),
    )


def _broker(record: Document | None, directory: Path) -> MqttBroker | None:
    if record is None:
        return None
    credentials = _sibling(record, "credentials", directory)
    return replace(build(MqttBroker, record), credentials=credentials)


def _home_device(record: Document, directory: Path) -> HomeDevice:
    device = build(HomeDevice, record)
    if device.http is None:
        return device
    credentials = _sibling(record["http"], "credentials", directory)
    return replace(device, http=replace(device.http, credentials=credentials))


def _can_bus(record: Document, directory: Path) -> CanBus:
    return replace(
        build(CanBus, record),
        eds_path=_sibling(record, "eds", directory),
        endpoints_path=_sibling(record, "endpoints", directory),
    )


def _sibling(record: Document, key: str, directory: Path) -> Path | None:
    """Return a file that the record names relative to the robot file."""
    return directory / record[key] if key in record else None


def _home(row: Document, directory: Path) -> Home:
    return Home(
        map_path=directory / row["map"],
        start=row["start"],
        places={
            name: build(Place, {"name": name, "pose": place, **place})
            for name, place in row["places"].items()
        },
        zones=tuple(build(KeepOutZone, zone) for zone in row["zones"]),
    )
