"""Take serialised messages from the graph, as a recorder does; run by ROS's interpreter.

    bag_client.py SECONDS TOPIC...

prints one JSON document: of each topic its type, the type's hash, and messages in base64. It ends
when each of the named topics has given a message, at the latest after so many seconds.
"""

import base64
import json
import sys
import time

import rclpy
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

SOME = QoSProfile(depth=20, reliability=ReliabilityPolicy.BEST_EFFORT)
LATCHED = QoSProfile(depth=5, durability=DurabilityPolicy.TRANSIENT_LOCAL)
MOST = 5


def main() -> None:
    rclpy.init()
    node = Node("recorder")
    told: dict[str, dict[str, object]] = {}
    begun_s = time.monotonic()
    span_s, awaited = float(sys.argv[1]), sys.argv[2:]
    while time.monotonic() < begun_s + span_s:
        if all(told.get(topic, {}).get("data") for topic in awaited):
            break
        for topic, types in node.get_topic_names_and_types():
            infos = node.get_publishers_info_by_topic(topic)
            if "/msg/" not in types[0]:  # of an action
                continue
            if topic in told or not infos or infos[0].node_name != "vla_deploy":
                continue
            info = infos[0]
            messages: list[str] = []
            told[topic] = {"type": types[0], "hash": str(info.topic_type_hash), "data": messages}
            is_latched = info.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL
            package, kind = types[0].split("/msg/")
            module = __import__(f"{package}.msg", fromlist=[kind])

            def take(data: bytes, into: list[str] = messages) -> None:
                if len(into) < MOST:
                    into.append(base64.b64encode(data).decode())

            node.create_subscription(
                getattr(module, kind), topic, take, LATCHED if is_latched else SOME, raw=True
            )
        rclpy.spin_once(node, timeout_sec=0.05)
    print(json.dumps(told))
    node.destroy_node()
    rclpy.try_shutdown()


if __name__ == "__main__":
    main()
