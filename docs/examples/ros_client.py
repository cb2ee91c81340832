"""Drive the robot from ROS's side; it imports nothing of the robot's software but its messages.

    vla-deploy run --twin --ros                                   in one terminal
    .venv-ros/bin/python docs/examples/ros_client.py navigation   in another, by ROS's interpreter

CASE is one of words, trajectories, refusals, grippers, joint_commands, navigation, pick_and_place,
acts, velocity. One JSON document tells what came back. The tests run every case on the twin.
"""

import json
import math
import sys
import time
from collections import deque
from collections.abc import Callable
from typing import Any

import rclpy
from builtin_interfaces.msg import Duration
from control_msgs.action import FollowJointTrajectory, GripperCommand, ParallelGripperCommand
from control_msgs.msg import JointTolerance
from geometry_msgs.msg import Twist
from nav2_msgs.action import NavigateToPose
from nav_msgs.msg import Odometry
from rclpy.action import ActionClient
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState
from std_msgs.msg import Bool, String
from std_srvs.srv import Trigger
from trajectory_msgs.msg import JointTrajectoryPoint
from vla_deploy_msgs.action import ExecutePlan

SOME = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
HEAD = ["head_pan", "head_tilt"]
HEAD_ACTION = "/head_controller/follow_joint_trajectory"
PATIENCE_S = 240.0


class Client(Node):  # type: ignore[misc]
    """A node that waits for what it asked for."""

    def __init__(self) -> None:
        # On the twin, time is the twin's.
        super().__init__("somebody", parameter_overrides=[Parameter("use_sim_time", value=True)])
        self.joints: dict[str, float] = {}
        self._told: deque[dict[str, float]] = deque(maxlen=20)
        self._action_clients: dict[str, ActionClient] = {}
        self.speed_m_s = self.turn_rad_s = self.x_m = self.y_m = 0.0
        self.create_subscription(JointState, "/joint_states", self._take_joints, SOME)
        self.create_subscription(Odometry, "/odom", self._take_odometry, SOME)

    def until(self, holds: Callable[[], bool], timeout_s: float = PATIENCE_S) -> bool:
        """Spin until something holds; return whether it did in time."""
        end_s = time.monotonic() + timeout_s
        while not holds():
            if time.monotonic() > end_s:
                return False
            rclpy.spin_once(self, timeout_sec=0.05)
        return True

    def until_still(self) -> bool:
        """Spin until the base has stood for a while; return whether it does in time."""
        looks = 0

        def stands() -> bool:
            nonlocal looks
            looks = looks + 1 if abs(self.speed_m_s) + abs(self.turn_rad_s) < 0.01 else 0
            return looks > 50

        return self.until(stands)

    def at_rest(self, *names: str) -> list[float]:
        """Return where joints have come to rest: what is told of them may lag behind a result."""

        def rest() -> bool:
            told = [[one[name] for one in self._told] for name in names]
            is_still = all(max(seen) - min(seen) < 0.002 for seen in told if seen)
            return is_still and len(self._told) == self._told.maxlen

        self._told.clear()
        assert self.until(rest), "no rest in time"
        return [self.joints[name] for name in names]

    def await_result(self, future: Any) -> Any:
        assert self.until(future.done), "no answer in time"
        return future.result()

    def goal(
        self,
        kind: Any,
        name: str,
        goal: Any,
        *,
        cancel_when: Callable[[Any], bool] | None = None,
        then: Callable[[], None] | None = None,
    ) -> dict[str, Any]:
        """Pursue a goal; `cancel_when(feedback)` cancels it, `then` is done once it is accepted."""
        if name not in self._action_clients:  # two of one node would take each other's answers
            self._action_clients[name] = ActionClient(self, kind, name)
        client = self._action_clients[name]
        assert client.wait_for_server(timeout_sec=60.0), f"no server {name}"
        told: list[Any] = []
        sent = client.send_goal_async(goal, feedback_callback=lambda got: told.append(got.feedback))
        handle = self.await_result(sent)
        if not handle.accepted:
            return {"status": "rejected"}
        result = handle.get_result_async()
        cancelled = None
        if then is not None:
            then()
        if cancel_when is not None:
            self.until(lambda: result.done() or bool(told and cancel_when(told[-1])))
            cancelled = len(self.await_result(handle.cancel_goal_async()).goals_canceling)
        answer = self.await_result(result)
        return {
            "status": {4: "succeeded", 5: "canceled", 6: "aborted"}[answer.status],
            "result": {
                field: value
                for field in answer.result.get_fields_and_field_types()
                if isinstance(value := getattr(answer.result, field), bool | int | float | str)
            },
            "feedback": len(told),
            "cancelled": cancelled,
            "told": told,
        }

    def act(self, name: str) -> dict[str, Any]:
        client = self.create_client(Trigger, name)
        assert client.wait_for_service(timeout_sec=60.0), f"no service {name}"
        answer = self.await_result(client.call_async(Trigger.Request()))
        return {"success": answer.success, "message": answer.message}

    def _take_joints(self, message: JointState) -> None:
        self.joints = dict(zip(message.name, message.position, strict=True))
        self._told.append(self.joints)

    def _take_odometry(self, message: Odometry) -> None:
        self.speed_m_s = message.twist.twist.linear.x
        self.turn_rad_s = message.twist.twist.angular.z
        position = message.pose.pose.position
        self.x_m, self.y_m = position.x, position.y


def point(seconds: float, *positions: float) -> JointTrajectoryPoint:
    whole = math.floor(seconds)
    due = Duration(sec=whole, nanosec=int((seconds - whole) * 1e9))
    return JointTrajectoryPoint(positions=list(positions), time_from_start=due)


def follow(*points: JointTrajectoryPoint, joints: list[str] = HEAD) -> Any:
    goal = FollowJointTrajectory.Goal()
    goal.trajectory.joint_names = joints
    goal.trajectory.points = list(points)
    return goal


def drive_to(x_m: float, y_m: float, w: float = 1.0, frame: str = "map") -> Any:
    goal = NavigateToPose.Goal()
    goal.pose.header.frame_id = frame
    goal.pose.pose.position.x, goal.pose.pose.position.y = x_m, y_m
    goal.pose.pose.orientation.w = w
    return goal


def trajectories(client: Client) -> dict[str, Any]:
    """Follow a trajectory, leave its path, be superseded, be cancelled."""

    def pursue(goal: Any, **options: Any) -> dict[str, Any]:
        return client.goal(FollowJointTrajectory, HEAD_ACTION, goal, **options)

    done = pursue(follow(point(1.0, 0.3, 0.3), point(2.0, 0.5, 0.2)))
    reached = client.at_rest(*HEAD)
    narrow = follow(point(4.0, -0.5, 0.2))
    narrow.path_tolerance = [JointTolerance(name="head_pan", position=1e-4)]
    off_path = pursue(narrow)
    fine = follow(point(4.0, 0.4, 0.2))
    fine.goal_tolerance = [JointTolerance(name="head_tilt", position=1e-7)]
    off_goal = pursue(fine)
    second: dict[str, Any] = {}

    def supersede() -> None:
        second.update(pursue(follow(point(4.0, 0.0, 0.2))))

    superseded = pursue(follow(point(8.0, -0.5, 0.2)), then=supersede)
    last = client.at_rest(*HEAD)
    cancelled = pursue(follow(point(8.0, 0.8, 0.2)), cancel_when=lambda _told: True)
    return {
        "done": done,
        "reached": reached,
        "off_path": off_path,
        "off_goal": off_goal,
        "superseded": superseded,
        "second": second,
        "last": last,
        "cancelled": cancelled,
        "stopped_at": client.at_rest("head_pan")[0],
    }


def refusals(client: Client) -> dict[str, Any]:
    """Ask for what cannot be: nothing moves."""
    backwards = follow(point(2.0, 0.1, 0.1), point(1.0, 0.2, 0.2))
    sizes = follow(point(1.0, 0.1))
    nan = follow(point(1.0, math.nan, 0.1))
    many = follow(*(point(0.001 * (i + 1), 0.1, 0.1) for i in range(10_000)))
    beyond = follow(point(5.0, 9.0, 0.1))
    fast = follow(point(0.01, 1.5, 1.0))
    stale, future = follow(point(1.0, 0.1, 0.1)), follow(point(1.0, 0.1, 0.1))
    now = client.get_clock().now().to_msg()
    stale.trajectory.header.stamp.sec = max(now.sec - 30, 1)
    future.trajectory.header.stamp.sec = now.sec + 3600
    goals = {
        "unknown_joint": follow(point(1.0, 0.1, 0.1), joints=["head_pan", "tail"]),
        "joint_twice": follow(point(1.0, 0.1, 0.1), joints=["head_pan", "head_pan"]),
        "joint_missing": follow(point(1.0, 0.1), joints=["head_pan"]),
        "long_name": follow(point(1.0, 0.1), joints=["x" * 1_000_000]),
        "no_points": follow(),
        "sizes": sizes,
        "nan": nan,
        "backwards": backwards,
        "many": many,
        "beyond": beyond,
        "fast": fast,
        "stale": stale,
        "future": future,
    }
    before = dict(client.joints)
    told = {
        name: client.goal(FollowJointTrajectory, HEAD_ACTION, goal) for name, goal in goals.items()
    }
    navigation = {
        "nan": drive_to(math.nan, 0.0),
        "unreachable": drive_to(30.0, 30.0),
        "wall": drive_to(0.0, 0.0),
        "not_turned": drive_to(1.0, 2.5, w=0.0),
        "frame": drive_to(1.0, 2.5, frame="camera_link"),
    }
    told |= {
        f"navigate_{name}": client.goal(NavigateToPose, "/navigate_to_pose", goal)
        for name, goal in navigation.items()
    }
    plans = {
        "both": ExecutePlan.Goal(command="stop", plan_json="[]"),
        "neither": ExecutePlan.Goal(),
        "no_json": ExecutePlan.Goal(plan_json="{"),
        "no_plan": ExecutePlan.Goal(plan_json='{"actions": 3}'),
        "huge": ExecutePlan.Goal(command="x" * 1_000_000),
    }
    told |= {
        f"plan_{name}": client.goal(ExecutePlan, "/vla_deploy/execute_plan", goal)
        for name, goal in plans.items()
    }
    wide = GripperCommand.Goal()
    wide.command.position = 5.0
    told["gripper"] = client.goal(GripperCommand, "/left_gripper_controller/gripper_cmd", wide)
    moved = max(abs(client.joints[joint] - value) for joint, value in before.items())
    return {"told": told, "moved": moved}


def grippers(client: Client) -> dict[str, Any]:
    """Open one hand and close it, in both dialects."""
    classic = GripperCommand.Goal()
    classic.command.position = 0.06
    parallel = ParallelGripperCommand.Goal()
    parallel.command.name, parallel.command.position = ["left_gripper"], [0.03]
    return {
        "classic": client.goal(GripperCommand, "/left_gripper_controller/gripper_cmd", classic),
        "gap_m": 2.0 * client.at_rest("left_gripper")[0],
        "parallel": client.goal(
            ParallelGripperCommand, "/left_gripper_parallel_controller/gripper_cmd", parallel
        ),
        "gap_then_m": 2.0 * client.at_rest("left_gripper")[0],
    }


def navigation(client: Client) -> dict[str, Any]:
    """Drive on the way to the kitchen and cancel, then drive somewhere near to the end."""
    on_the_way = client.goal(
        NavigateToPose,
        "/navigate_to_pose",
        drive_to(6.2, 2.2),
        cancel_when=lambda told: told.distance_remaining < 5.2 and client.speed_m_s > 0.1,
    )
    left_m = [float(one.distance_remaining) for one in on_the_way["told"]]
    still = client.until_still()
    here = (client.x_m, client.y_m)
    near = client.goal(NavigateToPose, "/navigate_to_pose", drive_to(0.4, 0.0, frame="base_link"))
    return {
        "on_the_way": on_the_way,
        "left_m": left_m,
        "still": still,
        "near": near,
        "drove_m": math.dist(here, (client.x_m, client.y_m)),
    }


def pick_and_place(client: Client) -> dict[str, Any]:
    """Have the red cup put into the box, by words."""
    goal = ExecutePlan.Goal(command="pick up the red cup and put it in the box")
    done = client.goal(ExecutePlan, "/vla_deploy/execute_plan", goal)
    states = [(one.skill, one.status) for one in done["told"] if one.skill]
    return {"done": done, "states": states}


def acts(client: Client) -> dict[str, Any]:
    """Stop, fail to arm, reset, fail to move, arm; then stop by the topic."""
    told: dict[str, Any] = {name: client.act(f"/vla_deploy/{name}") for name in ("estop",)}
    told["arm_latched"] = client.act("/vla_deploy/arm")
    told["reset"] = client.act("/vla_deploy/reset")
    told["goal"] = client.goal(FollowJointTrajectory, HEAD_ACTION, follow(point(1.0, 0.1, 0.1)))
    told["drive"] = client.goal(NavigateToPose, "/navigate_to_pose", drive_to(1.0, 2.5))
    told["plan"] = client.goal(
        ExecutePlan, "/vla_deploy/execute_plan", ExecutePlan.Goal(command="go to the kitchen")
    )
    told["arm"] = client.act("/vla_deploy/arm")
    press = client.create_publisher(Bool, "/emergency_stop", 10)
    for _ in range(20):  # one that the robot has not found yet is not heard
        press.publish(Bool(data=True))
        client.until(lambda: False, 0.1)
    told["arm_pressed"] = client.act("/vla_deploy/arm")
    told["reset_again"] = client.act("/vla_deploy/reset")
    told["arm_at_last"] = client.act("/vla_deploy/arm")
    return told


def velocity(client: Client) -> dict[str, Any]:
    """Drive at full speed until somebody ends this program; nothing else is said."""
    publisher = client.create_publisher(Twist, "/cmd_vel", 10)
    wanted = Twist()
    wanted.linear.x = float(sys.argv[2]) if len(sys.argv) > 2 else 0.5
    print("driving", flush=True)
    end_s = time.monotonic() + PATIENCE_S
    while time.monotonic() < end_s:
        publisher.publish(wanted)
        time.sleep(0.05)
    return {}


def bad_velocity(client: Client) -> dict[str, Any]:
    """Send what no base can do."""
    publisher = client.create_publisher(Twist, "/cmd_vel", 10)
    client.until(lambda: publisher.get_subscription_count() > 0)
    nan, sideways = Twist(), Twist()
    nan.linear.x, sideways.linear.y = math.nan, 0.3
    client.until_still()
    x_m = client.x_m
    for _ in range(10):
        publisher.publish(nan)
        publisher.publish(sideways)
        client.until(lambda: False, 0.1)
    return {"moved_m": client.x_m - x_m}


def words(client: Client) -> dict[str, Any]:
    """Give a command in words, and return the plan that is made of it."""
    plans: list[str] = []
    said = client.create_publisher(String, "/natural_language/command", 10)
    client.create_subscription(
        String, "/cognitive_planner/action_sequence", lambda told: plans.append(told.data), 10
    )
    client.until(
        lambda: (
            said.get_subscription_count() > 0
            and client.count_publishers("/cognitive_planner/action_sequence") > 0
        )
    )
    said.publish(String(data="turn left by 20 degrees"))
    client.until(lambda: bool(plans))
    client.until_still()
    return {"plan": json.loads(plans[0]) if plans else None}


def joint_commands(client: Client) -> dict[str, Any]:
    """Stream positions as ros2_control does, then such as no joint takes."""
    publisher = client.create_publisher(JointState, "/robot_joint_commands", 10)
    client.until(lambda: publisher.get_subscription_count() > 0)
    began = client.joints["head_pan"]
    for i in range(60):
        value = began + (0.4 - began) * min(i / 40, 1.0)
        publisher.publish(JointState(name=["head_pan"], position=[value]))
        client.until(lambda: False, 0.05)
    client.until(lambda: abs(client.joints["head_pan"] - 0.4) < 0.02, 20.0)
    (reached,) = client.at_rest("head_pan")
    for bad in (
        JointState(name=["head_pan"], position=[math.nan]),
        JointState(name=["head_pan"], position=[9.0]),
        JointState(name=["head_pan", "head_tilt"], position=[0.0]),
        JointState(name=["tail"], position=[0.0]),
    ):
        publisher.publish(bad)
        client.until(lambda: False, 0.3)
    return {"reached": reached, "then": client.at_rest("head_pan")[0]}


def watched_goal(client: Client) -> dict[str, Any]:
    """Follow a long trajectory to whatever end, which may be that nobody answers any more."""
    action = ActionClient(client, FollowJointTrajectory, HEAD_ACTION)
    assert action.wait_for_server(timeout_sec=60.0)
    handle = client.await_result(action.send_goal_async(follow(point(20.0, 0.8, 0.2))))
    print("following", flush=True)
    result = handle.get_result_async()
    ended = client.until(result.done, 60.0)
    return {"ended": ended, "text": result.result().result.error_string if ended else ""}


CASES = {
    case.__name__: case
    for case in (
        *(trajectories, refusals, grippers, navigation, pick_and_place, acts),
        *(words, joint_commands, velocity, bad_velocity, watched_goal),
    )
}


def main() -> None:
    rclpy.init()
    client = Client()
    assert client.until(lambda: bool(client.joints)), "no joint states"
    assert client.until(lambda: client.get_clock().now().nanoseconds > 0), "no /clock"
    told = CASES[sys.argv[1]](client)
    print(json.dumps(told, default=lambda _message: None))
    client.destroy_node()
    rclpy.try_shutdown()


if __name__ == "__main__":
    main()
