"""Every interface that was built for the wheels, sent from one process to another."""

import pytest

PACKAGES = ("control_msgs", "nav2_msgs", "tf2_msgs", "vla_deploy_msgs")

# As other implementations of ROS 2 have them written down: String of the wheel, TFMessage of ours.
PUBLISHED_HASHES = {
    "std_msgs/msg/String": "df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18",
    "tf2_msgs/msg/TFMessage": "e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087",
}

# Both sides fill each field in the same way, by its type, so that any that is lost shows.
FILLING = """
import importlib, json, re, sys, threading, time
import rclpy
from rclpy.action import ActionClient, ActionServer
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)

def of(package, kind):
    try:
        module = importlib.import_module(f"{package}.{kind}")
    except ModuleNotFoundError:
        return []
    names = [name for name in vars(module) if name[0].isupper() and "_" not in name]
    return [(f"{package}_{name}", getattr(module, name)) for name in names]

def value(kind, seed):
    if found := re.fullmatch(r"sequence<(.+?)(, \\d+)?>", kind):
        return [value(found.group(1), seed + place) for place in range(2)]
    if found := re.fullmatch(r"(.+)\\[(\\d+)\\]", kind):
        return [value(found.group(1), seed + place) for place in range(int(found.group(2)))]
    if "/" in kind:
        package, _, name = kind.partition("/")
        return filled(getattr(importlib.import_module(f"{package}.msg"), name), seed)
    if kind.startswith("string"):
        return f"text {seed}"
    if kind == "boolean":
        return True
    return 0.5 + seed if kind in ("float", "double") else seed % 100 + 1

def filled(kind, seed=0):
    message = kind()
    for place, (name, field) in enumerate(kind.get_fields_and_field_types().items()):
        setattr(message, name, value(field, seed + place + 1))
    return message

def spinning(node):
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    thread = threading.Thread(target=executor.spin, daemon=True)
    thread.start()
    def end():
        executor.shutdown()
        thread.join()
    return end

def until(holds, seconds):
    end = time.monotonic() + seconds
    while not holds() and time.monotonic() < end:
        time.sleep(0.01)
    return holds()

# A server that has not discovered the client's reader yet answers into the void: ask again.
def asked(call, what):
    for _ in range(10):
        future = call()
        if until(future.done, 3):
            return future.result()
    raise AssertionError(f"no answer: {what}")
"""

SERVER = (
    FILLING
    + """
rclpy.init()
node = Node("server")
kept = []
for package in sys.argv[1:]:
    for name, kind in of(package, "msg"):
        publisher = node.create_publisher(kind, name, LATCHED)
        publisher.publish(filled(kind))
        kept.append(publisher)
    for name, kind in of(package, "srv"):
        def answer(request, response, kind=kind):
            return filled(kind.Response) if request == filled(kind.Request) else response
        kept.append(node.create_service(kind, name, answer))
    for name, kind in of(package, "action"):
        def execute(goal, kind=kind):
            goal.publish_feedback(filled(kind.Feedback))
            goal.succeed() if goal.request == filled(kind.Goal) else goal.abort()
            return filled(kind.Result)
        kept.append(ActionServer(node, kind, name, execute))
print("up", flush=True)
try:
    rclpy.spin(node)
except (KeyboardInterrupt, rclpy.executors.ExternalShutdownException):
    node.destroy_node()
    rclpy.try_shutdown()
"""
)

CLIENT = (
    FILLING
    + """
rclpy.init()
node = Node("client")
came, kept, wanted = {}, [], {}
for package in sys.argv[1:]:
    for name, kind in of(package, "msg"):
        wanted[name] = filled(kind)
        take = lambda message, name=name: came.__setitem__(name, message)
        kept.append(node.create_subscription(kind, name, take, LATCHED))
end = spinning(node)
until(lambda: set(came) == set(wanted), 30)
told = {name: came.get(name) == message for name, message in wanted.items()}
for package in sys.argv[1:]:
    for name, kind in of(package, "srv"):
        client = node.create_client(kind, name)
        assert client.wait_for_service(20), name
        answer = asked(lambda: client.call_async(filled(kind.Request)), name)
        told[name] = answer == filled(kind.Response)
    for name, kind in of(package, "action"):
        client = ActionClient(node, kind, name)
        assert client.wait_for_server(20), name
        for _ in range(10):
            fed = []
            feed = lambda got: fed.append(got.feedback)
            goal = asked(lambda: client.send_goal_async(filled(kind.Goal), feed), name)
            answer = asked(goal.get_result_async, name)
            if until(lambda: fed, 3):
                break
        told[name] = (answer.status, answer.result) == (4, filled(kind.Result)) and all(
            feedback == filled(kind.Feedback) for feedback in fed) and bool(fed)
        client.destroy()
end()
node.destroy_node()
rclpy.try_shutdown()
print(json.dumps(told))
"""
)

HASHES = """
import importlib, json, sys
import rclpy
from rclpy.node import Node
rclpy.init()
node = Node("hashes")
told = {}
for name in sys.argv[1:]:
    package, kind, type_ = name.split("/")
    publisher = node.create_publisher(
        getattr(importlib.import_module(f"{package}.{kind}"), type_), type_.lower(), 1)
    (own,) = node.get_publishers_info_by_topic(type_.lower())
    told[name] = bytes(own.topic_type_hash.value).hex()
node.destroy_node()
rclpy.try_shutdown()
print(json.dumps(told))
"""


@pytest.mark.parametrize("package", PACKAGES)
def test_every_interface_arrives_whole_in_another_process(ros_graph, package) -> None:
    server = ros_graph.start(SERVER, package)
    assert server.stdout.readline() == "up\n", server.stderr.read()
    told = ros_graph.run(CLIENT, package)
    assert told
    assert [name for name, is_whole in told.items() if not is_whole] == []


def test_type_hashes_are_the_published_ones(ros_graph) -> None:
    assert ros_graph.run(HASHES, *PUBLISHED_HASHES) == PUBLISHED_HASHES
