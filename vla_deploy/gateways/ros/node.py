"""Run the gateway: parts that publish, parts that take, and how the gateway itself is."""

import logging
from collections.abc import Sequence
from functools import partial
from typing import Final

from platforms import load_profile
from vla_deploy.client.link import RobotLink
from vla_deploy.gateways.ros.applying import holding
from vla_deploy.gateways.ros.commands import RobotCommands
from vla_deploy.gateways.ros.conversions import RosTime
from vla_deploy.gateways.ros.geometry import BodyFrames
from vla_deploy.gateways.ros.graph import SOURCE, GraphLink, JsonTopic
from vla_deploy.gateways.ros.inward.parts import inward_parts
from vla_deploy.gateways.ros.outgoing.courier import Courier
from vla_deploy.gateways.ros.outgoing.lending import Lending
from vla_deploy.gateways.ros.outward.body import BodyTopics
from vla_deploy.gateways.ros.outward.context_topics import ContextTopics
from vla_deploy.gateways.ros.outward.maps import EnvironmentMap, StaticMap, read_robot_map
from vla_deploy.gateways.ros.outward.markers import SceneMarkers
from vla_deploy.gateways.ros.outward.planner_topics import PlannerTopics
from vla_deploy.gateways.ros.outward.robot_state import (
    EventsTopic,
    HealthTopic,
    StateTopic,
    SupplyTopic,
)
from vla_deploy.gateways.ros.outward.scene import Locator, SceneObjects
from vla_deploy.gateways.ros.outward.sensors import Images, Inertia, Scans
from vla_deploy.gateways.ros.outward.voice import VoiceTopics
from vla_deploy.gateways.ros.parameters import handed_over_parameters
from vla_deploy.gateways.ros.part import Due, Gateway, GatewayPart
from vla_deploy.gateways.ros.shared_memory import remove_leftovers
from vla_deploy.ipc import CellWriter, topics
from vla_deploy.ipc.payloads.services import RosStatus
from vla_deploy.robots import load_robot
from vla_deploy.robots.ros_settings import Accepts
from vla_deploy.runtime.node import NodeContext
from vla_deploy.runtime.part_guard import PartGuard

FEEDBACK_TOPICS: Final = ("/cognitive_planner/feedback", "/llm_planner/feedback")
_STATUS_HZ: Final = 2.0
_MOST_RATE_HZ: Final = 100.0
_log = logging.getLogger(__name__)


class RosGatewayNode:
    """Step every part at the rate of the fastest, and publish twice a second how the gateway is."""

    def __init__(self, context: NodeContext) -> None:
        self._context = context
        self._robot = load_robot(context.robot)
        settings = self._robot.ros
        rate_hz = max(settings.joint_state_rate_hz, settings.odometry_rate_hz, 20.0)
        self.period_s = 1.0 / min(rate_hz, _MOST_RATE_HZ)
        self._link = RobotLink(context.run_dir, context.clock, source=SOURCE, robot=context.robot)
        self._time = RosTime(context.clock)
        self._parts: Sequence[GatewayPart] = ()
        self._guard = PartGuard(_log)
        self._status_due = Due(_STATUS_HZ)
        given, profile = handed_over_parameters(), load_profile(context.profile)
        self._parameters = holding(given, self._robot, profile)
        self._graph: GraphLink | None = None
        self._status: CellWriter[RosStatus]

    def start(self) -> None:
        """Join the graph."""
        self._status = self._link.space.cell_writer(topics.ROS_STATUS)
        for leftover in remove_leftovers():
            _log.info("removed %s, which a killed process of ROS has left", leftover.name)
        self._graph = GraphLink(self._parameters)
        gateway = Gateway(
            graph=self._graph,
            link=self._link,
            time=self._time,
            robot=self._robot,
            settings=self._robot.ros,
            commands=RobotCommands(self._link, self._time.now_ns),
            feedback=JsonTopic(self._graph, *FEEDBACK_TOPICS),
        )
        lending = Lending(self._link)
        # What is lent no longer is known before anything is taken from the graph.
        self._parts = (
            *outward_parts(gateway),
            Courier(gateway, lending),
            *inward_parts(gateway, lending),
        )
        self._graph.begin()
        accept = self._robot.ros.accept
        if accept is not Accepts.ALL:
            _log.info("what may be commanded over ROS: %s", accept.value)

    def step(self) -> None:
        """Handle what came in, then step every part."""
        if self._graph is None:
            return
        self._time.refresh()
        self._guard.run("inbox", self._graph.take)
        for part in self._parts:
            self._guard.run(type(part).__name__, partial(part.step, self._context.clock.now_ns()))
        if self._status_due.is_now(self._context.clock.now_ns()):
            self._publish_status(self._graph)

    def stop(self) -> None:
        """End what is under way for the graph, with a reason, and leave."""
        for part in self._parts:
            part.stop()
        if self._graph is not None:
            self._graph.close()
        self._link.close()

    def _publish_status(self, graph: GraphLink) -> None:
        node = graph.node
        self._status.put_document(
            {
                "node": node.get_fully_qualified_name(),
                "domain_id": node.context.get_domain_id(),
                "accept": self._robot.ros.accept.value,
                "simulated_time": self._time.is_simulated,
                "dropped": graph.dropped,
                "failures": dict(self._guard.failures),
            }
        )


def outward_parts(gateway: Gateway) -> tuple[GatewayPart, ...]:
    """Return the parts that publish; the commands' news come first, since others read them."""
    locator = Locator(gateway.link, gateway.robot)
    file, frames = read_robot_map(gateway), BodyFrames(gateway.robot)
    return (
        gateway.commands,
        BodyTopics(gateway),
        Scans(gateway),
        Inertia(gateway),
        Images(gateway),
        StaticMap(gateway, file),
        EnvironmentMap(gateway, frames, file),
        SceneObjects(gateway, frames),
        SceneMarkers(gateway, locator),
        StateTopic(gateway),
        SupplyTopic(gateway),
        HealthTopic(gateway),
        EventsTopic(gateway),
        PlannerTopics(gateway, locator),
        ContextTopics(gateway, locator, file),
        VoiceTopics(gateway),
    )
