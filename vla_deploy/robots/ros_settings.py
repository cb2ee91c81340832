"""Declare how a robot takes part in a ROS 2 graph: the `[ros]` table of the robot file."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from vla_deploy.runtime.table_schema import TEXT, Shape, integer, number, one_of


class Accepts(StrEnum):
    """Name what may be commanded over ROS."""

    NOTHING = "off"
    STOP = "stop"
    ALL = "all"


@dataclass(frozen=True, slots=True, kw_only=True)
class RosSettings:
    """Declare whether the gateway runs, in which environment, and what may be commanded through it.

    `python` is an interpreter or an environment's folder, `workspace` a colcon workspace on top of
    ROS; empty ones are looked for. No `domain_id` is ROS_DOMAIN_ID, else 0; `discovery` is
    ROS_AUTOMATIC_DISCOVERY_RANGE. A robot whose `navigation` is "nav2" drives by a
    `navigate_to_pose` server, and one whose `arms` are "follow_joint_trajectory" moves them by
    servers of that action: both not the robot's own. Each arm has its server,
    `<group>_controller/follow_joint_trajectory`, unless `trajectory_server` names one for all.
    """

    enabled: bool = False
    accept: Accepts = Accepts.ALL
    domain_id: int | None = None
    discovery: str = "localhost"
    python: str = ""
    workspace: str = ""
    cmd_vel_stamped: bool = False
    joint_state_rate_hz: float = 50.0
    odometry_rate_hz: float = 50.0
    image_rate_hz: float = 5.0
    navigation: str = "own"
    arms: str = "own"
    trajectory_server: str = ""

    @property
    def is_driven_by_nav2(self) -> bool:
        """Return whether a `navigate_to_pose` server drives the base to poses."""
        return self.navigation == NAV2

    @property
    def are_arms_beyond(self) -> bool:
        """Return whether servers of FollowJointTrajectory move the arms."""
        return self.arms == FOLLOW_JOINT_TRAJECTORY

    @property
    def is_needed(self) -> bool:
        """Return whether the robot cannot do its work without the ROS gateway."""
        return self.is_driven_by_nav2 or self.are_arms_beyond

    def server_of(self, group: str) -> str:
        """Return the name of the server that moves an arm."""
        return self.trajectory_server or f"{group}_controller/{FOLLOW_JOINT_TRAJECTORY}"


UNUSED: Final = RosSettings()
_OWN: Final = "own"
NAV2: Final = "nav2"
FOLLOW_JOINT_TRAJECTORY: Final = "follow_joint_trajectory"
_FLAG: Final = one_of(False, True).optional
ROS: Final[Shape] = {
    "enabled": _FLAG,
    "accept": one_of(*(one.value for one in Accepts)).optional,
    # Domains above 101 meet the ports that Linux hands out by itself.
    "domain_id": integer(0, 101).optional,
    "discovery": one_of("localhost", "subnet", "off", "system_default").optional,
    "python": TEXT.optional,
    "workspace": TEXT.optional,
    "cmd_vel_stamped": _FLAG,
    "joint_state_rate_hz": number(1, 250, "Hz").optional,
    "odometry_rate_hz": number(1, 100, "Hz").optional,
    "image_rate_hz": number(0, 30, "Hz").optional,
    "navigation": one_of(_OWN, NAV2).optional,
    "arms": one_of(_OWN, FOLLOW_JOINT_TRAJECTORY).optional,
    "trajectory_server": TEXT.optional,
}
