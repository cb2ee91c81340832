"""What `[reach]` promises is held against the kinematics."""

from dataclasses import replace

import pytest

from vla_deploy.manipulation.downward_reach import reach_faults
from vla_deploy.robots import RobotDescription, load_robot
from vla_deploy.robots.reach import Reach

SO101 = load_robot("so101")


def reaching(robot: RobotDescription, reach: Reach) -> RobotDescription:
    return replace(robot, parts=replace(robot.parts, reach=reach))


def keys(robot: RobotDescription) -> list[str]:
    return [fault.key for fault in reach_faults(robot, robot.name)]


@pytest.mark.parametrize("name", ["so101", "koch_v1_1", "omx", "wx250s", "so101_pair"])
def test_hands_get_to_what_the_arms_that_come_with_the_stack_promise(name: str) -> None:
    assert not keys(load_robot(name))


@pytest.mark.parametrize(
    ("change", "faults"),
    [
        ({"distances_m": (0.22, 0.6)}, ["reach.distances_m[1]"]),
        ({"grip_heights_m": (0.005, 0.4)}, ["reach.grip_heights_m[1]"]),
        ({"put_ahead_m": (0.2, 0.5), "put_aside_m": (0.0,)}, ["reach.put_ahead_m[1]"]),
    ],
)
def test_what_no_hand_gets_to_is_named_with_what_helps(
    change: dict[str, tuple[float, ...]], faults: list[str]
) -> None:
    robot = reaching(SO101, replace(SO101.reach, **change))
    found = list(reach_faults(robot, "my_arm"))
    assert [one.key for one in found] == faults
    assert "vla-deploy robot reach --robot my_arm" in str(found[0])
