"""A robot that is driven or moved over ROS is refused where it is in no ROS graph."""

import shutil
from pathlib import Path

import pytest

from vla_deploy.robots import RobotFileError, load_robot
from vla_deploy.robots.loader import ROBOT_FILE, ROBOTS_DIR
from vla_deploy.supervisor.errors import RosNotFound
from vla_deploy.supervisor.processes.ros_environment import require_environment


def with_ros(folder: Path, table: str) -> Path:
    shutil.copytree(ROBOTS_DIR / "butler", folder)
    file = folder / ROBOT_FILE
    file.write_text(f"{file.read_text(encoding='utf-8')}\n[ros]\n{table}\n", encoding="utf-8")
    return folder


@pytest.mark.parametrize(
    "key", ['navigation = "nav2"', 'arms = "follow_joint_trajectory"'], ids=("nav2", "arms")
)
def test_ros_must_be_on(tmp_path: Path, key: str) -> None:
    with pytest.raises(RobotFileError, match="while ROS is off"):
        load_robot(with_ros(tmp_path / "off", key))
    assert load_robot(with_ros(tmp_path / "on", f"enabled = true\n{key}")).ros.is_needed


def test_ros_must_be_there(tmp_path: Path) -> None:
    nowhere = 'python = "/nowhere/python"\nenabled = true\n'
    require_environment(load_robot(with_ros(tmp_path / "own", nowhere)))
    driven = load_robot(with_ros(tmp_path / "nav2", nowhere + 'navigation = "nav2"'))
    with pytest.raises(RosNotFound, match="set both to"):
        require_environment(driven)


def test_each_arm_has_a_server_or_one_has_all(tmp_path: Path) -> None:
    arms = 'enabled = true\narms = "follow_joint_trajectory"\n'
    each = load_robot(with_ros(tmp_path / "each", arms)).ros
    assert each.server_of("left_arm") == "left_arm_controller/follow_joint_trajectory"
    one = load_robot(with_ros(tmp_path / "one", arms + 'trajectory_server = "all/move"')).ros
    assert one.server_of("left_arm") == "all/move"
