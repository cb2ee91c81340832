"""Define what the parts of the gateway share: graph, robot, time, settings, and their pace."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, Protocol

from vla_deploy.client.link import RobotLink
from vla_deploy.gateways.ros.commands import RobotCommands
from vla_deploy.gateways.ros.conversions import RosTime
from vla_deploy.gateways.ros.graph import GraphLink, JsonTopic
from vla_deploy.ipc import topics
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.ros_settings import RosSettings

MAP: Final = "map"
ODOM: Final = "odom"
_STATUS_AGE_S: Final = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Gateway:
    """Hold for each part what it works with; `feedback` takes what becomes of commands."""

    graph: GraphLink
    link: RobotLink
    time: RosTime
    robot: RobotDescription
    settings: RosSettings
    commands: RobotCommands
    feedback: JsonTopic

    def control_status(self) -> Mapping[str, Any] | None:
        """Return how control is, or None where it is silent."""
        return self.link.document(topics.CONTROL_STATUS, _STATUS_AGE_S)

    def battery(self) -> Mapping[str, Any] | None:
        """Return how the battery is, or None where nothing tells."""
        return self.link.document(topics.BATTERY, topics.BATTERY.deadline_s)


class GatewayPart(Protocol):
    """Do one thing for the graph; a part that is stepped or stopped for nothing inherits that."""

    def step(self, now_ns: int) -> None:
        """Publish or handle what is due; called at the gateway's pace."""
        return

    def stop(self) -> None:
        """End what is under way, with a reason."""
        return


class Due:
    """Decide at a steady pace whether something is due; a missed time is left out."""

    def __init__(self, rate_hz: float) -> None:
        self._period_ns = round(1e9 / rate_hz) if rate_hz > 0 else 0
        self._at_ns = 0

    def is_now(self, now_ns: int) -> bool:
        """Return whether it is due, at most once for each time."""
        if self._period_ns == 0 or now_ns < self._at_ns:
            return False
        # A step that comes a little late does not move those after it.
        self._at_ns = max(self._at_ns + self._period_ns, now_ns - self._period_ns // 2)
        return True
