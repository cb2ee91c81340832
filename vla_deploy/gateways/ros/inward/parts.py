"""List what the gateway takes from the graph, as far as the robot file permits it."""

from collections.abc import Iterator
from typing import Final

from control_msgs.action import FollowJointTrajectory
from nav2_msgs.action import NavigateToPose
from vla_deploy_msgs.action import ExecutePlan

from vla_deploy.gateways.ros.inward.acts import Acts
from vla_deploy.gateways.ros.inward.command_topics import CommandTopics
from vla_deploy.gateways.ros.inward.grippers import gripper_desks
from vla_deploy.gateways.ros.inward.motions import Motions
from vla_deploy.gateways.ros.inward.navigation import NavigationServer
from vla_deploy.gateways.ros.inward.orders import Orders
from vla_deploy.gateways.ros.inward.plans import PlanServer
from vla_deploy.gateways.ros.inward.pursuing import ActionDesk
from vla_deploy.gateways.ros.inward.say_topic import SayTopic
from vla_deploy.gateways.ros.inward.trajectories import TrajectoryServer
from vla_deploy.gateways.ros.inward.velocity import Velocity
from vla_deploy.gateways.ros.part import Gateway, GatewayPart
from vla_deploy.ipc.stop_button import ESTOP
from vla_deploy.robots.ros_settings import Accepts

ALL_ACTS: Final = (ESTOP, "reset", "arm", "disarm")
WHOLE_BODY: Final = "joint_trajectory_controller"


def inward_parts(gateway: Gateway) -> tuple[GatewayPart, ...]:
    """Return the parts that take; which they are is the robot file's `accept`."""
    accept = gateway.settings.accept
    if accept is Accepts.NOTHING:
        return ()
    if accept is Accepts.STOP:
        return (Acts(gateway, (ESTOP,)),)
    motions = Motions(gateway.link, gateway.robot.joint_index)
    orders = Orders(gateway.link)
    graph = gateway.graph
    navigation = NavigationServer(gateway, orders)
    plans = PlanServer(gateway, orders)
    return (
        Acts(gateway, ALL_ACTS),
        Velocity(gateway),
        Shared(motions, orders),
        CommandTopics(gateway, orders),
        SayTopic(gateway),
        *_trajectory_desks(gateway, motions),
        *gripper_desks(gateway, motions),
        ActionDesk(graph, NavigateToPose, "/navigate_to_pose", navigation.judge),
        ActionDesk(graph, ExecutePlan, "/vla_deploy/execute_plan", plans.judge),
    )


class Shared:
    """Step what several servers share, before any of them."""

    def __init__(self, motions: Motions, orders: Orders) -> None:
        self._motions = motions
        self._orders = orders

    def step(self, now_ns: int) -> None:
        """Take in what control and planner have told."""
        self._motions.step()
        self._orders.step()

    def stop(self) -> None:
        """End what is under way."""
        self._motions.close()
        self._orders.close()


def _trajectory_desks(gateway: Gateway, motions: Motions) -> Iterator[ActionDesk]:
    robot = gateway.robot
    known = set(robot.joint_names)
    servers = {
        f"{name}_controller": TrajectoryServer(gateway, motions, name, group.joints)
        for name, group in robot.groups.items()
        if set(group.joints) <= known
    }
    servers[WHOLE_BODY] = TrajectoryServer(
        gateway, motions, WHOLE_BODY, robot.joint_names, partial=True
    )
    for name, server in servers.items():
        action = f"/{name}/follow_joint_trajectory"
        yield ActionDesk(gateway.graph, FollowJointTrajectory, action, server.judge)
