"""A velocity with a stamp counts while it is young, and never after a younger one."""

from pathlib import Path
from typing import Any

import pytest

pytestmark = [pytest.mark.stack, pytest.mark.timeout(300)]

# Sends one velocity a line of its input: SPEED AGE_S, where an age of "none" leaves the stamp out.
SENDER = """
import sys
import rclpy
from builtin_interfaces.msg import Time
from geometry_msgs.msg import TwistStamped
from rclpy.node import Node

rclpy.init()
node = Node("sender")
publisher = node.create_publisher(TwistStamped, "/cmd_vel", 10)
while publisher.get_subscription_count() == 0:
    rclpy.spin_once(node, timeout_sec=0.05)
print("up", flush=True)
for line in sys.stdin:
    speed, age = line.split()
    message = TwistStamped()
    message.twist.linear.x = float(speed)
    if age != "none":
        ns = node.get_clock().now().nanoseconds - int(float(age) * 1e9)
        message.header.stamp = Time(sec=ns // 10**9, nanosec=ns % 10**9)
    publisher.publish(message)
    print("sent", flush=True)
"""


@pytest.fixture
def robot_folder(tmp_path: Path, make_robot: Any) -> Path:
    return make_robot(tmp_path / "butler", "[ros]\nenabled = true\ncmd_vel_stamped = true\n")


def test_only_young_and_finite_velocities_in_order_are_taken(gateway: Any, ros_graph: Any) -> None:
    control = gateway.space.cell_writer("control_status")
    taken = gateway.space.cell_reader("remote_base_command")
    sender = ros_graph.start(SENDER)
    assert sender.stdout.readline() == "up\n"

    def speed_after(speed: float, age: str) -> float | None:
        """Return the speed that is taken, None where none is within a second."""
        control.put_document({"state": "armed", "detail": "", "cause": ""})
        before = taken.latest()
        sender.stdin.write(f"{speed} {age}\n")
        sender.stdin.flush()
        assert sender.stdout.readline() == "sent\n"
        known = before.sequence if before else 0
        if not gateway.wait_until(lambda: (taken.latest() or before) is not before, 1.0):
            return None
        sample = taken.latest()
        return None if sample.sequence == known else float(sample.data["v_m_s"])

    gateway.wait_until(lambda: speed_after(0.1, "0.0") == pytest.approx(0.1), 20.0)
    told = {
        case: speed_after(*case)
        for case in (
            *((0.2, "0.0"), (0.21, "5.0"), (0.22, "-5.0"), (0.23, "1e6"), (0.24, "none")),
            *((0.25, "0.15"), ("nan", "0.0"), ("inf", "none"), (0.26, "0.0")),
        )
    }
    assert told.pop((0.25, "0.15")) in (None, 0.25)  # older than the one before it, or too old
    refused = {case for case, speed in told.items() if speed is None}
    assert refused == {
        (0.21, "5.0"),
        (0.22, "-5.0"),
        (0.23, "1e6"),
        ("nan", "0.0"),
        ("inf", "none"),
    }
    assert told[0.26, "0.0"] == pytest.approx(0.26)
