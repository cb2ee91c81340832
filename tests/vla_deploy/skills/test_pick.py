from dataclasses import replace

import pytest

from vla_deploy.robots import RobotDescription, load_robot
from vla_deploy.skills.actions.pick import require_known_height
from vla_deploy.skills.errors import NotPossible


def with_camera(model: str) -> RobotDescription:
    robot = load_robot("so101")
    camera = replace(robot.camera, model=model)
    return replace(robot, parts=replace(robot.parts, camera=camera))


def test_of_a_camera_without_depth_only_what_it_recognises_is_taken() -> None:
    webcam = with_camera("V4L2")
    with pytest.raises(NotPossible, match=r"object at 0\.20, -0\.10 m.*add its size"):
        require_known_height(webcam, "object", (0.2, -0.1, 0.005))
    require_known_height(webcam, "block", (0.2, -0.1, 0.0125))
    require_known_height(with_camera("RGBD-STREAM"), "object", (0.2, -0.1, 0.005))
