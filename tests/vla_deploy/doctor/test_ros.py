import json
import os
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from vla_deploy.doctor import FindingLevel, ros
from vla_deploy.doctor.context import ask_command
from vla_deploy.gateways.ros.environment import IMPORTS
from vla_deploy.robots import load_robot
from vla_deploy.robots.ros_settings import Accepts, RosSettings

WHOLE = {"python": "3.12.3", "rclpy": "7.1.6", "rmw": "rmw_fastrtps_cpp", "absent": {}}


@pytest.fixture(autouse=True)
def no_variables(monkeypatch) -> None:
    for name in list(os.environ):
        if name.startswith("ROS_"):
            monkeypatch.delenv(name)


@pytest.fixture
def asking(computer):
    """Return what the doctor looks at on a computer whose robot asks for ROS."""

    def ask(**settings):
        asked = RosSettings(**{"enabled": True, "python": sys.executable, **settings})
        return replace(computer.context(), robot=replace(load_robot("butler"), ros=asked))

    return ask


def levels(findings):
    return {one.name: one.level for one in findings}


def test_where_nobody_asks_for_ros_it_is_one_line(computer) -> None:
    context = computer.context(robot="butler")
    (only,) = ros.usage(context)
    assert (only.level, "not in use" in only.measured) == (FindingLevel.OK, True)
    assert [*ros.environment(context), *ros.leftovers(context), *ros.logs(context)] == []


def test_the_profile_may_ask_for_it_too(computer) -> None:
    context = computer.context(robot="butler")
    assert context.profile is not None
    asked = replace(context, profile=replace(context.profile, ros=True))
    assert set(levels(ros.usage(asked))) == {"ROS domain", "ROS discovery"}


def test_a_whole_environment_is_fine(computer, asking) -> None:
    computer.answers["env"] = json.dumps(WHOLE)
    found = levels(ros.environment(asking()))
    assert found == dict.fromkeys(("interpreter", "rclpy", "ROS messages", "RMW"), FindingLevel.OK)


def test_each_package_that_is_missing_is_named_with_what_installs_it(computer, asking) -> None:
    absent = {"nav2_msgs": "ModuleNotFoundError: No module named 'nav2_msgs'"}
    computer.answers["env"] = json.dumps({**WHOLE, "absent": absent})
    (row,) = (one for one in ros.environment(asking()) if one.level is FindingLevel.FAIL)
    assert (row.name, row.remedy) == (
        "nav2_msgs",
        "sudo apt-get install -y ros-jazzy-nav2-msgs",
    )


def test_without_rclpy_its_middleware_is_unknown(computer, asking) -> None:
    told = {**WHOLE, "rclpy": "", "rmw": "", "absent": {"rclpy": "ModuleNotFoundError"}}
    computer.answers["env"] = json.dumps(told)
    found = levels(ros.environment(asking()))
    assert (found["rclpy"], found["RMW"]) == (FindingLevel.FAIL, FindingLevel.MISSING)


@pytest.mark.parametrize(
    ("rmw", "level"), [("rmw_cyclonedds_cpp", FindingLevel.WARN), ("", FindingLevel.FAIL)]
)
def test_another_middleware_is_a_warning_and_none_a_failure(computer, asking, rmw, level) -> None:
    computer.answers["env"] = json.dumps({**WHOLE, "rmw": rmw})
    assert levels(ros.environment(asking()))["RMW"] is level


def test_an_interpreter_that_is_not_there_is_a_failure(asking) -> None:
    (row,) = ros.environment(asking(python="/absent/python"))
    assert (row.level, "/absent/python" in row.measured) == (FindingLevel.FAIL, True)


def test_an_interpreter_that_does_not_start_is_a_failure(computer, asking) -> None:
    for answer in ({}, {"env": "no JSON"}):
        computer.answers = answer
        (row,) = ros.environment(asking())
        assert (row.level, "cannot be used" in row.measured) == (FindingLevel.FAIL, True)


def test_an_interpreter_without_ros_is_told_what_it_lacks(asking) -> None:
    context = replace(asking(), ask=ask_command)
    names = {one.name for one in ros.environment(context) if one.level is FindingLevel.FAIL}
    assert {"rclpy", "vla_deploy_msgs"} <= names <= set(IMPORTS)


def test_the_environment_of_this_computer_is_whole(ros_environment, asking) -> None:
    context = replace(asking(python=str(ros_environment.python)), ask=ask_command)
    assert set(levels(ros.environment(context)).values()) == {FindingLevel.OK}


@pytest.mark.parametrize(
    ("configured", "variable", "level", "measured"),
    [
        (None, "", FindingLevel.OK, "0"),
        (7, "", FindingLevel.OK, "7"),
        (7, "102", FindingLevel.OK, "7"),
        (None, "101", FindingLevel.OK, "101, of the variable ROS_DOMAIN_ID"),
        (None, "102", FindingLevel.FAIL, "102, of the variable ROS_DOMAIN_ID; expected 0 to 101"),
        (
            None,
            "kitchen",
            FindingLevel.FAIL,
            "kitchen, of the variable ROS_DOMAIN_ID; expected 0 to 101",
        ),
    ],
)
def test_the_domain_must_be_one_that_linux_leaves_alone(
    asking, monkeypatch, configured, variable, level, measured
) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", variable)
    domain, _ = ros.usage(asking(domain_id=configured))
    assert (domain.level, domain.measured) == (level, measured)


@pytest.mark.parametrize(
    ("settings", "peers", "level", "words"),
    [
        ({}, "", FindingLevel.OK, "every user of this computer can see the robot, and command it"),
        ({"discovery": "subnet"}, "", FindingLevel.WARN, "every computer on this network can see"),
        ({"discovery": "subnet", "accept": Accepts.STOP}, "", FindingLevel.WARN, "and stop it"),
        ({"accept": Accepts.NOTHING}, "", FindingLevel.OK, "this computer can see the robot"),
        ({}, "192.168.1.4", FindingLevel.WARN, "192.168.1.4 can see the robot, and command it"),
        ({"discovery": "off"}, "192.168.1.4", FindingLevel.OK, "off: "),
        ({"discovery": "system_default"}, "", FindingLevel.WARN, "system_default: "),
    ],
)
def test_who_can_reach_the_robot_is_told(
    asking, monkeypatch, settings, peers, level, words
) -> None:
    monkeypatch.setenv("ROS_STATIC_PEERS", peers)
    _, reach = ros.usage(asking(**settings))
    assert (reach.level, words in reach.measured) == (level, True), reach.measured


def test_leftovers_of_dead_processes_are_counted(computer, asking) -> None:
    (none,) = ros.leftovers(asking())
    assert none.level is FindingLevel.OK
    computer.write("/dev/shm/fastrtps_0123456789abcdef", "x" * 500_000)
    lock = computer.write("/dev/shm/fastrtps_0123456789abcdef_el")
    os.utime(lock, (1.0, 1.0))
    (found,) = ros.leftovers(asking())
    assert found.level is FindingLevel.WARN
    assert found.measured == "0.5 MB of dead processes in 1 segments and ports"
    assert "fastdds shm clean" in found.remedy


def test_logs_that_have_grown_are_a_warning(asking, monkeypatch, tmp_path: Path) -> None:
    monkeypatch.setenv("ROS_LOG_DIR", str(tmp_path / "log"))
    (none,) = ros.logs(asking())
    assert none.level is FindingLevel.OK
    (tmp_path / "log").mkdir()
    with (tmp_path / "log" / "old.log").open("wb") as file:
        file.truncate(ros.MOST_LOG_BYTES + 1)
    (grown,) = ros.logs(asking())
    assert (grown.level, str(tmp_path / "log") in grown.remedy) == (FindingLevel.WARN, True)
