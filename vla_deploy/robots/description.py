"""Describe one robot as an immutable value: how it may move, where it lives, what it is made of."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from pathlib import Path
from types import MappingProxyType
from typing import Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from drivers.servo.tools.travel import StopApproach
from vla_deploy.robots.battery_settings import BatterySettings
from vla_deploy.robots.camera import CameraDescription
from vla_deploy.robots.devices import (
    USUAL_VOICE,
    Audio,
    CanBus,
    EstopButtonDescription,
    PowerRelayDescription,
    SerialSensor,
    ServoBus,
    ServoModel,
    VoiceSettings,
)
from vla_deploy.robots.errors import PartMissing
from vla_deploy.robots.floor_pose import Pose2D
from vla_deploy.robots.home_devices import HomeDevice, MqttBroker
from vla_deploy.robots.known_things import KnownThing, OwnWord
from vla_deploy.robots.plan_bounds import NOT_BOUNDED, PlanBounds
from vla_deploy.robots.protection import NOTHING_DECLARED, Protection
from vla_deploy.robots.reach import Reach
from vla_deploy.robots.ros_settings import UNUSED, RosSettings
from vla_deploy.robots.twin_settings import USUAL_TWIN, TwinSettings

P = TypeVar("P")


class StopCategory(IntEnum):
    """Name the stop categories of IEC 60204-1."""

    POWER_REMOVED = 0
    STOP_THEN_REMOVE_POWER = 1
    STOP_KEEP_POWER = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class BaseGeometry:
    """Give the base's dimensions and the speeds it may reach.

    One with a `track_m` has two wheels side by side; one with a `base_radius_m` has omni wheels,
    each at that distance from the middle and at its bearing, its axle pointing outwards.
    """

    wheel_radius_m: float
    track_m: float | None = None
    base_radius_m: float | None = None
    wheel_bearings_rad: tuple[float, ...] = ()
    """Where each omni wheel is, counter-clockwise from the front, in the order of the wheels."""
    max_wheel_rad_s: float | None = None
    """Faster than this no wheel is asked to turn; the base as a whole slows down instead."""
    max_speed_m_s: float
    max_turn_rad_s: float
    max_acceleration_m_s2: float
    max_turn_acceleration_rad_s2: float
    footprint_radius_m: float
    stop_deceleration_m_s2: float | None = None

    @property
    def is_holonomic(self) -> bool:
        """Return whether it can drive sideways."""
        return self.base_radius_m is not None

    @property
    def lever_m(self) -> float:
        """Return how far a wheel runs when the base turns by one radian."""
        return self.base_radius_m or 0.5 * (self.track_m or 0.0)


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
    """Tie an arm to its gripper.

    The opening between the pads is opening_offset_m + opening_ratio * gripper joint. Of one with a
    single moving jaw, `fixed_pad_m` is how far the fixed one's pad lies from the grip site, against
    the closing axis; both move where it is None. An empty hand travels in the pose `travel_pose`,
    a full one at `carry_point_m` of the base frame, pointing down, or like an empty one.
    """

    name: str
    arm: str
    gripper: str
    grip_site: str
    opening_ratio: float
    opening_offset_m: float = 0.0
    fixed_pad_m: float | None = None
    travel_pose: str | None = None
    carry_point_m: tuple[float, float, float] | None = None

    def middle_m(self, width_m: float, gap_m: float = 0.0) -> float:
        """Return how far along the closing axis from the grip site the middle of a held thing is.

        It is `width_m` wide, and `gap_m` away from the pad that does not move, where there is one.
        """
        return 0.0 if self.fixed_pad_m is None else 0.5 * width_m + gap_m - self.fixed_pad_m

    def opening_m(self, position: float) -> float:
        """Return the opening between the pads at a position of the gripper's joint."""
        return self.opening_offset_m + self.opening_ratio * position

    def position_at(self, opening_m: float) -> float:
        """Return the position of the gripper's joint at an opening between the pads."""
        return (opening_m - self.opening_offset_m) / self.opening_ratio


@dataclass(frozen=True, slots=True, kw_only=True)
class Head:
    """Name the joints that turn the camera: `pan` left and `tilt` down where they are positive."""

    pan: str
    tilt: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """Name a pose to drive to, and the poses from which its furniture can be searched.

    `floor_m` bounds the floor that belongs to it, such as a room's, as a polygon in the map frame.
    """

    name: str
    pose: Pose2D
    aliases: tuple[str, ...]
    viewpoints: tuple[Pose2D, ...]
    floor_m: tuple[tuple[float, float], ...] = ()


_HERE: Final = Pose2D(x_m=0.0, y_m=0.0, yaw_rad=0.0)
MOUNT: Final[Mapping[str, Place]] = MappingProxyType(
    {
        "table": Place(
            name="table", pose=_HERE, aliases=("desk", "workbench", "bench"), viewpoints=(_HERE,)
        )
    }
)
"""What a robot without a base stands on, whatever people call it."""
FLOOR: Final[Mapping[str, Place]] = MappingProxyType(
    {"floor": Place(name="floor", pose=_HERE, aliases=("ground",), viewpoints=(_HERE,))}
)
"""Where a robot works that drives, but has no map of where."""


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
class RobotParts:
    """Hold what a robot may have beside its servos; None is a part that it does not have.

    A base is driven by the CAN bus or by wheels of the servo bus. With a lidar it has a home, whose
    map tells it where it is; without one it drives by what its wheels tell.
    """

    base: BaseGeometry | None = None
    can_bus: CanBus | None = None
    lidar: SerialSensor | None = None
    imu: SerialSensor | None = None
    camera: CameraDescription | None = None
    home: Home | None = None
    reach: Reach | None = None
    head: Head | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotDescription:
    """Hold everything that the robot file declares.

    `parts` has those that a robot may lack. Who cannot work without one asks for it by its name,
    such as `robot.base`, and gets PartMissing where there is none.
    """

    name: str
    folder: Path
    """Where its file is, and what belongs to this one robot of its kind, as its calibration."""
    mjcf_path: Path
    servo_bus: ServoBus
    servo_models: Mapping[str, ServoModel]
    parts: RobotParts
    limits: Mapping[str, JointLimits]
    groups: Mapping[str, StopGroup]
    hands: Mapping[str, Hand]
    poses: Mapping[str, Mapping[str, float]]
    estop: EstopButtonDescription | None = None
    power_relay: PowerRelayDescription | None = None
    """It stands in the servos' supply, and is closed while it is fed."""
    microphone: Audio | None = None
    speaker: Audio | None = None
    voice: VoiceSettings = USUAL_VOICE
    ros: RosSettings = UNUSED
    battery: BatterySettings | None = None
    protection: Protection = NOTHING_DECLARED
    planning: PlanBounds = NOT_BOUNDED
    read_only: bool = False
    """A person moves its joints: it never has torque, and nothing moves it."""
    broker: MqttBroker | None = None
    twin: TwinSettings = USUAL_TWIN
    devices: Mapping[str, HomeDevice] = field(default_factory=dict)
    """What the robot switches in its home, by name."""
    things: tuple[KnownThing, ...] = ()
    """What it knows the size of."""
    words: tuple[OwnWord, ...] = ()
    against_stops: Mapping[str, StopApproach] = field(default_factory=dict)
    """Which joints may be calibrated by driving them against their stops, and how."""

    @property
    def base(self) -> BaseGeometry:
        """Return the base.

        Raises:
            PartMissing: the robot stands where it is mounted.
        """
        return self._part(self.parts.base, "base")

    @property
    def can_bus(self) -> CanBus:
        """Return the bus of the wheel drives.

        Raises:
            PartMissing: the robot has none.
        """
        return self._part(self.parts.can_bus, "can_bus")

    @property
    def lidar(self) -> SerialSensor:
        """Return the lidar.

        Raises:
            PartMissing: the robot has none.
        """
        return self._part(self.parts.lidar, "lidar")

    @property
    def imu(self) -> SerialSensor:
        """Return the IMU.

        Raises:
            PartMissing: the robot has none.
        """
        return self._part(self.parts.imu, "imu")

    @property
    def camera(self) -> CameraDescription:
        """Return the camera.

        Raises:
            PartMissing: the robot has none.
        """
        return self._part(self.parts.camera, "camera")

    @property
    def home(self) -> Home:
        """Return the home.

        Raises:
            PartMissing: the robot file has none.
        """
        return self._part(self.parts.home, "home")

    @property
    def reach(self) -> Reach:
        """Return where its hands take things.

        Raises:
            PartMissing: the robot file does not say.
        """
        return self._part(self.parts.reach, "reach")

    @property
    def head(self) -> Head:
        """Return the joints that turn the camera.

        Raises:
            PartMissing: the robot has none.
        """
        return self._part(self.parts.head, "head")

    def _part(self, part: P | None, name: str) -> P:
        if part is None:
            raise PartMissing(
                f"{self.name} has no {name.replace('_', ' ')}: [{name}] is not in its file"
            )
        return part

    @property
    def never_moves(self) -> str:
        """Say why nothing moves it, "" where it may be moved."""
        return f"{self.name} is a leader: it is only read" if self.read_only else ""

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
    def wheel_joints(self) -> tuple[str, ...]:
        """Return the joints that drives or servos turn as wheels, none without a base."""
        bus = self.parts.can_bus
        return tuple(one.joint for one in (bus.drives if bus else self.servo_bus.wheels))

    @property
    def joint_index(self) -> dict[str, int]:
        """Return each servo joint's place in a joint array."""
        return {name: index for index, name in enumerate(self.joint_names)}

    @property
    def places(self) -> Mapping[str, Place]:
        """Return the named places: those of its home, else the floor, or what it is mounted on."""
        if self.parts.home is not None:
            return self.parts.home.places
        return MOUNT if self.parts.base is None else FLOOR

    @property
    def finds_its_way(self) -> bool:
        """Return whether it knows its place on a map, and so can be sent to a place."""
        return self.parts.base is not None and self.parts.home is not None

    @property
    def start_pose(self) -> Pose2D:
        """Return the pose in which the robot is switched on, the map's origin without a home."""
        home = self.parts.home
        return home.places[home.start].pose if home else _HERE

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

    def gripper_joint(self, hand: str) -> str:
        """Return the joint of a hand's gripper."""
        (joint,) = self.group(self.hands[hand].gripper).joints
        return joint

    def widest_m(self, hand: str) -> float:
        """Return how far a hand opens."""
        return self.hands[hand].opening_m(self.limits[self.gripper_joint(hand)].max)

    def model_of(self, joint: str) -> ServoModel:
        """Return the datasheet of the servo that drives `joint`."""
        servo = self.servo_bus.servos[self.joint_index[joint]]
        return self.servo_models[servo.model]

    def stall_effort(self, joint: str) -> float:
        """Return what a joint's stalled servos give it in N m; for a finger their force, in N."""
        bus = self.servo_bus
        turning = (one for one in (*bus.servos, *bus.shadows) if one.joint == joint)
        return sum(
            self.servo_models[one.model].stall_torque_nm / one.travel_per_rad for one in turning
        )

    def groups_moving(self, joints: Iterable[str]) -> tuple[str, ...]:
        """Return the names of the groups that move any of these joints."""
        moved = frozenset(joints)
        return tuple(name for name, group in self.groups.items() if moved & set(group.joints))

    def device_path(self, name: str, devices_dir: Path | None = None) -> str:
        """Return where a device is reached: the file's own path, or `<devices_dir>/<name>`.

        Raises:
            KeyError: the robot has no device of that name; the message lists those it has.
        """
        parts = self.parts
        devices = (self.servo_bus, parts.can_bus, parts.lidar, parts.imu, parts.camera)
        others = (self.estop, self.power_relay, self.microphone, self.speaker)
        paths = {device.device: device.path for device in (*devices, *others) if device}
        if name not in paths:
            raise KeyError(f"{self.name} has no device {name!r}; it has {', '.join(paths)}")
        return paths[name] if devices_dir is None else str(devices_dir / name)
