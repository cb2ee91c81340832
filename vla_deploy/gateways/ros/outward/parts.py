"""List what the gateway tells the graph."""

from vla_deploy.gateways.ros.geometry.body_frames import BodyFrames
from vla_deploy.gateways.ros.geometry.locator import Locator
from vla_deploy.gateways.ros.outward.body import BodyTopics
from vla_deploy.gateways.ros.outward.context_topics import ContextTopics
from vla_deploy.gateways.ros.outward.environment_map import EnvironmentMap
from vla_deploy.gateways.ros.outward.maps import StaticMap, read_robot_map
from vla_deploy.gateways.ros.outward.markers import SceneMarkers
from vla_deploy.gateways.ros.outward.objects import SceneObjects
from vla_deploy.gateways.ros.outward.planner_topics import PlannerTopics
from vla_deploy.gateways.ros.outward.robot_events import EventsTopic
from vla_deploy.gateways.ros.outward.robot_state import HealthTopic, StateTopic, SupplyTopic
from vla_deploy.gateways.ros.outward.sensors import Images, Inertia, Scans
from vla_deploy.gateways.ros.outward.voice import VoiceTopics
from vla_deploy.gateways.ros.part import Gateway, GatewayPart


def outward_parts(gateway: Gateway) -> tuple[GatewayPart, ...]:
    """Return the parts that tell; the commands' news come first, since others read them."""
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
