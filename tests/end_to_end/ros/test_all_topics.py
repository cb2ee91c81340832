"""A node of somebody else's sees, commands and stops a running robot by the topics of the docs."""

import json
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from sim_twin.harness.processes import ProcessStack
from vla_deploy.client.link import RobotLink
from vla_deploy.gateways.ros.imports import IMPORTS

pytestmark = [pytest.mark.stack, pytest.mark.gl, pytest.mark.timeout(300)]

DOCS = Path(__file__).parents[3] / "docs" / "ros-topics.md"

# What every client script begins with: a node, what came on each topic, and waiting for it.
CLIENT = """
import json, sys, time
import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import OccupancyGrid
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import BatteryState, PointCloud2
from std_msgs.msg import Bool, String
from std_srvs.srv import Trigger
from visualization_msgs.msg import MarkerArray
from vla_deploy_msgs.msg import DetectedObjectArray, RobotEvent, RobotState

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
SENSOR = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
rclpy.init()
node = Node("teleop")
came = {}

def listen(kind, topic, qos=50):
    came[topic] = []
    node.create_subscription(kind, topic, came[topic].append, qos)

def until(condition, what, seconds=60.0):
    end = time.monotonic() + seconds
    while not (found := condition()):
        counts = {topic: len(taken) for topic, taken in came.items()}
        assert time.monotonic() < end, f"{what} did not come: {counts}"
        rclpy.spin_once(node, timeout_sec=0.05)
    return found

def of_json(topic):
    return [json.loads(one.data) for one in came[topic]]

def publisher(topic, kind=String):
    made = node.create_publisher(kind, topic, 10)
    until(lambda: made.get_subscription_count() > 0, f"a subscription of {topic}")
    return made

def finish(told):
    node.destroy_node()
    rclpy.try_shutdown()
    print(json.dumps(told))
"""

LOOK = (
    CLIENT
    + """
TOPICS = (
    (OccupancyGrid, "/map", LATCHED), (MarkerArray, "/keep_out_zones", LATCHED),
    (RobotState, "/vla_deploy/state", LATCHED), (OccupancyGrid, "/environment_map/grid", 1),
    (PointCloud2, "/environment_map", SENSOR), (BatteryState, "/battery_state", SENSOR),
    (DiagnosticArray, "/diagnostics", 1), (MarkerArray, "/vla_deploy/markers", 1),
    (MarkerArray, "/llm_planner/visualization", 1), (String, "/robot/state", 1),
    (DetectedObjectArray, "/vla_deploy/detected_objects", 1), (String, "/detected_objects", 1),
    (String, "/environment/context", 1), (String, "/capstone/status", 1),
    (String, "/cognitive_planner/status", 1),
)
for kind, topic, qos in TOPICS:
    listen(kind, topic, qos)
until(lambda: all(came.values()), "a topic")
until(lambda: of_json("/detected_objects")[-1], "an object")
until(lambda: any(one.markers for one in came["/vla_deploy/markers"]), "a marker")
last = {topic: taken[-1] for topic, taken in came.items()}
grid, live, cloud = last["/map"], last["/environment_map/grid"], last["/environment_map"]
points = np.frombuffer(bytes(cloud.data), "<f4").reshape(-1, 3)
battery, state = last["/battery_state"], last["/vla_deploy/state"]
finish({
    "map": [grid.info.width, grid.info.height, grid.header.frame_id, sorted(set(grid.data))],
    "same size": [grid.info.width, grid.info.height] == [live.info.width, live.info.height],
    "seen now": sum(a != b for a, b in zip(grid.data, live.data)),
    "zones": [one.text for one in last["/keep_out_zones"].markers],
    "cloud": [cloud.header.frame_id, len(points), points.min(0).tolist(), points.max(0).tolist()],
    "battery": [battery.voltage, str(battery.percentage), str(battery.current)],
    "state": [state.robot, state.control_state, state.armed, state.executor_state,
              str(state.battery_ratio), state.localisation],
    "levels": {one.name: one.level[0] for one in last["/diagnostics"].status},
    "typed": [[one.id, one.class_name] for one in last["/vla_deploy/detected_objects"].objects],
    "shapes": sorted({one.ns for taken in came["/vla_deploy/markers"] for one in taken.markers}),
    "json": {topic: json.loads(last[topic].data) for topic in (
        "/detected_objects", "/robot/state", "/environment/context", "/cognitive_planner/status")},
    "capstone": last["/capstone/status"].data,
})
"""
)

COMMAND = (
    CLIENT
    + """
ON_PLAN = ("/cognitive_planner/action_sequence", "/optimized_planner/action_sequence",
    "/llm_planner/action_sequence", "/context_aware_planner/resolved_commands",
    "/cognitive_planner/plan", "/cognitive_planner/current_action")
for topic in (*ON_PLAN, "/llm_planner/feedback", "/capstone/status", "/cognitive_planner/status",
              "/tts/say", "/voice_command/parsed"):
    listen(String, topic)
listen(RobotEvent, "/vla_deploy/events")
topic, words = sys.argv[1:3]
sender = publisher(topic)
until(lambda: node.count_publishers("/vla_deploy/events") and came["/capstone/status"], "the robot")
sender.publish(String(data=words))
until(lambda: any(one["stage"] == "execution" for one in of_json("/llm_planner/feedback")),
      "the end", 120.0)
until(lambda: "COMPLETED" in came["/capstone/status"][-1].data, "completed")
until(lambda: of_json("/cognitive_planner/status")[-1]["status"] == "completed", "its status")
until(lambda: came["/vla_deploy/events"][-1].kind == "finished", "the last event")
finish({
    "on plan": {topic: of_json(topic) for topic in ON_PLAN},
    "feedback": of_json("/llm_planner/feedback"),
    "capstone": list(dict.fromkeys(one.data for one in came["/capstone/status"])),
    "status": [one["status"] for one in of_json("/cognitive_planner/status")],
    "said": [one.data for one in came["/tts/say"]],
    "events": [[one.source, one.kind] for one in came["/vla_deploy/events"]],
})
"""
)

REFUSED = (
    CLIENT
    + """
listen(String, "/cognitive_planner/feedback")
senders = {topic: publisher(topic) for topic in (
    "/natural_language/command", "/vla/command",
    "/cognitive_planner/goal", "/voice_command/parsed")}
until(lambda: node.count_publishers("/cognitive_planner/feedback"), "the feedback")
BAD = ("", "x" * 1_000_000, "go \\x07", "{broken", '{"nothing": 1}', '[{"distance": NaN}]')
for number, bad in enumerate(BAD):
    senders[list(senders)[number % 4]].publish(String(data=bad))
    until(lambda: len(came["/cognitive_planner/feedback"]) == number + 1, f"feedback {number}")
own = {"original_command": "turn left", "published_by": "/vla_deploy"}
senders["/voice_command/parsed"].publish(String(data=json.dumps(own)))
senders["/vla/command"].publish(String(data="}"))
until(lambda: any(one["command"] == "}" for one in of_json("/cognitive_planner/feedback")), "last")
finish(of_json("/cognitive_planner/feedback"))
"""
)

ANSWER = (
    CLIENT
    + """
listen(String, "/cognitive_planner/feedback")
first, second = publisher("/cognitive_planner/goal"), publisher("/vla/command")
until(lambda: node.count_publishers("/cognitive_planner/feedback"), "the feedback")
feedback = lambda: of_json("/cognitive_planner/feedback")
plan = {"goal": "turn a little", "safety_concerns": ["the cable is near"], "actions": [
    {"id": "a1", "skill": "turn", "parameters": {"angle_rad": 0.1}}]}
first.publish(String(data=json.dumps(plan)))
until(lambda: any(one["status"] == "question" for one in feedback()), "the question")
first.publish(String(data=sys.argv[1]))
until(lambda: feedback()[-1]["stage"] == "execution" or "error" in feedback()[-1], "its end")
finish(feedback())
"""
)

ACTS = (
    CLIENT
    + """
listen(RobotState, "/vla_deploy/state", LATCHED)
state = lambda: came["/vla_deploy/state"][-1].control_state if came["/vla_deploy/state"] else ""
stop = publisher("/emergency_stop", Bool)
until(lambda: state() == "armed", "armed")
# DDS tells a node's name after its publishers, and a stop waits for no name.
known_s = time.monotonic() + 2.0
until(lambda: time.monotonic() > known_s, "a name")
stop.publish(Bool(data=True))
until(lambda: came["/vla_deploy/state"][-1].estop_latched and state() == "stopped", "the stop")
told = {}
for act in ("reset", "arm"):
    client = node.create_client(Trigger, f"/vla_deploy/{act}")
    assert client.wait_for_service(20.0)
    future = client.call_async(Trigger.Request())
    until(future.done, act)
    told[act] = [future.result().success, future.result().message]
until(lambda: state() == "armed", "armed again")
finish(told)
"""
)

SAY = (
    CLIENT
    + """
listen(String, "/tts/say")
sender = publisher("/vla_deploy/say")
until(lambda: node.count_publishers("/tts/say"), "the robot")
for text in ("", "good\\x07 morning", "good morning"):
    sender.publish(String(data=text))
until(lambda: came["/tts/say"], "a word")
finish([one.data for one in came["/tts/say"]])
"""
)

HEAR = (
    CLIENT
    + """
listen(String, "/voice_command/parsed")
until(lambda: node.count_publishers("/voice_command/parsed"), "the robot")
print("up", flush=True)
until(lambda: came["/voice_command/parsed"], "a spoken command", 120.0)
finish(of_json("/voice_command/parsed"))
"""
)

GRAPH = (
    CLIENT
    + """
until(lambda: ("vla_deploy", "/") in node.get_node_names_and_namespaces(), "the robot's node")
until(lambda: node.count_publishers("/tts/say"), "the robot's topics")
ask = {
    "publishers": node.get_publisher_names_and_types_by_node,
    "subscriptions": node.get_subscriber_names_and_types_by_node,
    "services": node.get_service_names_and_types_by_node,
}
finish({kind: dict(of("vla_deploy", "/")) for kind, of in ask.items()})
"""
)


@pytest.fixture(scope="module", autouse=True)
def looked(robot: ProcessStack) -> None:
    """The first that is asked of the robot: what it has done last is among what it tells."""
    ended = robot.say("turn right 35 degrees and look at the red cup")
    assert ended["success"], ended


@pytest.fixture
def run(robot: ProcessStack, ros_graph):
    def run(script: str, *arguments: str):
        return ros_graph.run(script, *arguments, timeout_s=240.0)

    return run


@pytest.fixture
def link(robot: ProcessStack) -> Iterator[RobotLink]:
    link = RobotLink(robot.run_dir, robot.clock)
    yield link
    link.close()


def test_surroundings_objects_and_state_are_told(run) -> None:
    told = run(LOOK)
    check_map_and_health(told)
    check_objects(told["json"]["/detected_objects"], told["typed"])
    check_context(told["json"], told["capstone"])


def check_map_and_health(told) -> None:
    assert told["map"] == [175, 134, "map", [0, 100]]
    assert told["same size"]
    assert told["seen now"] > 0
    assert any(text.startswith("pet_corner") for text in told["zones"])
    frame, count, low, high = told["cloud"]
    assert (frame, 500 < count <= 6000) == ("map", True)
    assert min(low[:2]) > -0.6
    assert -0.1 < low[2] < 0.1, "the floor lies at zero, as the camera is calibrated"
    assert high[0] < 9.0
    volts, charge, current = map(float, told["battery"])
    assert volts == pytest.approx(27.8, abs=1.0)
    assert charge == pytest.approx(0.8, abs=0.05)
    assert abs(current) > 0.5
    *state, ratio, place = told["state"]
    assert (state, place) == (["butler", "armed", True, "idle"], "tracking")
    assert float(ratio) == pytest.approx(0.8, abs=0.05)
    assert {"vla_deploy: control", "vla_deploy: process ros"} <= set(told["levels"])
    assert set(told["levels"].values()) <= {0, 1}
    assert told["shapes"] == ["labels", "objects"]


def check_objects(objects, typed) -> None:
    assert {tuple(one) for one in typed} & {(one["id"], one["class"]) for one in objects}
    assert any(one["bbox"] is not None and len(one["bbox"]) == 4 for one in objects)
    for one in objects:
        assert len(one["position"]) == 3
        assert 0.0 < one["confidence"] <= 1.0


def check_context(documents, capstone: str) -> None:
    state, context = documents["/robot/state"], documents["/environment/context"]
    assert state["location"] == "charging_station"
    assert state["battery_level"] == pytest.approx(80.0, abs=5.0)
    assert len(state["position"]) == 3
    assert len(state["orientation"]) == 4
    assert state["available_tools"] == ["left_gripper", "right_gripper"]
    recent = [one["action_type"] for one in state["recent_actions"]]
    assert (recent[0], recent[-1]) == ("turn_right", "look_at")
    assert context["known_locations"]["kitchen"][:2] == [6.2, 2.2]
    assert context["map_bounds"] == {"min_x": -0.35, "min_y": -0.35, "max_x": 8.4, "max_y": 6.35}
    assert documents["/cognitive_planner/status"]["status"] in ("completed", "failed")
    assert re.fullmatch(r"State: [A-Z]+, Tasks: 0", capstone)


@pytest.mark.parametrize(
    ("topic", "words"),
    [
        ("/natural_language/command", "turn left 10 degrees and say hello"),
        ("/voice_command/parsed", '{"original_command": "turn right 10 degrees and say hello"}'),
    ],
)
def test_a_command_in_words_is_planned_carried_out_and_told(run, link, topic, words) -> None:
    utterances = link.events("utterance")
    told = run(COMMAND, topic, words)
    (given,) = (event.payload for event in utterances.drain())
    utterances.close()
    assert given["source"] == "ros:/teleop"
    (ranked,), (optimized,) = (
        told["on plan"][f"/{planner}_planner/action_sequence"]
        for planner in ("cognitive", "optimized")
    )
    assert ranked == optimized
    turn, speak = ranked
    assert turn["action_type"] in ("turn_left", "turn_right")
    assert turn["parameters"] == {"angle": 10.0}
    assert speak["parameters"] == {"text_to_speak": "Hello."}
    assert [one["priority"] for one in ranked] == [1, 2]
    (of_command,) = told["on plan"]["/llm_planner/action_sequence"]
    assert of_command["action_sequence"] == ranked
    assert of_command["original_command"]["original_command"] == given["text"]
    (resolved,) = told["on plan"]["/context_aware_planner/resolved_commands"]
    assert resolved["resolution_log"] == []
    assert [one["action"] for one in told["on plan"]["/cognitive_planner/current_action"]] == [
        *("turn", "speak")
    ]
    planned, executed = told["feedback"]
    assert (planned["status"], planned["actions_planned"]) == ("success", 2)
    assert planned["processing_time"] >= 0.0
    assert executed["summary"]["success_rate"] == 1.0
    assert executed["source"] == "ros:/teleop"
    assert "State: NAVIGATING, Tasks: 2" in told["capstone"]
    assert told["status"][-1] == "completed"
    assert "executing" in told["status"]
    assert told["said"] == ["Hello."]
    assert ["task_event", "finished"] in told["events"]


def test_what_is_no_command_is_refused_in_words_and_given_to_nobody(run, link) -> None:
    utterances = link.events("utterance")
    *refused, last = run(REFUSED)
    given = [event.payload for event in utterances.drain()]
    utterances.close()
    assert [one["status"] for one in refused] == ["error"] * len(refused)
    assert [one["topic"] for one in refused[:4]] == [
        *("/natural_language/command", "/vla/command"),
        *("/cognitive_planner/goal", "/voice_command/parsed"),
    ]
    assert "got 1000000" in refused[1]["error"]
    assert len(refused[1]["command"]) < 100
    assert (last["status"], last["command"]) == ("failure", "}")
    assert [one["text"] for one in given] == ["}"], "what the robot itself has heard is not taken"


@pytest.mark.parametrize(
    ("answer", "status"), [("no", "failure"), ("yes", "success"), ("stop", "failure")]
)
def test_the_next_words_on_the_topic_answer_the_robots_question(run, link, answer, status) -> None:
    utterances = link.events("utterance")
    told = run(ANSWER, answer)
    said = [event.payload for event in utterances.drain()]
    utterances.close()
    assert "cable" in next(one["question"] for one in told if one["status"] == "question")
    assert said[-1]["answer"] is True
    of_plan = [one for one in told if one["command"] == "turn a little"]
    assert of_plan[-1]["status"] == status


def test_stop_reset_and_arm_name_who_asked(run, link) -> None:
    acts = link.events("operator")
    assert run(ACTS) == {"reset": [True, ""], "arm": [True, ""]}
    told = [(one.payload["act"], one.payload["source"]) for one in acts.drain()]
    acts.close()
    assert told == [(act, "ros:/teleop") for act in ("estop", "reset", "arm")]


def test_texts_for_the_robots_voice_are_said_once(run) -> None:
    assert run(SAY) == ["good morning"]


def test_a_spoken_command_is_told_as_it_was_understood_and_not_taken_again(
    robot, ros_graph, link
) -> None:
    assert robot.wait_until(lambda: not robot.document("speech_status")["speaking"])
    assert robot.say("wait 2 seconds")["success"], "the echo of what it has said last is gone"
    utterances = link.events("utterance")
    listener = ros_graph.start(HEAR)
    assert listener.stdout.readline() == "up\n", listener.stderr.read()
    robot.speak("turn left twenty degrees", "en-gb-x-rp+m3")
    out, err = listener.communicate(timeout=240.0)
    assert listener.returncode == 0, err
    (parsed,) = json.loads(out.splitlines()[-1])
    assert (parsed["intent"], parsed["text"]) == ("navigation", "turn left twenty degrees"), parsed
    assert 0.5 < parsed["confidence"] <= 1.0
    assert parsed["published_by"] == "/vla_deploy"
    assert [event.payload["source"] for event in utterances.drain()] == ["voice"]
    utterances.close()
    robot.operate("stop")


def test_the_docs_list_what_the_node_publishes_takes_and_serves(run) -> None:
    found = run(GRAPH)
    published, taken = documented()
    unlisted = {
        kind: {plain(name) for name in names} - published - taken - OF_EVERY_NODE
        for kind, names in found.items()
    }
    assert unlisted == {kind: set() for kind in found}
    assert published - {plain(one) for one in found["publishers"]} == set()
    types = {one for names in found.values() for kinds in names.values() for one in kinds}
    assert {one.partition("/")[0] for one in types} <= set(IMPORTS) | {
        "type_description_interfaces"
    }


OF_EVERY_NODE = {"/rosout", "/parameter_events"}


def documented() -> tuple[set[str], set[str]]:
    """Return the names in the first column of the tables: published, and taken or served."""
    parts = DOCS.read_text().split("\n## ")
    tables = [
        {name for row in part.splitlines() if row.startswith("| `") for name in names_of(row)}
        for part in parts
        if part.startswith("What the robot")
    ]
    assert len(tables) == 2, "docs/ros-topics.md has lost a table"
    return tables[0], tables[1]


def names_of(row: str) -> list[str]:
    return re.findall(r"`(/[^`]*)`", row.split("|")[1])


def plain(name: str) -> str:
    """Return a name as the docs have it: without a group's name and the parts of an action."""
    name = re.sub(r"/_action/.*$", "", name)
    if name.startswith("/vla_deploy/") and name.rpartition("/")[2] in OF_PARAMETERS:
        return "/rosout"
    if name.endswith("/follow_joint_trajectory") and not name.startswith("/joint_traj"):
        return "/<group>_controller/follow_joint_trajectory"
    if name.endswith("_parallel_controller/gripper_cmd"):
        return "/<gripper>_parallel_controller/gripper_cmd"
    return "/<gripper>_controller/gripper_cmd" if name.endswith("/gripper_cmd") else name


OF_PARAMETERS = {
    *("describe_parameters", "get_parameter_types", "get_parameters", "list_parameters"),
    *("set_parameters", "set_parameters_atomically", "get_type_description"),
}
