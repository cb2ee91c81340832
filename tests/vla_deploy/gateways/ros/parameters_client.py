"""Read and set the parameters of the robot's node as `ros2 param` does; run by ROS's interpreter.

It prints one JSON document: what came back. It imports nothing of the robot's software.
"""

import json
from typing import Any

import rclpy
from rcl_interfaces.srv import DescribeParameters
from rclpy.action import ActionClient
from rclpy.node import Node
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient
from vla_deploy_msgs.action import ExecutePlan

ROBOT = "/vla_deploy"
PATIENCE_S = 240.0
FAST = {
    "goal": "be quick",
    "actions": [
        {"id": "go", "skill": "navigate_to", "parameters": {"place": "entrance", "speed_m_s": 0.4}}
    ],
}


def awaited(node: Node, future: Any) -> Any:
    rclpy.spin_until_future_complete(node, future, timeout_sec=PATIENCE_S)
    assert future.done(), "no answer in time"
    return future.result()


def described(node: Node, names: list[str]) -> dict[str, Any]:
    client = node.create_client(DescribeParameters, f"{ROBOT}/describe_parameters")
    assert client.wait_for_service(timeout_sec=60.0)
    rows = awaited(node, client.call_async(DescribeParameters.Request(names=names))).descriptors
    return {
        row.name: {
            "description": row.description,
            "read_only": row.read_only,
            "ranges": [
                [span.from_value, span.to_value]
                for span in (*row.floating_point_range, *row.integer_range)
            ],
        }
        for row in rows
    }


def carried_out(node: Node, **goal: str) -> dict[str, Any]:
    client = ActionClient(node, ExecutePlan, "/vla_deploy/execute_plan")
    assert client.wait_for_server(timeout_sec=60.0)
    handle = awaited(node, client.send_goal_async(ExecutePlan.Goal(**goal)))
    answer = awaited(node, handle.get_result_async())
    return {
        "status": {4: "succeeded", 5: "canceled", 6: "aborted"}[answer.status],
        "error": answer.result.error,
    }


def main() -> None:
    rclpy.init()
    node = Node("somebody")
    client = AsyncParameterClient(node, ROBOT)
    assert client.wait_for_services(timeout_sec=60.0), "no node"
    names = list(awaited(node, client.list_parameters()).result.names)
    values = awaited(node, client.get_parameters(names)).values
    wished = [Parameter("max_speed", value=0.5), Parameter("restricted_areas", value=["porch"])]
    told = {
        "values": dict(zip(names, map(parameter_value_to_python, values), strict=True)),
        "described": described(node, names),
        "set": [
            [one.successful, one.reason]
            for one in awaited(node, client.set_parameters(wished)).results
        ],
        "speed_then": awaited(node, client.get_parameters(["max_speed"])).values[0].double_value,
        "restricted": carried_out(node, command="go to the coffee table"),
        "fast": carried_out(node, plan_json=json.dumps(FAST)),
        "free": carried_out(node, command="turn left by 20 degrees"),
    }
    print(json.dumps(told))
    node.destroy_node()
    rclpy.try_shutdown()


if __name__ == "__main__":
    main()
