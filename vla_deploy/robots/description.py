"""Describe one robot as immutable values: what it is wired to, how it may move, where it lives."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from drivers.camera.protocol import Intrinsics
from vla_deploy.robots.floor_pose import Pose2D
from vla_deploy.robots.plan_bounds import NOT_BOUNDED, PlanBounds
from vla_deploy.robots.protection import NOTHING_DECLARED, Protection
from vla_deploy.robots.ros_settings import UNUSED, RosSettings


class StopCategory(IntEnum):
    """Name the stop categories of IEC 60204-1."""

    POWER_REMOVED = 0
    STOP_THEN_REMOVE_POWER = 1
    STOP_KEEP_POWER = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class ServoModel:
    """Give a servo model's datasheet figures at 12 V."""

    stall_torque_nm: float
    no_load_speed_rad_s: float
    mass_kg: float
    source: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Servo:
    """Tie one servo to one joint.

    joint = offset + sign * travel_per_rad * angle, where angle is 0 at the servo's centre
    (position 2048). `travel_per_rad` is 1 for a hinge and the pinion's radius in m for a finger.
    """

    id: int
    model: str
    joint: str
    sign: int
    offset: float
    travel_per_rad: float


@dataclass(frozen=True, slots=True, kw_only=True)
class ServoBus:
    """Describe the serial bus that carries every servo; their order is the joint order."""

    device: str
    path: str
    baud: int
    protocol: int
    servos: tuple[Servo, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Drive:
    """Tie one drive to one wheel: wheel speed = sign * motor speed / gear_ratio.

    `mode` and `counts_per_rev`, of the motor, are a CiA 402 drive's, `current_limit_a` an ODrive's.
    """

    node_id: int
    joint: str
    sign: int
    gear_ratio: float
    mode: str = "profile_velocity"
    counts_per_rev: int = 16384
    current_limit_a: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class CanBus:
    """Describe the CAN bus that carries the wheel drives.

    `eds_path` is the file of CiA 402 drives that are not the stack's own, `endpoints_path` the
    vendor's list of an ODrive firmware's properties.
    """

    device: str
    path: str
    bitrate: int
    protocol: str = "cia402"
    eds_path: Path | None = None
    endpoints_path: Path | None = None
    drives: tuple[Drive, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class BaseGeometry:
    """Give the differential drive's dimensions and the speeds it may reach."""

    wheel_radius_m: float
    track_m: float
    max_speed_m_s: float
    max_turn_rad_s: float
    max_acceleration_m_s2: float
    max_turn_acceleration_rad_s2: float
    footprint_radius_m: float
    stop_deceleration_m_s2: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class SerialSensor:
    """Describe a sensor on a serial line; `site` names its place in the MJCF."""

    device: str
    path: str
    model: str
    site: str


@dataclass(frozen=True, slots=True, kw_only=True)
class LensCalibration:
    """Hold what was measured of a lens; what a file of another tool does not tell is None or ""."""

    intrinsics: Intrinsics
    distortion_model: str
    reprojection_error_px: float | None
    views: int | None
    made_at: str
    tool: str


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraMounting:
    """Hold by how much the camera sits otherwise than its site, measured with a lens `focal_px`.

    `residual_m` is how far apart the measurements put the board; `made_at` is a date for people.
    """

    site: str
    model: str
    focal_px: float
    translation_m: tuple[float, float, float]
    quaternion_xyzw: tuple[float, float, float, float]
    residual_m: float
    made_at: str

    def matrix(self) -> NDArray[np.float64]:
        """Return the camera's optical frame in the frame of its site, 4 x 4."""
        x, y, z, w = np.array(self.quaternion_xyzw) / np.linalg.norm(self.quaternion_xyzw)
        pose: NDArray[np.float64] = np.eye(4)
        pose[:3, :3] = (
            (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
            (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
            (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
        )
        pose[:3, 3] = self.translation_m
        return pose


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraDescription:
    """Describe the RGB-D camera; `site` is its optical frame: x right, y down, z forward.

    `lens` and `mounting` are what calibration measured; None means as told by the camera, and as
    drawn in the MJCF.
    """

    device: str
    path: str
    model: str
    site: str
    width: int
    height: int
    fovy_rad: float
    lens: LensCalibration | None = None
    mounting: CameraMounting | None = None

    @property
    def intrinsics(self) -> Intrinsics:
        """Return the calibrated lens, or the pinhole of the robot file's opening angle."""
        return self.pinhole if self.lens is None else self.lens.intrinsics

    @property
    def pinhole(self) -> Intrinsics:
        """Return the lens without faults that has the robot file's size and opening angle."""
        return Intrinsics(
            width=self.width,
            height=self.height,
            fx=self.focal_px,
            fy=self.focal_px,
            cx=(self.width - 1) / 2,
            cy=(self.height - 1) / 2,
        )

    @property
    def site_from_camera(self) -> NDArray[np.float64]:
        """Return where the camera sits in the frame of its site, 4 x 4."""
        return np.eye(4) if self.mounting is None else self.mounting.matrix()

    @property
    def focal_px(self) -> float:
        """Return the focal length in pixels, the same in both directions."""
        return float(self.height / 2 / np.tan(self.fovy_rad / 2))


@dataclass(frozen=True, slots=True, kw_only=True)
class EstopButtonDescription:
    """Describe the emergency-stop input; `number` is a key's code (HID) or a GPIO line's offset."""

    device: str
    path: str
    model: str
    number: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Audio:
    """Describe a microphone or a speaker; `path` is its name at the sound system, or a socket."""

    device: str
    path: str
    rate_hz: int
    channels: int


@dataclass(frozen=True, slots=True, kw_only=True)
class VoiceSettings:
    """Describe how the robot sounds; `voice` is one of eSpeak NG's.

    An empty `program` is the one on the PATH. `volume_ratio` is of the speaker's full scale.
    """

    voice: str = "en-gb"
    program: str = ""
    words_per_minute: int = 160
    pitch: int = 50
    volume_ratio: float = 0.8


@dataclass(frozen=True, slots=True, kw_only=True)
class JointLimits:
    """Bound one joint's motion in its own unit (rad, or m for a finger)."""

    min: float
    max: float
    velocity: float
    acceleration: float
    jerk: float


@dataclass(frozen=True, slots=True, kw_only=True)
class StopGroup:
    """Name joints that stop together, and how.

    A group that holds something keeps its power through a stop, unless it may `drop_payload`.
    """

    name: str
    joints: tuple[str, ...]
    stop_category: StopCategory
    drop_payload: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Hand:
    """Tie an arm to its gripper; the opening between the pads is opening_ratio * gripper joint."""

    name: str
    arm: str
    gripper: str
    grip_site: str
    opening_ratio: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """Name a pose to drive to, and the poses from which its furniture can be searched."""

    name: str
    pose: Pose2D
    aliases: tuple[str, ...]
    viewpoints: tuple[Pose2D, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class KeepOutZone:
    """Bound a part of the floor, as a polygon in the map frame, that the base must not enter."""

    name: str
    reason: str
    polygon_m: tuple[tuple[float, float], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Home:
    """Describe where the robot lives; `start` names the place where it is switched on."""

    map_path: Path
    start: str
    places: Mapping[str, Place]
    zones: tuple[KeepOutZone, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotDescription:
    """Hold everything that the robot file declares."""

    name: str
    mjcf_path: Path
    servo_bus: ServoBus
    servo_models: Mapping[str, ServoModel]
    can_bus: CanBus
    base: BaseGeometry
    lidar: SerialSensor
    imu: SerialSensor
    camera: CameraDescription
    limits: Mapping[str, JointLimits]
    groups: Mapping[str, StopGroup]
    hands: Mapping[str, Hand]
    poses: Mapping[str, Mapping[str, float]]
    home: Home
    estop: EstopButtonDescription | None = None
    microphone: Audio | None = None
    speaker: Audio | None = None
    voice: VoiceSettings = VoiceSettings()
    ros: RosSettings = UNUSED
    protection: Protection = NOTHING_DECLARED
    planning: PlanBounds = NOT_BOUNDED

    @property
    def gripper_joints(self) -> frozenset[str]:
        """Return the joints of all grippers."""
        groups = [self.group(hand.gripper) for hand in self.hands.values()]
        return frozenset(joint for group in groups for joint in group.joints)

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Return the servo joints in the canonical order of every joint array."""
        return tuple(servo.joint for servo in self.servo_bus.servos)

    @property
    def joint_index(self) -> dict[str, int]:
        """Return each servo joint's place in a joint array."""
        return {name: index for index, name in enumerate(self.joint_names)}

    @property
    def places(self) -> Mapping[str, Place]:
        """Return the named places."""
        return self.home.places

    @property
    def start_pose(self) -> Pose2D:
        """Return the pose in which the robot is switched on."""
        return self.home.places[self.home.start].pose

    @property
    def position_min(self) -> NDArray[np.float64]:
        """Return the lower position limits in joint order."""
        return np.array([self.limits[name].min for name in self.joint_names])

    @property
    def position_max(self) -> NDArray[np.float64]:
        """Return the upper position limits in joint order."""
        return np.array([self.limits[name].max for name in self.joint_names])

    @property
    def velocity_max(self) -> NDArray[np.float64]:
        """Return the velocity limits in joint order."""
        return np.array([self.limits[name].velocity for name in self.joint_names])

    @property
    def acceleration_max(self) -> NDArray[np.float64]:
        """Return the acceleration limits in joint order."""
        return np.array([self.limits[name].acceleration for name in self.joint_names])

    @property
    def jerk_max(self) -> NDArray[np.float64]:
        """Return the jerk limits in joint order."""
        return np.array([self.limits[name].jerk for name in self.joint_names])

    def group(self, name: str) -> StopGroup:
        """Return a joint group.

        Raises:
            KeyError: the robot has no group of that name; the message lists those it has.
        """
        try:
            return self.groups[name]
        except KeyError:
            known = ", ".join(self.groups)
            raise KeyError(f"{self.name} has no joint group {name!r}; it has {known}") from None

    def model_of(self, joint: str) -> ServoModel:
        """Return the datasheet of the servo that drives `joint`."""
        servo = self.servo_bus.servos[self.joint_index[joint]]
        return self.servo_models[servo.model]

    def stall_effort(self, joint: str) -> float:
        """Return a stalled servo's torque on its joint in N m; for a finger its force, in N."""
        servo = self.servo_bus.servos[self.joint_index[joint]]
        return self.servo_models[servo.model].stall_torque_nm / servo.travel_per_rad

    def groups_moving(self, joints: Iterable[str]) -> tuple[str, ...]:
        """Return the names of the groups that move any of these joints."""
        moved = frozenset(joints)
        return tuple(name for name, group in self.groups.items() if moved & set(group.joints))

    def device_path(self, name: str, devices_dir: Path | None = None) -> str:
        """Return where a device is reached: the file's own path, or `<devices_dir>/<name>`.

        Raises:
            KeyError: the robot has no device of that name; the message lists those it has.
        """
        fixed = (self.servo_bus, self.can_bus, self.lidar, self.imu, self.camera)
        optional = (self.estop, self.microphone, self.speaker)
        paths = {device.device: device.path for device in (*fixed, *optional) if device}
        if name not in paths:
            raise KeyError(f"{self.name} has no device {name!r}; it has {', '.join(paths)}")
        return paths[name] if devices_dir is None else str(devices_dir / name)
