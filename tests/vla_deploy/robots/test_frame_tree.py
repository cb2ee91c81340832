"""The frames that ROS is told are where pinocchio and MuJoCo have the robot's bodies."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace

import mujoco
import numpy as np
import pinocchio
import pytest

from tests.vla_deploy.robots.test_urdf import Invented
from vla_deploy.robots import RobotDescription, load_robot
from vla_deploy.robots.kinematics.frame_tree import FrameTransform, FrameTree
from vla_deploy.robots.kinematics.model import RobotModel
from vla_deploy.robots.kinematics.orientation import matrix
from vla_deploy.robots.kinematics.urdf import urdf_of

EXACT = 1e-9
TWO_HINGES = """<body name="wrist" pos="0.1 0.2 0.3" euler="10 20 30">
  <joint name="swing" axis="1 0 0" pos="0 0 0.1"/><joint name="twist" axis="0 0 1"/>
  <geom size="0.1"/></body>"""


@pytest.fixture(scope="module")
def robot() -> RobotDescription:
    return load_robot("butler")


@pytest.fixture(scope="module")
def tree(robot: RobotDescription) -> FrameTree:
    return FrameTree.of(robot)


def in_base(tree: FrameTree, positions: Mapping[str, float]) -> dict[str, np.ndarray]:
    """Return every frame's pose in the base frame, as a listener of /tf chains them."""
    hung: dict[str, FrameTransform] = {}
    for one in (*tree.fixed, *tree.transforms(positions)):
        assert one.child not in hung, f"{one.child} has two parents"
        hung[one.child] = one
    poses = {"base_link": np.eye(4)}

    def pose(frame: str) -> np.ndarray:
        if frame not in poses:
            one, step = hung[frame], np.eye(4)
            assert np.linalg.norm(one.quaternion) == pytest.approx(1.0, abs=1e-12)
            step[:3, :3], step[:3, 3] = matrix(np.array(one.quaternion)), one.xyz
            poses[frame] = pose(one.parent) @ step
        return poses[frame]

    return {frame: pose(frame) for frame in ("base_link", *hung)}


def drawn(robot: RobotDescription, count: int) -> Iterable[np.ndarray]:
    random = np.random.default_rng(8)
    shape = (count, len(robot.joint_names))
    return random.uniform(robot.position_min, robot.position_max, shape)


def test_every_frame_is_where_pinocchio_has_the_link_of_the_urdf(
    robot: RobotDescription, tree: FrameTree
) -> None:
    model = pinocchio.buildModelFromXML(urdf_of(robot), True)
    data = model.createData()
    for values in drawn(robot, 10):
        q = pinocchio.neutral(model)
        for name, value in zip(robot.joint_names, values, strict=True):
            q[model.joints[model.getJointId(name)].idx_q] = value
        pinocchio.framesForwardKinematics(model, data, q)
        poses = in_base(tree, dict(zip(robot.joint_names, values, strict=True)))
        links = [i for i, f in enumerate(model.frames) if f.type == pinocchio.FrameType.BODY]
        assert {model.frames[i].name for i in links} - {"universe"} == poses.keys()
        for i in links:
            if model.frames[i].name != "universe":
                its = data.oMf[i].homogeneous
                assert np.allclose(poses[model.frames[i].name], its, atol=EXACT)


def test_grips_and_fingers_are_where_the_stack_moves_them(
    robot: RobotDescription, tree: FrameTree
) -> None:
    stack = RobotModel(robot)
    for values in drawn(robot, 5):
        poses = in_base(tree, dict(zip(robot.joint_names, values, strict=True)))
        joints = stack.joint_poses(values)
        for side in ("left", "right"):
            grip = stack.site_pose(f"{side}_grip", values)
            assert np.allclose(poses[f"{side}_grip"], grip, atol=EXACT)
            finger = joints[f"{side}_gripper_mimic"]
            assert np.allclose(poses[f"{side}_finger_mimic"], finger, atol=EXACT)
        camera = poses["camera_color_optical_frame"]
        assert np.allclose(camera, stack.camera_pose(values), atol=EXACT)


def test_wheels_turn_about_their_axle(tree: FrameTree) -> None:
    (wheel,) = (one for one in tree.transforms({"left_wheel": 1.0}) if one.child == "left_rim")
    assert wheel.parent == "base_link"
    assert wheel.xyz == (0.0, 0.17, 0.08)
    assert wheel.quaternion == pytest.approx((0.0, np.sin(0.5), 0.0, np.cos(0.5)))


def test_a_message_can_take_the_numbers_as_they_are(tree: FrameTree) -> None:
    for one in (*tree.fixed, *tree.transforms({"left_elbow": np.float64(0.3)})):
        assert all(type(number) is float for number in (*one.xyz, *one.quaternion))


def test_frames_of_the_sensors_have_the_names_that_ros_expects(tree: FrameTree) -> None:
    parents = {one.child: one.parent for one in tree.fixed}
    assert parents == {
        "lidar_link": "base_link",
        "imu_link": "base_link",
        "left_grip": "left_hand",
        "right_grip": "right_hand",
        "camera_link": "head",
        "camera_color_optical_frame": "camera_link",
    }


def test_several_joints_of_a_body_have_frames_between_them(
    small: Callable[..., RobotDescription],
) -> None:
    tree = FrameTree.of(small(TWO_HINGES, "swing", "twist"))
    assert [(one.name, one.parent, one.child) for one in tree.moving] == [
        ("swing", "base_link", "swing_link"),
        ("twist", "swing_link", "wrist"),
    ]
    assert tree.moving[1].xyz == (0.0, 0.0, -0.1)


def test_a_body_that_nothing_moves_is_fixed(small: Callable[..., RobotDescription]) -> None:
    tree = FrameTree.of(small(TWO_HINGES))
    assert tree.moving == ()
    assert tree.transforms({"swing": 1.0}) == []
    (wrist,) = (one for one in tree.fixed if one.child == "wrist")
    assert wrist.xyz == (0.1, 0.2, 0.3)


def test_a_follower_may_move_otherwise_than_its_leader(
    small: Callable[..., RobotDescription],
) -> None:
    fingers = """<body name="a"><joint name="lead" type="slide" axis="0 1 0"/></body>
      <body name="b"><joint name="follow" axis="0 0 1"/><geom size="1"/></body>"""
    couple = '<joint joint1="follow" joint2="lead" polycoef="0.1 -2 0 0 0"/>'
    robot = small(fingers, "lead", around=f"<equality>{couple}</equality>")
    tree = FrameTree.of(robot)
    first, then = tree.transforms({"lead": 0.25})
    assert first.xyz == (0.0, 0.25, 0.0)
    assert then.quaternion == pytest.approx((0.0, 0.0, np.sin(-0.2), np.cos(-0.2)))
    model = pinocchio.buildModelFromXML(urdf_of(robot))
    limits, joint = robot.limits["lead"], model.joints[model.getJointId("follow")]
    assert model.lowerPositionLimit[joint.idx_q] == pytest.approx(0.1 - 2 * limits.max)
    assert model.upperPositionLimit[joint.idx_q] == pytest.approx(0.1 - 2 * limits.min)
    assert model.velocityLimit[joint.idx_v] == pytest.approx(2 * limits.velocity)


def test_two_sensors_may_sit_on_one_site(robot: RobotDescription) -> None:
    shared = replace(
        robot, parts=replace(robot.parts, imu=replace(robot.imu, site=robot.lidar.site))
    )
    fixed = {one.child: one for one in FrameTree.of(shared).fixed}
    assert fixed["imu_link"].xyz == fixed["lidar_link"].xyz == (0.0, 0.0, 0.19)


@pytest.mark.parametrize("seed", range(10))
def test_an_invented_robots_frames_are_where_mujoco_has_its_bodies(
    small: Callable[..., RobotDescription], seed: int
) -> None:
    invented = Invented(seed)
    robot = small(invented.inside, *invented.joints, around=invented.around)
    physics = mujoco.MjModel.from_xml_path(str(robot.mjcf_path))
    state, values = mujoco.MjData(physics), invented.vector(len(invented.joints)) * 2.0
    positions = dict(zip(invented.joints, values, strict=True))
    for name, value in positions.items():
        state.joint(name).qpos[0] = value
    mujoco.mj_kinematics(physics, state)
    poses = in_base(FrameTree.of(robot), positions)
    for name in invented.bodies:
        assert np.allclose(poses[name][:3, 3], state.body(name).xpos, atol=EXACT)
        assert np.allclose(poses[name][:3, :3].ravel(), state.body(name).xmat, atol=EXACT)
