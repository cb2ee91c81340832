"""List what the gateway takes from the graph, as far as the robot file permits it."""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import Final

from vla_deploy.client.motions import Claimed, Motions
from vla_deploy.gateways.ros.inward.action_server import GoalServer
from vla_deploy.gateways.ros.inward.acts import Acts
from vla_deploy.gateways.ros.inward.grippers import gripper_servers
from vla_deploy.gateways.ros.inward.navigation import NavigationAction
from vla_deploy.gateways.ros.inward.orders import CommandOrders
from vla_deploy.gateways.ros.inward.plans import PlanAction
from vla_deploy.gateways.ros.inward.streams import JointCommands, Velocity
from vla_deploy.gateways.ros.inward.text_topics import CommandTopics, SayTopic
from vla_deploy.gateways.ros.inward.trajectories import TrajectoryAction
from vla_deploy.gateways.ros.outgoing.lending import Borrowed, Lending
from vla_deploy.gateways.ros.part import Gateway, GatewayPart
from vla_deploy.ipc.payloads.motion import OperatorActName
from vla_deploy.ipc.stop_button import ESTOP
from vla_deploy.robots.ros_settings import Accepts

ACTS: Final[Mapping[Accepts, tuple[OperatorActName, ...]]] = {
    Accepts.STOP: (ESTOP,),
    Accepts.ALL: (ESTOP, "reset", "arm", "disarm"),
}
WHOLE_BODY: Final = "joint_trajectory_controller"
OWN: Final = "/vla_deploy"
"""Before the names of the robot's own servers where servers beyond it have theirs."""
BASE: Final = "base"


def inward_parts(gateway: Gateway, lending: Lending) -> Iterator[GatewayPart]:
    """Yield the parts that take; which they are is the robot file's `accept`.

    Where servers beyond the robot drive it or move its arms, these parts take from them what moves
    what they are lent, whatever is accepted from others, and nothing else.
    """
    settings, link = gateway.settings, gateway.link
    motions = Motions(link, gateway.robot.joint_index, "ros")
    motions.end_those_of_one_before()
    orders = CommandOrders(link)
    takes_all = settings.accept is Accepts.ALL
    if settings.accept in ACTS:
        yield Acts(gateway, ACTS[settings.accept])
    if settings.is_driven_by_nav2:
        yield Velocity(gateway, Borrowed(lending, (BASE,), driving=True))
    elif takes_all:
        yield Velocity(gateway, Claimed(link, "ros/cmd_vel", (BASE,)))
    if takes_all or settings.are_arms_beyond:
        yield Shared(motions, orders)
        yield from _trajectory_servers(gateway, motions, lending)
    if takes_all:
        yield from gripper_servers(gateway, motions)
        navigating = f"{OWN if settings.is_driven_by_nav2 else ''}/navigate_to_pose"
        yield GoalServer(gateway, navigating, NavigationAction(gateway, orders))
        yield GoalServer(gateway, f"{OWN}/execute_plan", PlanAction(gateway, orders))
        yield CommandTopics(gateway, orders)
        yield SayTopic(gateway)
        if not settings.are_arms_beyond:
            yield JointCommands(gateway, motions)


class Shared:
    """Step what several servers share, before any of them."""

    def __init__(self, motions: Motions, orders: CommandOrders) -> None:
        self._motions = motions
        self._orders = orders

    def step(self, now_ns: int) -> None:
        """Take in what control and planner have published."""
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

    def hold(name: str, groups: Sequence[str]) -> Claimed | Borrowed:
        if arms.isdisjoint(groups):
            return Claimed(gateway.link, f"ros/{name}", groups)
        return Borrowed(lending, groups)

    served = {
        f"{name}_controller": group.joints
        for name, group in robot.groups.items()
        if (settings.accept is Accepts.ALL or name in arms)
        and set(group.joints) <= set(robot.joint_names)
    }
    for name, joints in (served | {WHOLE_BODY: robot.joint_names}).items():
        action = TrajectoryAction(
            gateway, motions, joints, partial(hold, name), partial=name == WHOLE_BODY
        )
        path = f"{OWN if arms else ''}/{name}/follow_joint_trajectory"
        yield GoalServer(gateway, path, action)
