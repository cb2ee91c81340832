"""A server of `navigate_to_pose` or `follow_joint_trajectory`, run by ROS's interpreter.

Arguments: kind (nav, fjt), name of the action, what it does with goals. It prints a word a line.

    succeed, abort, code   ends each goal at once; "code" as succeeded, with an error code
    reject                 rejects each goal
    mute                   takes goals and answers none
    hang                   pursues a goal until it is cancelled
    refuse_cancel          pursues a goal for ever, and rejects its cancel
    ignore_cancel          pursues a goal for ever, and accepts its cancel
    drive                  drives by /cmd_vel to the pose, by /tf
    drive_on               the same, rejects cancels and goes on
    relay                  has the robot's own server under /vla_deploy do it
"""

import math
import sys
import time

import rclpy
from control_msgs.action import FollowJointTrajectory
from geometry_msgs.msg import Twist
from nav2_msgs.action import NavigateToPose
from rclpy.action import ActionClient, ActionServer, CancelResponse, GoalResponse
from rclpy.node import Node
from rclpy.task import Future
from tf2_msgs.msg import TFMessage

KINDS = {"nav": NavigateToPose, "fjt": FollowJointTrajectory}
STEP_S = 0.05
CLOSE_M, CLOSE_RAD = 0.05, 0.08


def told(word):
    print(word, flush=True)


class Server:
    def __init__(self, node, kind, name, mode):
        self.node, self.kind, self.mode = node, KINDS[kind], mode
        self.name = name
        self.waiting = []
        self.frames = {}
        self.clients = {}
        node.create_timer(STEP_S, self.tick)
        if mode.startswith("drive"):
            self.cmd_vel = node.create_publisher(Twist, "/cmd_vel", 10)
            node.create_subscription(TFMessage, "/tf", self.take_frames, 50)
        if mode == "relay":
            self.own = ActionClient(node, self.kind, f"/vla_deploy/{name}")
        self.server = ActionServer(
            node,
            self.kind,
            name,
            execute_callback=self.execute,
            goal_callback=self.judge,
            cancel_callback=self.cancel,
        )

    def tick(self):
        waiting, self.waiting = self.waiting, []
        for future in waiting:
            future.set_result(None)

    def next_tick(self):
        future = Future()
        self.waiting.append(future)
        return future

    def judge(self, request):
        told("goal")
        if self.mode == "mute":
            time.sleep(3600)
        return GoalResponse.REJECT if self.mode == "reject" else GoalResponse.ACCEPT

    def cancel(self, handle):
        told("cancel")
        refuses = self.mode in ("refuse_cancel", "drive_on")
        return CancelResponse.REJECT if refuses else CancelResponse.ACCEPT

    async def execute(self, handle):
        result = self.kind.Result()
        if self.mode == "abort":
            result.error_code = 7 if self.kind is NavigateToPose else -4
            handle.abort()
        elif self.mode in ("succeed", "code"):
            result.error_code = 9 if self.mode == "code" else 0
            handle.succeed()
        elif self.mode == "hang":
            while not handle.is_cancel_requested:
                await self.next_tick()
            handle.canceled()
            told("canceled")
        elif self.mode in ("refuse_cancel", "ignore_cancel"):
            while True:
                await self.next_tick()
        elif self.mode.startswith("drive"):
            await self.drive(handle)
        elif self.mode == "relay":
            await self.relay(handle, result)
        return result

    # --- driving --------------------------------------------------------------------------------

    def take_frames(self, message):
        for one in message.transforms:
            turn = one.transform.rotation
            yaw = 2.0 * math.atan2(turn.z, turn.w)
            place = one.transform.translation
            key = one.header.frame_id, one.child_frame_id
            self.frames[key] = place.x, place.y, yaw

    def pose(self):
        odom, base = self.frames.get(("map", "odom")), self.frames.get(("odom", "base_link"))
        if odom is None or base is None:
            return None
        cos, sin = math.cos(odom[2]), math.sin(odom[2])
        x, y = odom[0] + cos * base[0] - sin * base[1], odom[1] + sin * base[0] + cos * base[1]
        return x, y, odom[2] + base[2]

    async def drive(self, handle):
        wanted = handle.request.pose.pose
        yaw = 2.0 * math.atan2(wanted.orientation.z, wanted.orientation.w)
        assert handle.request.pose.header.frame_id == "map"
        feedback = NavigateToPose.Feedback()
        while True:
            await self.next_tick()
            if handle.is_cancel_requested:
                self.cmd_vel.publish(Twist())
                handle.canceled()
                told("canceled")
                return
            pose = self.pose()
            if pose is None:
                continue
            twist, left = towards(pose, (wanted.position.x, wanted.position.y, yaw))
            self.cmd_vel.publish(twist)
            feedback.distance_remaining = left
            handle.publish_feedback(feedback)
            if twist == Twist():
                handle.succeed()
                told("there")
                return

    # --- relaying -------------------------------------------------------------------------------

    async def relay(self, handle, result):
        while not self.own.server_is_ready():
            await self.next_tick()
        sent = self.own.send_goal_async(handle.request)
        while not sent.done():
            await self.next_tick()
        inner = sent.result()
        ended = inner.get_result_async()
        cancelled = False
        while not ended.done():
            if handle.is_cancel_requested and not cancelled:
                cancelled = True
                inner.cancel_goal_async()
            await self.next_tick()
        answer = ended.result()
        result.error_code = answer.result.error_code
        result.error_string = answer.result.error_string
        if handle.is_cancel_requested:
            handle.canceled()
            told("canceled")
        elif answer.status == 4:
            handle.succeed()
            told("done")
        else:
            told(f"status {answer.status}: {answer.result.error_string}")
            handle.abort()


def towards(pose, goal):
    """Turn to the goal, drive there, turn as asked: proportional, slow."""
    x, y, yaw = pose
    left = math.hypot(goal[0] - x, goal[1] - y)
    twist = Twist()
    if left > CLOSE_M:
        off = wrapped(math.atan2(goal[1] - y, goal[0] - x) - yaw)
        twist.angular.z = max(-0.6, min(0.6, 1.5 * off))
        if abs(off) < 0.3:
            twist.linear.x = max(0.05, min(0.25, 0.8 * left))
        return twist, left
    off = wrapped(goal[2] - yaw)
    if abs(off) > CLOSE_RAD:
        twist.angular.z = max(0.1, min(0.6, abs(off))) * (1.0 if off > 0 else -1.0)
    return twist, left


def wrapped(angle):
    return math.atan2(math.sin(angle), math.cos(angle))


def main():
    rclpy.init()
    kind, name, mode = sys.argv[1:4]
    node = Node("goal_server")
    server = Server(node, kind, name, mode)
    told("up")
    try:
        rclpy.spin(node)
    except BaseException:  # whatever ends it, the test has seen what it wanted
        del server


if __name__ == "__main__":
    main()
