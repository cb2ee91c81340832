"""Names by which a plan may call what is in the robot file."""

from dataclasses import replace

import pytest

from vla_deploy.plans.knowledge import match_device, spoken_devices, world_of
from vla_deploy.robots import load_robot
from vla_deploy.robots.home_devices import DeviceKind, HomeDevice

BUTLER = load_robot("butler")
OTHER = HomeDevice(name="desk_lamp", kind=DeviceKind.LAMP, place="bedroom", aliases=("light spot",))


@pytest.mark.parametrize(
    ("said", "device"),
    [
        ("lamp", "lamp"),
        ("The Floor Lamp", "lamp"),
        ("living room light", "lamp"),
        ("the lamp in the lounge", "lamp"),
        ("desk_lamp", "desk_lamp"),
        ("my light spot in the bedroom", "desk_lamp"),
        ("kitchen lamp", None),
        ("the socket in the bedroom", None),
        ("", None),
        (7, None),
    ],
)
def test_a_device_is_called_by_its_names_and_by_where_it_stands(
    said: object, device: str | None
) -> None:
    robot = replace(BUTLER, devices={**BUTLER.devices, "desk_lamp": OTHER})
    assert match_device(said, spoken_devices(robot)) == device


@pytest.mark.parametrize(("has_reach", "lacks"), [(True, ""), (False, "so101 has no [reach]")])
def test_an_arm_on_a_table_hands_over_within_its_reach(has_reach: bool, lacks: str) -> None:
    robot = load_robot("so101")
    if not has_reach:
        robot = replace(robot, parts=replace(robot.parts, reach=None))
    assert world_of(robot, {}).lacks.get("hand_over", "").startswith(lacks)
    assert ("hand_over" in world_of(robot, {}).skills) is has_reach
