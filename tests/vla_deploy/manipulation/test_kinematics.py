import numpy as np
import pytest

from vla_deploy.manipulation.errors import PostureUnreachable
from vla_deploy.manipulation.grasps import hand_down
from vla_deploy.manipulation.kinematics import ArmKinematics
from vla_deploy.robots import RobotDescription, load_robot
from vla_deploy.robots.kinematics.model import RobotModel, full_positions

SIDES = ("left", "right")
MAX_LOAD = 0.45


@pytest.fixture(scope="module")
def robot() -> RobotDescription:
    return load_robot("butler")


@pytest.fixture(scope="module")
def arms(robot: RobotDescription) -> dict[str, ArmKinematics]:
    return {side: ArmKinematics(robot, side) for side in SIDES}


@pytest.fixture(scope="module")
def tuck(robot: RobotDescription) -> np.ndarray:
    return full_positions(robot, list(robot.poses["tuck"].items()))


def outward(side: str) -> float:
    return 1.0 if side == "left" else -1.0


@pytest.mark.parametrize("side", SIDES)
def test_a_reached_pose_is_found_again(
    robot: RobotDescription, arms: dict[str, ArmKinematics], tuck: np.ndarray, side: str
) -> None:
    target = hand_down((0.42, 0.15 * outward(side), 0.52), 0.4)

    solution = arms[side].solve(target, tuck)

    assert np.allclose(arms[side].forward(solution.positions)[:3, 3], target[:3, 3], atol=3e-4)
    assert np.allclose(arms[side].forward(solution.positions)[:3, :3], target[:3, :3], atol=3e-3)
    assert (solution.positions >= robot.position_min).all()
    assert (solution.positions <= robot.position_max).all()


@pytest.mark.parametrize("side", SIDES)
def test_solving_moves_only_the_arms_own_joints(
    robot: RobotDescription, arms: dict[str, ArmKinematics], tuck: np.ndarray, side: str
) -> None:
    solution = arms[side].solve(hand_down((0.4, 0.1 * outward(side), 0.5), 0.0), tuck)
    own = robot.group(robot.hands[side].arm).joints
    others = [index for name, index in robot.joint_index.items() if name not in own]

    assert np.array_equal(solution.positions[others], tuck[others])


@pytest.mark.parametrize("side", SIDES)
def test_table_tops_in_front_are_reachable_top_down_at_any_yaw_with_torque_to_spare(
    robot: RobotDescription, arms: dict[str, ArmKinematics], tuck: np.ndarray, side: str
) -> None:
    # Tables of 0.40 to 0.60 m: grip points 2 cm above the lowest up to 8 cm above the highest.
    random = np.random.default_rng(3)
    model = RobotModel(robot)
    capacity = np.array(
        [robot.model_of(s.joint).stall_torque_nm / s.travel_per_rad for s in robot.servo_bus.servos]
    )
    for x_m in np.linspace(0.25, 0.55, 7):
        for y_m in np.linspace(0.0, 0.3, 7):
            for z_m in (0.42, 0.48, 0.54, 0.6, 0.68):
                yaw_rad = random.uniform(-np.pi / 2, np.pi / 2)
                target = hand_down((x_m, y_m * outward(side), z_m), yaw_rad)
                found = arms[side].solve(target, tuck).positions
                assert (np.abs(model.gravity(found)) / capacity).max() < MAX_LOAD


@pytest.mark.parametrize("side", SIDES)
def test_each_arm_reaches_across_the_middle(
    arms: dict[str, ArmKinematics], tuck: np.ndarray, side: str
) -> None:
    for x_m in (0.3, 0.4, 0.5):
        target = hand_down((x_m, -0.1 * outward(side), 0.5), 0.0)
        assert arms[side].solve(target, tuck).is_exact


def test_the_same_question_has_the_same_answer(
    arms: dict[str, ArmKinematics], tuck: np.ndarray
) -> None:
    target = hand_down((0.5, 0.25, 0.45), 1.5)
    first = arms["left"].solve(target, tuck).positions

    assert np.array_equal(arms["left"].solve(target, tuck).positions, first)


def test_the_mirror_image_is_solved_by_the_other_arm(
    robot: RobotDescription, arms: dict[str, ArmKinematics], tuck: np.ndarray
) -> None:
    left = arms["left"].solve(hand_down((0.45, 0.2, 0.5), 0.3), tuck).positions
    right = arms["right"].solve(hand_down((0.45, -0.2, 0.5), -0.3), tuck).positions
    index = robot.joint_index

    assert left[index["left_elbow"]] == pytest.approx(right[index["right_elbow"]], abs=1e-2)
    assert left[index["left_shoulder_yaw"]] == pytest.approx(
        -right[index["right_shoulder_yaw"]], abs=1e-2
    )


def test_a_point_beyond_the_arm_is_refused_with_the_distance_missing(
    arms: dict[str, ArmKinematics], tuck: np.ndarray
) -> None:
    with pytest.raises(PostureUnreachable, match=r"left hand cannot reach x 1\.200") as caught:
        arms["left"].solve(hand_down((1.2, 0.2, 0.5), 0.0), tuck)

    assert 0.2 < caught.value.position_error_m < 1.2
    assert "mm" in str(caught.value)


def test_a_straight_line_keeps_the_hand_on_it_and_ends_at_the_target(
    arms: dict[str, ArmKinematics], tuck: np.ndarray
) -> None:
    arm = arms["left"]
    above = arm.solve(hand_down((0.42, 0.15, 0.615), 0.5), tuck).positions
    target = hand_down((0.42, 0.15, 0.48), 0.5)

    waypoints = arm.straight_line(above, target, step_m=0.01)

    points = np.array([arm.forward(row)[:3, 3] for row in waypoints])
    assert np.array_equal(waypoints[0], above)
    assert len(waypoints) == 15
    assert np.abs(points[:, :2] - target[:2, 3]).max() < 1e-3
    assert np.allclose(points[-1], target[:3, 3], atol=3e-4)
    assert (np.diff(points[:, 2]) < 0).all()


def test_a_straight_line_through_the_unreachable_is_refused(
    arms: dict[str, ArmKinematics], tuck: np.ndarray
) -> None:
    start = arms["left"].solve(hand_down((0.45, 0.15, 0.5), 0.0), tuck).positions

    with pytest.raises(PostureUnreachable):
        arms["left"].straight_line(start, hand_down((0.95, 0.15, 0.5), 0.0))


def test_the_camera_frame_points_ahead_and_follows_the_head(
    robot: RobotDescription, arms: dict[str, ArmKinematics], tuck: np.ndarray
) -> None:
    level = arms["left"].camera_pose(tuck)
    turned = tuck.copy()
    turned[robot.joint_index["head_pan"]] = np.pi / 2
    turned[robot.joint_index["head_tilt"]] = 0.5

    assert np.allclose(level[:3, 2], [1, 0, 0], atol=1e-9)
    assert np.allclose(level[:3, 0], [0, -1, 0], atol=1e-9)
    assert np.allclose(
        arms["left"].camera_pose(turned)[:3, 2], [0, np.cos(0.5), -np.sin(0.5)], atol=1e-9
    )
