"""The SO-101's MJCF has the published arm's frames, masses and jaws, and its robot file fits it.

The numbers are google-deepmind/mujoco_menagerie's, robotstudio_so101; the world positions at zero
were computed from its frames.
"""

import tomllib
from collections.abc import Mapping
from math import pi

import mujoco
import numpy as np
import pinocchio
import pytest
from numpy.typing import ArrayLike, NDArray

from vla_deploy.robots import load_robot
from vla_deploy.robots.loader import ROBOTS_DIR

FOLDER = ROBOTS_DIR / "so101"
MJCF = FOLDER / "so101.xml"
JOINTS = ("shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll", "gripper")
PLACES_M = {
    "shoulder_pan": (0.0388, 0.0, 0.0624),
    "shoulder_lift": (0.0692, -0.0183, 0.1166),
    "elbow_flex": (0.0972, -0.0183, 0.2292),
    "wrist_flex": (0.2321, -0.0183, 0.2344),
    "wrist_roll": (0.2932, 0.0, 0.2344),
    "gripper": (0.3166, 0.0176, 0.2555),
}
TIP_M = (0.3914, -0.001, 0.2463)
AXES = {
    "shoulder_pan": (0, 0, -1),
    "shoulder_lift": (0, 1, 0),
    "elbow_flex": (0, 1, 0),
    "wrist_flex": (0, 1, 0),
    "wrist_roll": (-1, 0, 0),
    "gripper": (0, -1, 0),
}
RANGES = {
    "shoulder_pan": (-1.91986, 1.91986),
    "shoulder_lift": (-1.74533, 1.74533),
    "elbow_flex": (-1.69, 1.69),
    "wrist_flex": (-1.658063, 1.658063),
    "wrist_roll": (-2.74385, 2.74385),
    "gripper": (-0.174533, 1.745329),
}
MASSES_KG = {
    "base": 0.147,
    "shoulder": 0.100006,
    "upper_arm": 0.103,
    "lower_arm": 0.104,
    "wrist": 0.079,
    "hand": 0.087,
    "moving_jaw": 0.012,
    "camera_mount": 0.012,
}
OPENINGS_M = {-0.1745: 0.005, 0.0: 0.018, 0.5: 0.056, 1.0: 0.090, 1.745: 0.131}
Document = Mapping[str, dict[str, dict[str, float]]]

INWARDS = np.array((1.0, 0.0, 0.0))
"""Of the fixed jaw's pads, along the hand's x; those of the moving jaw look the other way."""


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_path(str(MJCF))


@pytest.fixture(scope="module")
def document() -> Document:
    return tomllib.loads((FOLDER / "robot.toml").read_text())


def posed(model: mujoco.MjModel, joints: Mapping[str, float]) -> mujoco.MjData:
    data = mujoco.MjData(model)
    for name, value in joints.items():
        data.joint(name).qpos[0] = value
    mujoco.mj_forward(model, data)
    return data


def grip_after(model: mujoco.MjModel, joint: str, value: float) -> NDArray[np.float64]:
    return np.array(posed(model, {joint: value}).site("grip").xpos)


def pad_face(
    model: mujoco.MjModel, data: mujoco.MjData, pad: str, out: ArrayLike
) -> NDArray[np.float64]:
    turn = data.geom(pad).xmat.reshape(3, 3)
    return np.array(data.geom(pad).xpos + turn @ (np.asarray(out) * model.geom(pad).size))


def opening_m(model: mujoco.MjModel, gripper_rad: float) -> float:
    """Return the distance between the inner faces of the pads at the finger tips."""
    data = posed(model, {"gripper": gripper_rad})
    fixed = pad_face(model, data, "fixed_jaw_pad_4", INWARDS)
    moving = pad_face(model, data, "moving_jaw_pad_2", -INWARDS)
    return float(np.linalg.norm(moving - fixed))


def test_joints_and_tip_are_where_the_published_arm_has_them(model: mujoco.MjModel) -> None:
    data = posed(model, {})

    assert [model.joint(index).name for index in range(model.njnt)] == list(JOINTS)
    for name, place in PLACES_M.items():
        assert data.joint(name).xanchor == pytest.approx(place, abs=1e-3), name
    assert data.site("tip").xpos == pytest.approx(TIP_M, abs=1e-3)


def test_joints_turn_about_the_published_axes_within_the_published_ranges(
    model: mujoco.MjModel,
) -> None:
    data = posed(model, {})

    for name in JOINTS:
        assert data.joint(name).xaxis == pytest.approx(AXES[name], abs=0.05), name
        assert model.joint(name).range == pytest.approx(RANGES[name])


def test_positive_joints_turn_the_hand_right_down_and_open(model: mujoco.MjModel) -> None:
    at_zero = grip_after(model, "gripper", 0.0)

    assert grip_after(model, "shoulder_pan", 0.3)[1] < at_zero[1] - 0.05
    for name in ("shoulder_lift", "elbow_flex", "wrist_flex"):
        assert grip_after(model, name, 0.3)[2] < at_zero[2] - 0.03, name
    assert grip_after(model, "shoulder_lift", 0.3)[0] > at_zero[0]
    assert opening_m(model, 0.3) > opening_m(model, 0.0)


def test_bodies_have_the_published_masses_and_inertias_that_bodies_can_have(
    model: mujoco.MjModel,
) -> None:
    bodies = {model.body(i).name: float(model.body(i).mass[0]) for i in range(1, model.nbody)}
    assert bodies.pop("camera_stand") == 0.0  # beside the arm
    assert set(bodies) == set(MASSES_KG)
    for name, mass_kg in MASSES_KG.items():
        body = model.body(name)
        moments = np.sort(body.inertia)
        assert body.mass[0] == pytest.approx(mass_kg, rel=0.02)
        assert moments[0] > 0.0
        assert moments[0] + moments[1] >= moments[2], name
    assert float(model.body_mass.sum()) == pytest.approx(0.644, rel=0.02)


@pytest.mark.parametrize("gripper_rad", OPENINGS_M)
def test_the_jaw_opens_as_the_published_one(model: mujoco.MjModel, gripper_rad: float) -> None:
    assert opening_m(model, gripper_rad) == pytest.approx(OPENINGS_M[gripper_rad], abs=0.003)


def test_the_grip_points_along_the_fingers_and_closes_along_y(model: mujoco.MjModel) -> None:
    data = posed(model, {"gripper": 0.1})
    grip = data.site("grip").xmat.reshape(3, 3)
    hub, tip = data.joint("wrist_roll").xanchor, data.site("tip").xpos
    fixed = pad_face(model, data, "fixed_jaw_pad_4", INWARDS)
    moving = pad_face(model, data, "moving_jaw_pad_2", -INWARDS)
    across = grip.T @ (moving - fixed)
    from_grip = [grip.T @ (face - data.site("grip").xpos) for face in (fixed, moving)]

    assert (grip.T @ (tip - hub))[2] > 0.09
    assert across[1] == pytest.approx(np.linalg.norm(across), rel=0.02)
    assert from_grip[0][1] < 0.0 < from_grip[1][1]
    assert all(abs(offset[2]) < 0.012 for offset in from_grip)


def test_pinocchio_reads_the_same_arm(model: mujoco.MjModel) -> None:
    other = pinocchio.buildModelFromMJCF(str(MJCF))
    data = other.createData()
    low, high = model.jnt_range.T
    for q in np.random.default_rng(0).uniform(low, high, (5, model.nq)):
        ours = posed(model, dict(zip(JOINTS, q, strict=True)))
        pinocchio.framesForwardKinematics(other, data, q)
        grip = data.oMf[other.getFrameId("grip")].translation
        weight = pinocchio.computeGeneralizedGravity(other, data, q)
        assert grip == pytest.approx(ours.site("grip").xpos, abs=1e-9)
        assert weight == pytest.approx(ours.qfrc_bias, abs=1e-9)


def test_every_actuator_is_the_datasheet_motor_of_its_servo(
    model: mujoco.MjModel, document: Document
) -> None:
    sheet = document["servo_models"]["STS3215-C018"]
    stall_nm = sheet["stall_torque_nm"]

    for name in JOINTS:
        motor = model.actuator(name)
        assert motor.gainprm[0] == motor.forcerange[1] == stall_nm
        assert motor.biasprm[2] == pytest.approx(-stall_nm / sheet["no_load_speed_rad_s"], rel=1e-3)
        assert list(motor.ctrlrange) == [-1.0, 1.0]


def test_only_at_rest_does_the_arm_touch_itself(model: mujoco.MjModel, document: Document) -> None:
    touching = {name: posed(model, pose).ncon > 0 for name, pose in document["poses"].items()}

    assert touching == {"rest": True, "folded": False, "aside": False, "ready": False}


def test_the_limp_arm_stays_at_rest(model: mujoco.MjModel, document: Document) -> None:
    rest = document["poses"]["rest"]
    data = posed(model, rest)
    for _ in range(2000):
        mujoco.mj_step(model, data)

    for name, value in rest.items():
        assert data.joint(name).qpos[0] == pytest.approx(value, abs=0.002), name


def test_the_ready_hand_points_straight_down_over_the_table(
    model: mujoco.MjModel, document: Document
) -> None:
    grip = posed(model, document["poses"]["ready"]).site("grip")
    turn = grip.xmat.reshape(3, 3)

    assert turn[:, 2] == pytest.approx((0.0, 0.0, -1.0), abs=0.01)
    assert turn[:, 1] == pytest.approx((1.0, 0.0, 0.0), abs=0.01)
    assert grip.xpos == pytest.approx((0.219, 0.0, 0.075), abs=0.002)


def test_the_robot_file_fits_the_mjcf() -> None:
    robot = load_robot("so101")

    assert robot.joint_names == JOINTS
    for servo in robot.servo_bus.servos:
        low, high = RANGES[servo.joint]
        limits = robot.limits[servo.joint]
        assert low + 0.029 < limits.min < limits.max < high - 0.029
        assert max(abs(low - servo.offset), abs(high - servo.offset)) < pi
    assert robot.hands["hand"].grip_site == "grip"
