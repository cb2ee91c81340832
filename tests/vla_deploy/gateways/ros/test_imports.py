"""The gateway finds all it needs in ROS's environment, and what we import there is in the table."""

import ast
import sys
from pathlib import Path

import pytest

import vla_deploy.gateways.ros
from vla_deploy.gateways.ros.environment import BUILT_FROM_SOURCE, IMPORTS, remedy

GATEWAY = Path(vla_deploy.gateways.ros.__file__).parent
OURS = {"vla_deploy", "drivers", "platforms"}
IMPORT_ALL = """
import importlib, json, sys
for name in sys.argv[1:]:
    importlib.import_module(name)
print(json.dumps(sorted(sys.argv[1:])))
"""
IMPORT_OURS = """
import importlib, json, pkgutil, sys
for name in sys.argv[1:]:
    importlib.import_module(name)
tops = lambda: {name.partition(".")[0] for name in sys.modules}
before = tops()
import vla_deploy.runtime.process_main
import vla_deploy.gateways.ros as gateway
modules = [one.name for one in pkgutil.walk_packages(gateway.__path__, gateway.__name__ + ".")]
for name in modules:
    if not name.endswith("__main__"):
        importlib.import_module(name)
print(json.dumps(sorted(tops() - before - set(sys.stdlib_module_names))))
"""


def test_ros_has_everything_that_the_table_names(ros_graph) -> None:
    assert ros_graph.run(IMPORT_ALL, *IMPORTS) == sorted(IMPORTS)


def test_our_modules_import_nothing_beside_the_table(ros_graph) -> None:
    # What rclpy itself loads counts as rclpy.
    known = (*IMPORTS, "rclpy.node", "rclpy.action", "rclpy.lifecycle")
    assert set(ros_graph.run(IMPORT_OURS, *known)) - OURS == set()


def test_what_the_gateway_itself_imports_is_in_the_table() -> None:
    found: set[str] = set()
    for file in GATEWAY.rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text())):
            match node:
                case ast.Import(names=names):
                    found |= {one.name.partition(".")[0] for one in names}
                case ast.ImportFrom(module=str(module), level=0):
                    found.add(module.partition(".")[0])
    assert found - set(sys.stdlib_module_names) - OURS <= set(IMPORTS)


@pytest.mark.parametrize(
    ("module", "command"),
    [
        ("nav2_msgs", "sudo apt-get install -y ros-jazzy-nav2-msgs"),
        ("numpy", "sudo apt-get install -y python3-numpy"),
        ("vla_deploy_msgs", BUILT_FROM_SOURCE),
    ],
)
def test_each_has_a_remedy(module, command) -> None:
    assert remedy(module) == command
