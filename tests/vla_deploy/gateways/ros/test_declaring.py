"""The node has every parameter of the table, typed, described and not to be set at run time."""

import json
from typing import Any

import pytest

from vla_deploy.gateways.ros.parameters import PARAMETERS

DECLARE = """
import json, sys
import rclpy
from rclpy.parameter import Parameter
from vla_deploy.gateways.ros.declaring import SteadyNode

rclpy.init()
refusal = lambda wished: node.set_parameters_atomically([wished]).reason
given = json.loads(sys.argv[1])
node = SteadyNode("steady", given)
told = {}
for name in given:
    parameter, descriptor = node.get_parameter(name), node.describe_parameter(name)
    ranges = (*descriptor.floating_point_range, *descriptor.integer_range)
    told[name] = {
        "type": [parameter.type_.name, Parameter.Type(descriptor.type).name],
        "value": parameter.value,
        "read_only": descriptor.read_only,
        "range": [[one.from_value, one.to_value] for one in ranges],
        "set": refusal(Parameter(name, parameter.type_, parameter.value)),
    }
simulated = node.set_parameters_atomically([Parameter("use_sim_time", value=True)])
told["use_sim_time"] = simulated.successful
print(json.dumps(told))
rclpy.try_shutdown()
"""
TYPES = {bool: "BOOL", float: "DOUBLE", int: "INTEGER", list: "STRING_ARRAY", str: "STRING"}


@pytest.mark.parametrize("changes", [{}, {"restricted_areas": [], "max_speed": 7.5}])
def test_each_is_declared_with_its_type_and_refuses_to_be_set(
    ros_graph: Any, changes: dict[str, Any]
) -> None:
    given = {one.name: one.default for one in PARAMETERS} | changes
    told = ros_graph.run(DECLARE, json.dumps(given))
    assert told.pop("use_sim_time")
    assert {name: one["value"] for name, one in told.items()} == given
    for one in PARAMETERS:
        row = told[one.name]
        assert row["type"] == [TYPES[type(one.default)]] * 2
        assert row["read_only"]
        assert row["set"] == f"{one.name}: read-only; set it in the parameter file and start again"
        assert bool(row["range"]) == (one.low is not None)
    speed = max(5.0, given["max_speed"])  # a robot file may allow more than parameters may ask for
    assert told["max_speed"]["range"] == [[0.01, speed]]
