"""Declare what control asks of the base's drives, and stand in for them where there are none."""

from typing import Protocol

from drivers.clock import Clock
from drivers.opener import DeviceOpener
from drivers.servo.state import SILENT_S
from drivers.wheel_drives.bus import DriveBus, DriveState
from platforms import Profile
from vla_deploy.control.motion.base_velocity import STANDING, BaseVelocity
from vla_deploy.control.output.base_kinematics import DifferentialDrive
from vla_deploy.control.output.drive_buses import drive_bus
from vla_deploy.control.output.odometry import Odometry
from vla_deploy.control.output.servo_drives import ServoDrives
from vla_deploy.control.output.servos import ServoLine
from vla_deploy.control.output.wheels import Wheels
from vla_deploy.robots import RobotDescription
from vla_deploy.safety import DriveSample


class BaseDrive(Protocol):
    """Drive the base; a lost bus is remembered after `open`, not raised."""

    name: str
    lost: bool
    failure: str
    state: DriveState | None
    velocity: BaseVelocity
    odometry: Odometry

    @property
    def has_wheels(self) -> bool:
        """Return whether there is anything to drive."""
        ...

    @property
    def enabled(self) -> bool:
        """Return whether the wheels follow the commanded speed."""
        ...

    @property
    def faulted(self) -> bool:
        """Return whether a drive is in a fault state."""
        ...

    @property
    def still(self) -> bool:
        """Return whether the wheels stand, or cannot be driven any more."""
        ...

    @property
    def counters(self) -> dict[str, int] | None:
        """Return what the base's own bus has counted; None where it has none of its own."""
        ...

    def open(self) -> None:
        """Open the bus and set the drives up.

        Raises:
            DriverError: the interface is missing, or a drive is silent or not as declared.
        """
        ...

    def try_reopen(self) -> bool:
        """Go a step towards opening a lost bus again, and return whether it is back."""
        ...

    def samples(self) -> tuple[DriveSample, ...]:
        """Return what the safety judge wants to know of each drive."""
        ...

    def within(self, velocity: BaseVelocity) -> BaseVelocity:
        """Return a velocity on the same curve that asks no wheel for more than it may turn."""
        ...

    def cycle(self, v_m_s: float, w_rad_s: float, left_m_s: float = 0.0) -> None:
        """Command a base velocity, and take in what the drives tell."""
        ...

    def enable(self) -> None:
        """Begin to power the drives."""
        ...

    def disable(self) -> None:
        """Take the power off the drives."""
        ...

    def cut_power(self) -> None:
        """Take the power off at once."""
        ...

    def quick_stop(self) -> None:
        """Let the drives brake by themselves, then take their power off."""
        ...

    def reset_fault(self) -> None:
        """Ask faulted drives to leave their fault."""
        ...

    def close(self) -> None:
        """Brake, and leave the bus."""
        ...


class FixedBase:
    """Be the base of a robot that stands where it is mounted: nothing drives, nothing fails."""

    has_wheels = False
    enabled = False
    faulted = False
    still = True

    def __init__(self) -> None:
        self.name = "base"
        self.lost = False
        self.failure = ""
        self.state: DriveState | None = None
        self.velocity = STANDING
        self.odometry = Odometry(DifferentialDrive(wheel_radius_m=1.0, track_m=1.0))

    @property
    def counters(self) -> None:
        """Return that there is no bus."""
        return None

    def open(self) -> None:
        """Do nothing."""

    def try_reopen(self) -> bool:
        """Return that nothing came back, for nothing was lost."""
        return False

    def samples(self) -> tuple[DriveSample, ...]:
        """Return nothing: there are no drives to judge."""
        return ()

    def within(self, velocity: BaseVelocity) -> BaseVelocity:
        """Return that nothing moves."""
        return STANDING

    def cycle(self, v_m_s: float, w_rad_s: float, left_m_s: float = 0.0) -> None:
        """Do nothing."""

    def enable(self) -> None:
        """Do nothing."""

    def disable(self) -> None:
        """Do nothing."""

    def cut_power(self) -> None:
        """Do nothing."""

    def quick_stop(self) -> None:
        """Do nothing."""

    def reset_fault(self) -> None:
        """Do nothing."""

    def close(self) -> None:
        """Do nothing."""


def base_drive(
    robot: RobotDescription,
    profile: Profile,
    devices: DeviceOpener,
    servos: ServoLine,
    clock: Clock,
) -> BaseDrive:
    """Return the wheels of a robot, on whichever bus they hang, or what stands in for them."""
    if robot.parts.base is None:
        return FixedBase()
    if robot.servo_bus.wheels:
        return servo_wheels(robot, servos, clock)
    return can_wheels(robot, profile, devices, clock)


def can_wheels(
    robot: RobotDescription, profile: Profile, devices: DeviceOpener, clock: Clock
) -> Wheels:
    """Return wheels that drives of a CAN bus turn."""
    wiring = robot.can_bus

    def open_bus() -> DriveBus:
        return drive_bus(wiring, profile, devices.can(wiring.device), clock)

    return Wheels(robot, wiring.device, open_bus, clock, age_limit_s=profile.can_heartbeat_s)


def servo_wheels(robot: RobotDescription, servos: ServoLine, clock: Clock) -> Wheels:
    """Return wheels that servos turn, on the bus of the joints."""
    return Wheels(
        robot,
        f"{servos.name}: wheels",
        lambda: ServoDrives(servos, clock),
        clock,
        age_limit_s=SILENT_S,
    )
