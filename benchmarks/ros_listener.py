"""Listen to what a robot tells a ROS graph; run by ROS's interpreter.

    ros_listener.py SECONDS

prints one JSON document: how many messages came, and how old joint states were when they did.
"""

import json
import sys
import time

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import Image, JointState, LaserScan
from tf2_msgs.msg import TFMessage

SOME = QoSProfile(depth=20, reliability=ReliabilityPolicy.BEST_EFFORT)
TOPICS = {
    "/joint_states": JointState,
    "/odom": Odometry,
    "/tf": TFMessage,
    "/scan": LaserScan,
    "/diagnostics": DiagnosticArray,
    "/camera/color/image_raw": Image,
    "/camera/depth/image_raw": Image,
}


def main() -> None:
    """Listen for so long, and tell."""
    rclpy.init()
    node = Node("listener")
    counts = dict.fromkeys(TOPICS, 0)
    ages_s: list[float] = []

    def take(topic: str, message: object) -> None:
        counts[topic] += 1
        if isinstance(message, JointState):
            stamp = message.header.stamp
            ages_s.append((time.time_ns() - stamp.sec * 1_000_000_000 - stamp.nanosec) / 1e9)

    for topic, kind in TOPICS.items():
        node.create_subscription(kind, topic, lambda got, of=topic: take(of, got), SOME)
    end_s = time.monotonic() + float(sys.argv[1])
    while time.monotonic() < end_s:
        rclpy.spin_once(node, timeout_sec=0.1)
    print(json.dumps({"counts": counts, "ages_s": ages_s}))
    node.destroy_node()
    rclpy.try_shutdown()


if __name__ == "__main__":
    main()
