import mujoco
import numpy as np
import pytest

from vla_deploy.robots import RobotDescription, load_robot
from vla_deploy.robots.kinematics.model import RobotModel, full_positions


@pytest.fixture(scope="module")
def robot() -> RobotDescription:
    return load_robot("butler")


@pytest.fixture(scope="module")
def physics(robot: RobotDescription) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_path(str(robot.mjcf_path))


def tucked(robot: RobotDescription) -> list[tuple[str, float]]:
    return [*robot.poses["tuck"].items(), *robot.poses["look_ahead"].items()]


def stand(physics: mujoco.MjModel, targets: list[tuple[str, float]]) -> mujoco.MjData:
    data = mujoco.MjData(physics)
    for name, value in targets:
        data.joint(name).qpos[0] = value
    mujoco.mj_forward(physics, data)
    return data


def test_every_actuator_is_the_datasheet_motor_of_its_servo(
    robot: RobotDescription, physics: mujoco.MjModel
) -> None:
    for servo in robot.servo_bus.servos:
        motor, sheet = physics.actuator(servo.joint), robot.model_of(servo.joint)
        slope = sheet.stall_torque_nm / sheet.no_load_speed_rad_s
        assert motor.gainprm[0] == pytest.approx(sheet.stall_torque_nm)
        assert motor.biasprm[2] == pytest.approx(-slope, rel=1e-3)
        assert motor.gear[0] == pytest.approx(1.0 / servo.travel_per_rad, rel=1e-6)
        assert list(motor.ctrlrange) == [-1.0, 1.0]
        assert motor.forcerange[1] == pytest.approx(sheet.stall_torque_nm)


def test_base_dimensions_agree_with_the_mjcf(
    robot: RobotDescription, physics: mujoco.MjModel
) -> None:
    data = stand(physics, [])
    gap = data.body("left_rim").xpos[1] - data.body("right_rim").xpos[1]

    assert gap == pytest.approx(robot.base.track_m)
    assert physics.geom("left_tyre").size[0] == pytest.approx(robot.base.wheel_radius_m)
    assert physics.geom("base_deck").size[0] <= robot.base.footprint_radius_m


WRISTS_BEYOND_M = 0.012
"""What keeping the hands 20 mm apart costs, 0.8 m up; the map's cells are 0.05 m."""


def test_tucked_arms_stay_near_the_footprint_and_touch_nothing(
    robot: RobotDescription, physics: mujoco.MjModel
) -> None:
    data = stand(physics, tucked(robot))
    solid = [g for g in range(physics.ngeom) if physics.geom_contype[g]]
    arms = [g for g in solid if data.geom_xpos[g, 2] > 0.4]
    reach = max(_reach(physics, data, geom) for geom in arms)

    assert reach <= robot.base.footprint_radius_m + WRISTS_BEYOND_M
    assert data.ncon == 0


def _reach(physics: mujoco.MjModel, data: mujoco.MjData, geom: int) -> float:
    centre, axes = data.geom_xpos[geom], data.geom_xmat[geom].reshape(3, 3)
    size, kind = physics.geom_size[geom], physics.geom_type[geom]
    if kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
        ends = [centre + sign * size[1] * axes[:, 2] for sign in (-1, 1)]
        return float(max(np.hypot(*end[:2]) for end in ends) + size[0])
    if kind == mujoco.mjtGeom.mjGEOM_SPHERE:
        return float(np.hypot(*centre[:2]) + size[0])
    corners = np.array(np.meshgrid(*([-h, h] for h in physics.geom_aabb[geom, 3:])))
    return float(np.hypot(*(centre[:, None] + axes @ corners.reshape(3, -1))[:2]).max())


def test_no_named_pose_makes_the_robot_touch_itself(
    robot: RobotDescription, physics: mujoco.MjModel
) -> None:
    moved_to = {name: pose for name, pose in robot.poses.items() if name != "rest"}
    for pose in moved_to.values():
        assert stand(physics, [*tucked(robot), *pose.items()]).ncon == 0


def test_the_shoulder_holds_the_outstretched_arm_with_half_its_torque(
    robot: RobotDescription,
) -> None:
    model = RobotModel(robot)
    forward = [("left_shoulder_pitch", np.pi / 2), ("right_shoulder_pitch", np.pi / 2)]
    torque = np.abs(model.gravity(full_positions(robot, forward)))
    stall = np.array([robot.model_of(name).stall_torque_nm for name in robot.joint_names])

    load = torque / stall

    assert load[robot.joint_index["left_shoulder_pitch"]] < 0.5
    assert load[robot.joint_index["left_elbow"]] < 0.5


def test_the_robot_stands_still_on_its_wheels_and_casters(
    robot: RobotDescription, physics: mujoco.MjModel
) -> None:
    spec = mujoco.MjSpec.from_file(str(robot.mjcf_path))
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[2, 2, 0.1])
    model = spec.compile()
    data = stand(model, tucked(robot))
    hold = RobotModel(robot).gravity(full_positions(robot, tucked(robot)))
    for name, torque in zip(robot.joint_names, hold, strict=True):
        data.actuator(name).ctrl[0] = torque / model.actuator(name).gainprm[0]
    for _ in range(1000):
        mujoco.mj_step(model, data)

    assert np.linalg.norm(data.body("base").xpos) < 0.002
    assert data.body("base").xmat[8] > 0.9999
