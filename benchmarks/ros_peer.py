"""Publish joint states and nothing else, as a node of a few lines does; run by ROS's interpreter.

    ros_peer.py SECONDS RATE_HZ JOINTS

prints the share of a core that this took: the yardstick for a gateway that tells all the rest too.
"""

import json
import sys
import time
from array import array

import rclpy
from rclpy.node import Node
from sensor_msgs.msg import JointState


def main() -> None:
    """Publish for so long, and tell."""
    seconds, rate_hz, joints = float(sys.argv[1]), float(sys.argv[2]), int(sys.argv[3])
    rclpy.init()
    node = Node("peer")
    publisher = node.create_publisher(JointState, "/peer_joint_states", 10)
    names, values = [f"joint_{i}" for i in range(joints)], array("d", [0.0] * joints)
    began_s, spent_s = time.monotonic(), time.process_time()
    for i in range(round(seconds * rate_hz)):
        message = JointState(name=names, position=values, velocity=values, effort=values)
        message.header.stamp = node.get_clock().now().to_msg()
        publisher.publish(message)
        time.sleep(max(began_s + (i + 1) / rate_hz - time.monotonic(), 0.0))
    share = (time.process_time() - spent_s) / (time.monotonic() - began_s)
    print(json.dumps({"core_share": share}))
    node.destroy_node()
    rclpy.try_shutdown()


if __name__ == "__main__":
    main()
