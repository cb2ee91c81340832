"""The builder of interfaces, run as scripts/ros-environment runs it, on packages of a few lines."""

import os
import shutil
import signal
import subprocess
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
LITTLE = {
    "msg/Speed.msg": "float64 value\n",
    "msg/Axes.msg": "Speed[] speeds\nstd_msgs/Header header\n",
}
TINY = {"msg/Speed.msg": "float64 value\n"}

USE = """
import importlib, json, sys
sys.path.insert(0, sys.argv[1])
module = importlib.import_module(sys.argv[2] + ".msg")
import rclpy
from rclpy.node import Node
rclpy.init()
node = Node("user")
got = []
node.create_subscription(module.Axes, "axes", got.append, 1)
publisher = node.create_publisher(module.Axes, "axes", 1)
while not got:
    publisher.publish(module.Axes(speeds=[module.Speed(value=0.5)]))
    rclpy.spin_once(node, timeout_sec=0.1)
node.destroy_node()
rclpy.try_shutdown()
print(json.dumps([speed.value for speed in got[0].speeds]))
"""

Builder = Callable[..., "subprocess.CompletedProcess[str]"]


@pytest.fixture
def define(tmp_path: Path) -> Callable[..., Path]:
    def define(name: str = "little_msgs", files: Mapping[str, str] = LITTLE) -> Path:
        for file, text in files.items():
            path = tmp_path / "src" / name / file
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
        return tmp_path / "src" / name

    return define


@pytest.fixture
def command(ros_graph, tmp_path) -> list[str]:
    if not any(ros_graph.python.parent.parent.glob("lib/*/site-packages/rosidl_adapter")):
        pytest.skip("this ROS is none of wheels: there colcon builds")
    options = ["--into", str(tmp_path / "built"), "--path-file", str(tmp_path / "path.pth")]
    return [str(ros_graph.python), "-m", "interface_builder", "--jobs", "2", *options]


@pytest.fixture
def build(ros_graph, command) -> Builder:
    def build(*packages: Path, **variables: str) -> "subprocess.CompletedProcess[str]":
        return subprocess.run(
            [*command, *map(str, packages)],
            env={**ros_graph.variables, "PYTHONPATH": str(ROOT / "ros"), **variables},
            capture_output=True,
            text=True,
            check=False,
        )

    return build


def test_what_is_built_is_imported_and_sent(define, build, ros_graph, tmp_path) -> None:
    done = build(define())
    assert done.returncode == 0, done.stderr
    folder = (tmp_path / "path.pth").read_text().strip()
    assert folder in done.stdout
    assert ros_graph.run(USE, folder, "little_msgs") == [0.5]


def test_it_is_built_anew_when_a_definition_changes_and_not_before(define, build, tmp_path) -> None:
    package = define(files=TINY)
    first, again = build(package), build(package)
    assert "built in" in first.stdout
    assert "up to date" in again.stdout
    (package / "msg" / "Speed.msg").write_text("float32 value\n")
    assert "built in" in build(package).stdout
    (package / "msg" / "Speed.msg").write_text("int32 value\n")
    assert "built in" in build(package).stdout
    # The one in use, and the one before: a process may have loaded only a part of it.
    assert len([one for one in (tmp_path / "built").iterdir() if one.is_dir()]) == 2


@pytest.mark.slow
def test_a_build_that_is_killed_leaves_nothing_that_looks_whole(
    define, build, command, ros_graph, tmp_path
) -> None:
    package = define(files=TINY)
    process = subprocess.Popen(
        [*command, str(package)],
        env={**ros_graph.variables, "PYTHONPATH": str(ROOT / "ros")},
        start_new_session=True,
    )
    while process.poll() is None and not any(tmp_path.glob("built/building/work/*/*/msg/*.o")):
        pass
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    assert not (tmp_path / "path.pth").exists()
    assert {one.name for one in (tmp_path / "built").iterdir()} == {".lock", "building"}
    assert build(package).returncode == 0
    assert not (tmp_path / "built" / "building").exists()


@pytest.mark.slow
def test_two_at_a_time_build_once(define, command, ros_graph) -> None:
    package = define(files=TINY)
    both = [
        subprocess.Popen(
            [*command, str(package)],
            env={**ros_graph.variables, "PYTHONPATH": str(ROOT / "ros")},
            stdout=subprocess.PIPE,
            text=True,
        )
        for _ in range(2)
    ]
    said = sorted(process.communicate()[0].split(": ")[1][:8] for process in both)
    assert said == ["built in", "up to da"]


def test_packages_that_need_each_other_are_built_in_order(
    define, build, ros_graph, tmp_path
) -> None:
    needing = define("a_msgs", {"msg/Axes.msg": "z_msgs/Speed[] speeds\n"})
    needed = define("z_msgs", {"msg/Speed.msg": "float64 value\n"})
    done = build(needing, needed)
    assert done.returncode == 0, done.stderr
    folder = (tmp_path / "path.pth").read_text().strip()
    used = USE.replace("module.Speed", "importlib.import_module('z_msgs.msg').Speed")
    assert ros_graph.run(used, folder, "a_msgs") == [0.5]


@pytest.mark.parametrize(
    ("files", "complaint"),
    [
        ({"README.md": ""}, "no interface definitions, expected files such as msg/Name.msg"),
        ({"msg/Speed.msg": "velocity m/s\n"}, "msg/Speed.msg: "),
        ({"msg/Speed.msg": "absent_msgs/Thing thing\n"}, "name the package absent_msgs"),
    ],
)
def test_a_definition_that_is_wrong_is_named(define, build, files, complaint) -> None:
    done = build(define(files=files))
    line = done.stderr.splitlines()[-1]
    assert (done.returncode, complaint in line) == (1, True), done.stderr


def test_a_circle_is_named(define, build) -> None:
    packages = [
        define(f"{one}_msgs", {"msg/Thing.msg": f"{other}_msgs/Thing thing\n"})
        for one, other in ("ab", "ba")
    ]
    assert "these packages need each other: a_msgs, b_msgs" in build(*packages).stderr


def test_without_a_compiler_its_package_is_named(define, build, tmp_path) -> None:
    (tmp_path / "bin").mkdir()
    done = build(define(), PATH=str(tmp_path / "bin"))
    assert done.returncode == 1
    assert "no gcc in PATH; sudo apt-get install -y g++" in done.stderr


def test_what_the_compiler_says_is_told(define, build, tmp_path) -> None:
    compiler = tmp_path / "bin" / "gcc"
    compiler.parent.mkdir()
    compiler.write_text("#!/bin/sh\necho out of luck >&2\nexit 3\n")
    compiler.chmod(0o755)
    found = shutil.which("g++")
    assert found
    done = build(
        define(files=TINY), PATH=f"{compiler.parent}:{Path(found).parent}:{os.environ['PATH']}"
    )
    assert done.returncode == 1
    assert "ended with 3:\nout of luck" in done.stderr
    assert not list(tmp_path.glob("built/*/little_msgs"))
