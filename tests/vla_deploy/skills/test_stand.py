import math
from typing import TYPE_CHECKING

from vla_deploy.plans.knowledge import parse_object
from vla_deploy.robots.floor_pose import Pose2D
from vla_deploy.skills.actions.navigate import reach
from vla_deploy.skills.context import Held, SkillContext
from vla_deploy.skills.movements.frames import to_base
from vla_deploy.skills.movements.stand import SIDE_M, standing_poses

if TYPE_CHECKING:
    from conftest import StandingLink

ON_TABLE_M = (3.0, 1.12, 0.5)
BEYOND_THE_WALL_M = (-0.3, -0.3, 0.5)


def test_every_pose_is_free_and_has_the_object_within_reach(context: SkillContext) -> None:
    poses = standing_poses(context, ON_TABLE_M)
    assert poses
    for pose in poses:
        assert context.planner.is_free(pose.x_m, pose.y_m)
        distance_m = math.dist((pose.x_m, pose.y_m), ON_TABLE_M[:2])
        distances_m = context.robot.reach.distances_m
        assert min(distances_m) - 1e-9 <= distance_m <= max(distances_m) + 1e-9


def test_the_object_is_put_before_the_left_shoulder(context: SkillContext) -> None:
    for pose in standing_poses(context, ON_TABLE_M):
        x_m, y_m, _ = to_base(pose, ON_TABLE_M)
        assert x_m > 0.3
        assert abs(y_m - SIDE_M) < 0.01


def test_a_full_right_hand_has_it_before_the_right_shoulder(context: SkillContext) -> None:
    context.hands["right"] = Held(kind="cup", colour="red", width_m=0.07, below_grip_m=0.05)
    for pose in standing_poses(context, ON_TABLE_M):
        assert to_base(pose, ON_TABLE_M)[1] < 0.0


def test_the_robot_stays_where_it_already_reaches(
    context: SkillContext, standing: "StandingLink"
) -> None:
    standing.pose = standing_poses(context, ON_TABLE_M)[0]
    assert standing_poses(context, ON_TABLE_M) == [standing.pose]
    assert len(standing_poses(context, ON_TABLE_M, anew=True)) > 1


def test_it_stays_also_where_it_would_not_be_sent(
    context: SkillContext, standing: "StandingLink"
) -> None:
    standing.pose = Pose2D(x_m=3.0, y_m=1.44, yaw_rad=-math.pi / 2)
    assert not context.planner.is_free(standing.pose.x_m, standing.pose.y_m)
    box = {"id": "box_1", "class": "box", "colour": "red", "position_m": [*ON_TABLE_M]}
    standing.objects = [box | {"last_seen_ns": context.link.clock.now_ns(), "confidence": 0.9}]
    assert list(reach(context, parse_object("box"))) == []
    assert context.out_of_reach == {}


def test_an_object_beyond_the_walls_has_no_pose(context: SkillContext) -> None:
    assert standing_poses(context, BEYOND_THE_WALL_M) == []
