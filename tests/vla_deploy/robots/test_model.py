from pathlib import Path

import mujoco
import numpy as np
import pytest

from vla_deploy.robots import RobotDescription, RobotFileError, load_robot
from vla_deploy.robots.kinematics.model import RobotModel
from vla_deploy.robots.loader import ROBOTS_DIR

SITES = ("left_grip", "right_grip", "head_camera", "lidar", "imu")


@pytest.fixture(scope="module")
def robot() -> RobotDescription:
    return load_robot("butler")


@pytest.fixture(scope="module")
def model(robot: RobotDescription) -> RobotModel:
    return RobotModel(robot)


@pytest.fixture(scope="module")
def physics(robot: RobotDescription) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_path(str(robot.mjcf_path))


def random_positions(robot: RobotDescription, count: int) -> np.ndarray:
    random = np.random.default_rng(7)
    shape = (count, len(robot.joint_names))
    return random.uniform(robot.position_min, robot.position_max, shape)


def state_at(
    robot: RobotDescription, physics: mujoco.MjModel, positions: np.ndarray
) -> mujoco.MjData:
    data = mujoco.MjData(physics)
    for name, value in zip(robot.joint_names, positions, strict=True):
        data.joint(name).qpos[0] = value
        if name.endswith("_gripper"):
            data.joint(f"{name}_mimic").qpos[0] = value
    mujoco.mj_forward(physics, data)
    return data


def test_sites_are_where_mujoco_has_them(
    robot: RobotDescription, model: RobotModel, physics: mujoco.MjModel
) -> None:
    for positions in random_positions(robot, 50):
        data = state_at(robot, physics, positions)
        for site in SITES:
            pose = model.site_pose(site, positions)
            assert np.allclose(pose[:3, 3], data.site(site).xpos, atol=1e-9)
            assert np.allclose(pose[:3, :3], data.site(site).xmat.reshape(3, 3), atol=1e-9)


def test_the_camera_looks_along_its_optical_frame(
    robot: RobotDescription, model: RobotModel, physics: mujoco.MjModel
) -> None:
    positions = random_positions(robot, 1)[0]
    camera = state_at(robot, physics, positions).camera("head_camera")
    right, up, back = camera.xmat.reshape(3, 3).T

    pose = model.camera_pose(positions)

    assert np.allclose(pose[:3, :3], np.column_stack([right, -up, -back]), atol=1e-9)
    assert np.allclose(pose[:3, 3], camera.xpos, atol=1e-9)
    assert physics.camera("head_camera").fovy[0] == pytest.approx(np.degrees(robot.camera.fovy_rad))


def test_gravity_is_what_mujoco_needs_to_hold_each_servo_joint(
    robot: RobotDescription, model: RobotModel, physics: mujoco.MjModel
) -> None:
    for positions in random_positions(robot, 50):
        bias = state_at(robot, physics, positions).qfrc_bias
        expected = [
            bias[physics.joint(name).dofadr[0]]
            + (bias[physics.joint(f"{name}_mimic").dofadr[0]] if name.endswith("_gripper") else 0.0)
            for name in robot.joint_names
        ]
        assert np.allclose(model.gravity(positions), expected, atol=1e-9)


def test_no_mass_is_lost_between_the_two(model: RobotModel, physics: mujoco.MjModel) -> None:
    assert model.total_mass_kg == pytest.approx(float(physics.body_mass.sum()), abs=1e-9)
    assert 20.0 < model.total_mass_kg < 24.0


def test_jacobian_is_the_slope_of_the_site_pose(robot: RobotDescription, model: RobotModel) -> None:
    positions, step = random_positions(robot, 1)[0], 1e-6
    pose = model.site_pose("left_grip", positions)
    jacobian = model.site_jacobian("left_grip", positions)
    for column in range(len(positions)):
        moved = positions.copy()
        moved[column] += step
        slope = (model.site_pose("left_grip", moved)[:3, 3] - pose[:3, 3]) / step
        assert np.allclose(pose[:3, :3] @ jacobian[:3, column], slope, atol=1e-5)


def test_a_file_whose_first_body_is_not_the_robot_is_refused(tmp_path: Path) -> None:
    robot = load_robot("butler")
    text = robot.mjcf_path.read_text()
    other = tmp_path / "scene.xml"
    other.write_text(
        text.replace("<worldbody>", '<worldbody><body name="table"><geom size="1"/></body>')
    )

    with pytest.raises(RobotFileError, match="every servo joint below the first body"):
        RobotModel(_with_mjcf(robot, other))


def _with_mjcf(robot: RobotDescription, path: Path) -> RobotDescription:
    fields = {name: getattr(robot, name) for name in RobotDescription.__slots__}
    return RobotDescription(**{**fields, "mjcf_path": path})


def test_the_model_reads_the_file_of_the_robot_folder() -> None:
    assert load_robot("butler").mjcf_path == ROBOTS_DIR / "butler" / "butler.xml"
