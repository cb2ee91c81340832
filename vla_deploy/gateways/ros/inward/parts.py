"""List what the gateway takes from the graph, as far as the robot file permits it."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

from control_msgs.action import FollowJointTrajectory
from nav2_msgs.action import NavigateToPose
from vla_deploy_msgs.action import ExecutePlan

from vla_deploy.client.motions import Claimed, Motions
from vla_deploy.gateways.ros.inward.acts import Acts
from vla_deploy.gateways.ros.inward.claiming import Borrowed, PartsHold
from vla_deploy.gateways.ros.inward.command_topics import CommandTopics
from vla_deploy.gateways.ros.inward.grippers import gripper_servers
from vla_deploy.gateways.ros.inward.joint_commands import JointCommands
from vla_deploy.gateways.ros.inward.navigation import NavigationServer
from vla_deploy.gateways.ros.inward.orders import CommandOrders
from vla_deploy.gateways.ros.inward.plans import PlanServer
from vla_deploy.gateways.ros.inward.pursuing import GoalServer
from vla_deploy.gateways.ros.inward.say_topic import SayTopic
from vla_deploy.gateways.ros.inward.trajectories import TrajectoryServer
from vla_deploy.gateways.ros.inward.velocity import Velocity
from vla_deploy.gateways.ros.outgoing.lending import Lending
from vla_deploy.gateways.ros.part import Gateway, GatewayPart
from vla_deploy.ipc.payloads.motion import OperatorActName
from vla_deploy.ipc.stop_button import ESTOP
from vla_deploy.robots.ros_settings import Accepts

ALL_ACTS: Final[tuple[OperatorActName, ...]] = (ESTOP, "reset", "arm", "disarm")
WHOLE_BODY: Final = "joint_trajectory_controller"
OWN: Final = "/vla_deploy"
"""Before the names of the robot's own servers where servers beyond it have theirs."""
BASE: Final = "base"


def inward_parts(gateway: Gateway, lending: Lending) -> tuple[GatewayPart, ...]:
    """Return the parts that take; which they are is the robot file's `accept`.

    Where servers beyond the robot drive it or move its arms, these parts take from them what moves
    what they are lent, whatever is accepted from others, and nothing else.
    """
    accept, settings = gateway.settings.accept, gateway.settings
    graph, link = gateway.graph, gateway.link
    motions = Motions(link, gateway.robot.joint_index, "ros")
    motions.end_those_of_one_before()
    orders = CommandOrders(link)
    by_setting: Mapping[Accepts, tuple[OperatorActName, ...]] = {
        Accepts.STOP: (ESTOP,),
        Accepts.ALL: ALL_ACTS,
    }
    acts = by_setting.get(accept)
    parts: list[GatewayPart] = [] if acts is None else [Acts(gateway, acts)]
    takes_all = accept is Accepts.ALL
    if settings.is_driven_by_nav2:
        parts.append(Velocity(gateway, Borrowed(lending, (BASE,), driving=True)))
    elif takes_all:
        parts.append(Velocity(gateway, Claimed(link, "ros/cmd_vel", (BASE,))))
    if takes_all or settings.are_arms_beyond:
        parts.append(Shared(motions, orders))
        parts += _trajectory_servers(gateway, motions, lending)
    if takes_all:
        navigation = NavigationServer(gateway, orders)
        plans = PlanServer(gateway, orders)
        navigating = f"{OWN if settings.is_driven_by_nav2 else ''}/navigate_to_pose"
        parts += gripper_servers(gateway, motions)
        parts.append(GoalServer(graph, NavigateToPose, navigating, navigation.judge))
        parts.append(GoalServer(graph, ExecutePlan, f"{OWN}/execute_plan", plans.judge))
        parts += [CommandTopics(gateway, orders), SayTopic(gateway)]
        if not settings.are_arms_beyond:
            parts.append(JointCommands(gateway, motions))
    return tuple(parts)


class Shared:
    """Step what several servers share, before any of them."""

    def __init__(self, motions: Motions, orders: CommandOrders) -> None:
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


def _trajectory_servers(
    gateway: Gateway, motions: Motions, lending: Lending
) -> Iterator[GoalServer]:
    """Yield a server for each group, and one for all joints.

    Where servers beyond the robot move its arms, those have the names: ours go by another one, and
    move an arm only while it is lent to such a server.
    """
    robot, settings = gateway.robot, gateway.settings
    arms = {hand.arm for hand in robot.hands.values()} if settings.are_arms_beyond else set()

    def hold(holder: str, groups: Sequence[str]) -> PartsHold:
        if arms.isdisjoint(groups):
            return Claimed(gateway.link, holder, groups)
        return Borrowed(lending, groups)

    joints = {name: group.joints for name, group in robot.groups.items()}
    named = {f"{name}_controller": (name, of) for name, of in joints.items()}
    if settings.accept is not Accepts.ALL:
        named = {name: row for name, row in named.items() if row[0] in arms}
    servers = {
        name: TrajectoryServer(gateway, motions, name, of, hold)
        for name, (_, of) in named.items()
        if set(of) <= set(robot.joint_names)
    }
    servers[WHOLE_BODY] = TrajectoryServer(
        gateway, motions, WHOLE_BODY, robot.joint_names, hold, partial=True
    )
    for name, server in servers.items():
        action = f"{OWN if arms else ''}/{name}/follow_joint_trajectory"
        yield GoalServer(gateway.graph, FollowJointTrajectory, action, server.judge)
