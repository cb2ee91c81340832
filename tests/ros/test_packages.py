"""What colcon and `ros2 launch` read of `ros/` on a robot, where neither is here to say so."""

import ast
import re
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest
import yaml

from vla_deploy.gateways.ros.environment import IMPORTS
from vla_deploy.gateways.ros.parameters import PARAMETERS, handed_over_parameters

ROOT = Path(__file__).parents[2]
ROS = ROOT / "ros"
PACKAGES = ("vla_deploy", "vla_deploy_msgs")
LAUNCH = ROS / "vla_deploy" / "launch" / "robot.launch.py"
PARAMETER_FILE = ROS / "vla_deploy" / "config" / "cognitive_robot.yaml"
# Package format 3 (REP 149): these in this order, then dependencies in any, then the export.
HEAD = ("name", "version", "description", "maintainer", "license", "url", "author")
DEPENDENCIES = {
    *("depend", "build_depend", "build_export_depend", "buildtool_depend", "exec_depend"),
    *("buildtool_export_depend", "test_depend", "doc_depend", "conflict", "replace"),
    *("group_depend", "member_of_group"),
}
ONCE = ("name", "version", "description", "export")

DESCRIBE = """
import importlib.util, json, sys
try:
    from launch import LaunchContext, LaunchDescription
    from launch.actions import DeclareLaunchArgument
except ImportError:
    print(json.dumps(None))
    sys.exit()
spec = importlib.util.spec_from_file_location("robot_launch", sys.argv[1])
module = importlib.util.module_from_spec(spec)
spec.loader.exec_module(module)
described = module.generate_launch_description()
names = [one.name for one in described.entities if isinstance(one, DeclareLaunchArgument)]
print(json.dumps(names))
"""


def manifest(package: str) -> ElementTree.Element:
    return ElementTree.parse(ROS / package / "package.xml").getroot()


@pytest.mark.parametrize("package", PACKAGES)
def test_each_manifest_follows_package_format_3(package) -> None:
    root = manifest(package)
    assert (root.tag, root.get("format")) == ("package", "3")
    tags = [child.tag for child in root]
    assert set(tags) <= {*HEAD, *DEPENDENCIES, "export"}
    ranks = [HEAD.index(tag) if tag in HEAD else 99 + (tag == "export") for tag in tags]
    assert ranks == sorted(ranks)
    assert all(tags.count(tag) == 1 for tag in ONCE)
    assert re.fullmatch(r"[a-z][a-z0-9_]*", root.findtext("name", ""))
    assert root.findtext("name") == package
    assert re.fullmatch(r"\d+\.\d+\.\d+", root.findtext("version", ""))
    assert all("@" in (one.get("email") or "") for one in root.findall("maintainer"))
    assert root.findtext("export/build_type") == "ament_cmake"


@pytest.mark.parametrize("package", PACKAGES)
def test_each_manifest_names_what_its_build_finds(package) -> None:
    build = (ROS / package / "CMakeLists.txt").read_text()
    assert f"project({package}" in build
    assert build.rstrip().endswith("ament_package()")
    names = {child.text for child in manifest(package) if child.tag in DEPENDENCIES}
    assert set(re.findall(r"find_package\((\w+)", build)) <= names


def test_every_interface_file_is_built_by_colcon_too() -> None:
    folder = ROS / "vla_deploy_msgs"
    listed = re.findall(r'"(\w+/\w+\.\w+)"', (folder / "CMakeLists.txt").read_text())
    files = {str(file.relative_to(folder)) for file in folder.glob("*/*") if file.is_file()}
    assert sorted(listed) == sorted(files)


def test_the_package_depends_on_all_that_the_gateway_imports() -> None:
    named = {child.text for child in manifest("vla_deploy") if child.tag == "exec_depend"}
    keys = {"numpy": "python3-numpy", "yaml": "python3-yaml"}
    assert {keys.get(module, module) for module in IMPORTS} <= named


def test_colcon_is_kept_from_what_is_for_the_wheels_only() -> None:
    ignored = {file.parent.name for file in ROS.glob("*/COLCON_IGNORE")}
    assert {folder.name for folder in ROS.iterdir() if folder.is_dir()} == ignored | set(PACKAGES)


def test_the_parameter_file_has_every_parameter_with_its_default() -> None:
    (section,) = yaml.safe_load(PARAMETER_FILE.read_text()).values()
    assert section["ros__parameters"] == {one.name: one.default for one in PARAMETERS}
    variables = {"VLA_DEPLOY_ROS_PARAMS_FILE": str(PARAMETER_FILE)}
    assert handed_over_parameters(variables) == section["ros__parameters"]


def test_the_launch_file_gives_run_no_option_that_it_has_not() -> None:
    options = set(re.findall(r'"(--[a-z-]+)"', LAUNCH.read_text()))
    command = [sys.executable, "-m", "vla_deploy.cli", "run", "--help"]
    text = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    assert options <= set(re.findall(r"--[a-z-]+", text))


def test_the_launch_file_uses_every_argument_that_it_declares() -> None:
    tree = ast.parse(LAUNCH.read_text())
    (declared,) = [
        ast.literal_eval(node.value)
        for node in tree.body
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "ARGUMENTS"
    ]
    used = set(re.findall(r'given\["(\w+)"\]', LAUNCH.read_text()))
    assert used == {name for name, _, _ in declared}


def test_the_launch_is_described_where_ros_has_launch(ros_graph) -> None:
    described = ros_graph.run(DESCRIBE, str(LAUNCH))
    if described is None:
        pytest.skip("this ROS has no package launch: no wheel brings it")
    assert {"robot", "profile", "twin", "world", "params_file", "vlm_api_key"} <= set(described)
