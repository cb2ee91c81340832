"""The arms that people own: their MJCFs have the published frames, masses and jaws, and their
robot files fit them.

Each row of `ARMS` holds what is published. Of so101 that is google-deepmind/mujoco_menagerie's
robotstudio_so101, of koch_v1_1 its low_cost_robot_arm, turned to point along +x, of wx250s its
trossen_wx250s, of omx ROBOTIS-GIT/robotis_mujoco_menagerie's robotis_omx; world positions at zero
were computed from their frames.
"""

import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from math import pi

import mujoco
import numpy as np
import pinocchio
import pytest
from numpy.typing import ArrayLike, NDArray

from sim_twin.physics.compose import compose
from sim_twin.worlds import load_world
from vla_deploy.robots import load_robot
from vla_deploy.robots.loader import ROBOTS_DIR

Vector = tuple[float, float, float]
Document = Mapping[str, dict[str, dict[str, float]]]
FORWARD, LEFT, UP = np.eye(3)
DOWN = -UP


@dataclass(frozen=True, kw_only=True)
class PublishedJoint:
    """Place and axis at zero in the base's frame, and the travel between the stops."""

    place_m: Vector
    axis: Vector
    range: tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class PublishedArm:
    """What is published of an arm; `masses_kg` are those of its bodies, the last joint is the
    gripper's.

    `pads` are the outermost ones with the axis along which each looks at the other; `openings_m` is
    between them, by the gripper's joint. `sinks_rad` is how far a joint gives way at rest without
    power. `ready_*` is the grip of the ready pose.
    """

    joints: Mapping[str, PublishedJoint]
    tip_m: Vector
    masses_kg: Mapping[str, float]
    pads: tuple[tuple[str, Vector], tuple[str, Vector]]
    openings_m: Mapping[float, float]
    sinks_rad: float
    ready_m: Vector
    ready_closing: ArrayLike


def joint(place_m: Vector, axis: Vector, low: float, high: float) -> PublishedJoint:
    return PublishedJoint(place_m=place_m, axis=axis, range=(low, high))


ARMS = {
    "so101": PublishedArm(
        joints={
            "shoulder_pan": joint((0.0388, 0.0, 0.0624), (0, 0, -1), -1.91986, 1.91986),
            "shoulder_lift": joint((0.0692, -0.0183, 0.1166), (0, 1, 0), -1.74533, 1.74533),
            "elbow_flex": joint((0.0972, -0.0183, 0.2292), (0, 1, 0), -1.69, 1.69),
            "wrist_flex": joint((0.2321, -0.0183, 0.2344), (0, 1, 0), -1.658063, 1.658063),
            "wrist_roll": joint((0.2932, 0.0, 0.2344), (-1, 0, 0), -2.74385, 2.74385),
            "gripper": joint((0.3166, 0.0176, 0.2555), (0, -1, 0), -0.174533, 1.745329),
        },
        tip_m=(0.3914, -0.001, 0.2463),
        masses_kg={
            "base": 0.147,
            "shoulder": 0.100006,
            "upper_arm": 0.103,
            "lower_arm": 0.104,
            "wrist": 0.079,
            "hand": 0.087,
            "moving_jaw": 0.012,
            "camera_mount": 0.012,
        },
        pads=(("fixed_jaw_pad_4", (1, 0, 0)), ("moving_jaw_pad_2", (-1, 0, 0))),
        openings_m={-0.1745: 0.005, 0.0: 0.018, 0.5: 0.056, 1.0: 0.090, 1.745: 0.131},
        sinks_rad=0.003,
        ready_m=(0.219, 0.0, 0.075),
        ready_closing=FORWARD,
    ),
    # Openings are between the pads of that model, which are 4 mm thick. Its base has no mass.
    "koch_v1_1": PublishedArm(
        joints={
            "shoulder_pan": joint((-0.012, 0.0, 0.0409), (0, 0, -1), -2.2, 2.2),
            "shoulder_lift": joint((-0.012, 0.0209, 0.0563), (0, 1, 0), -0.6, 1.57),
            "elbow_flex": joint((0.0028, 0.0144, 0.1646), (0, 1, 0), -1.57, 1.45),
            "wrist_flex": joint((0.1033, 0.0144, 0.1673), (0, 1, 0), -2.0, 2.0),
            "wrist_roll": joint((0.1483, 0.0013, 0.1673), (-1, 0, 0), -3.14, 3.14),
            "gripper": joint((0.1614, 0.0088, 0.1818), (0, 0, 1), -0.032, 1.6),
        },
        tip_m=(0.2151, -0.0092, 0.1677),
        masses_kg={
            "shoulder": 0.05014,
            "upper_arm": 0.050177,
            "lower_arm": 0.06379,
            "wrist": 0.019805,
            "hand": 0.029277,
            "moving_jaw": 0.012831,
        },
        pads=(("fixed_jaw_pad_3", (0, 1, 0)), ("moving_jaw_pad_3", (0, -1, 0))),
        openings_m={-0.032: 0.001, 0.0: 0.0027, 0.2: 0.0136, 0.5: 0.0298, 1.0: 0.0549, 1.6: 0.0802},
        sinks_rad=0.06,
        ready_m=(0.148, 0.0053, 0.06),
        ready_closing=LEFT,
    ),
    # How far its jaws open is not published. The tip is the end effector of the vendor's URDF.
    "omx": PublishedArm(
        joints={
            "shoulder_pan": joint((-0.01125, 0.0, 0.034), (0, 0, 1), -3.14, 3.14),
            "shoulder_lift": joint((-0.01125, 0.0, 0.0975), (0, 1, 0), -1.868, 1.5708),
            "elbow_flex": joint((0.03025, 0.0, 0.21065), (0, 1, 0), -1.571, 1.5708),
            "wrist_flex": joint((0.19225, 0.0, 0.21065), (0, 1, 0), -1.7453, 1.7453),
            "wrist_roll": joint((0.22095, 0.0, 0.21065), (1, 0, 0), -3.14, 3.14),
            "gripper": joint((0.25045, 0.0075, 0.21065), (0, 0, 1), 0.0, 1.7453),
        },
        tip_m=(0.31288, -0.0016, 0.21065),
        masses_kg={
            "base": 0.22389,
            "shoulder": 0.06599,
            "upper_arm": 0.08722,
            "lower_arm": 0.08376,
            "wrist": 0.02998,
            "hand": 0.04381,
            "left_jaw": 0.01209,
            "right_jaw": 0.01209,
        },
        pads=(("right_jaw_pad_2", (0, 1, 0)), ("left_jaw_pad_2", (0, -1, 0))),
        openings_m={},
        sinks_rad=0.08,
        ready_m=(0.18875, -0.0016, 0.08),
        ready_closing=LEFT,
    ),
    # The vendor's 30 mm to 74 mm are between the fingers' frames; their tips are 9.6 mm further in.
    "wx250s": PublishedArm(
        joints={
            "waist": joint((0.0, 0.0, 0.072), (0, 0, 1), -3.14158, 3.14158),
            "shoulder": joint((0.0, 0.0, 0.11065), (0, 1, 0), -1.88496, 1.98968),
            "elbow": joint((0.04975, 0.0, 0.36065), (0, 1, 0), -2.14675, 1.6057),
            "forearm_roll": joint((0.22475, 0.0, 0.36065), (1, 0, 0), -3.14158, 3.14158),
            "wrist_angle": joint((0.29975, 0.0, 0.36065), (0, 1, 0), -1.74533, 2.14675),
            "wrist_rotate": joint((0.36475, 0.0, 0.36065), (1, 0, 0), -3.14158, 3.14158),
            "gripper": joint((0.43075, 0.0, 0.36065), (0, 1, 0), 0.015, 0.037),
        },
        tip_m=(0.458325, 0.0, 0.36065),
        masses_kg={
            "base": 0.538736,
            "shoulder_link": 0.480879,
            "upper_arm": 0.430811,
            "upper_forearm": 0.234589,
            "lower_forearm": 0.220991,
            "wrist": 0.084957,
            "hand": 0.110084,
            "left_finger": 0.016246,
            "right_finger": 0.016246,
        },
        pads=(("right_finger_pad", (0, 1, 0)), ("left_finger_pad", (0, -1, 0))),
        openings_m={0.015: 0.0108, 0.02: 0.0208, 0.037: 0.0548},
        sinks_rad=0.09,
        ready_m=(0.3, 0.0, 0.12),
        ready_closing=LEFT,
    ),
}
arms = pytest.mark.parametrize("name", ARMS)


@cache
def model_of(name: str) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_path(str(ROBOTS_DIR / name / f"{name}.xml"))


@cache
def document_of(name: str) -> Document:
    return tomllib.loads((ROBOTS_DIR / name / "robot.toml").read_text())


def posed(model: mujoco.MjModel, joints: Mapping[str, float]) -> mujoco.MjData:
    """Return the model with joints there, and those that an equality couples to them."""
    data = mujoco.MjData(model)
    for name, value in joints.items():
        data.joint(name).qpos[0] = value
    for follower, leader, ratio in zip(
        model.eq_obj1id, model.eq_obj2id, model.eq_data[:, 1], strict=True
    ):
        data.qpos[model.jnt_qposadr[follower]] = ratio * data.qpos[model.jnt_qposadr[leader]]
    mujoco.mj_forward(model, data)
    return data


def pad_faces(name: str, data: mujoco.MjData) -> list[NDArray[np.float64]]:
    """Return the middles of the inner faces of the outermost pads."""
    model, faces = model_of(name), []
    for pad, out in ARMS[name].pads:
        turn = data.geom(pad).xmat.reshape(3, 3)
        faces.append(data.geom(pad).xpos + turn @ (np.asarray(out) * model.geom(pad).size))
    return faces


def servo_models(name: str) -> Iterable[tuple[str, Mapping[str, float]]]:
    """Return each servo's actuator with its datasheet."""
    document = document_of(name)
    return [
        (f"{servo['joint']}{suffix}", document["servo_models"][str(servo["model"])])
        for kind, suffix in (("servos", ""), ("shadows", "_shadow"))
        for servo in document["servo_bus"].get(kind, ())
    ]


@arms
def test_joints_and_tip_are_where_the_published_arm_has_them(name: str) -> None:
    model, arm = model_of(name), ARMS[name]
    data = posed(model, {})

    for joint_name, published in arm.joints.items():
        measured = data.joint(joint_name)
        assert measured.xanchor == pytest.approx(published.place_m, abs=1e-3), joint_name
        assert measured.xaxis == pytest.approx(published.axis, abs=0.05), joint_name
        assert model.joint(joint_name).range == pytest.approx(published.range), joint_name
    assert data.site("tip").xpos == pytest.approx(arm.tip_m, abs=1e-3)


@arms
def test_bodies_have_the_published_masses_and_inertias_that_bodies_can_have(name: str) -> None:
    model, arm = model_of(name), ARMS[name]

    bodies = {model.body(i).name for i in range(2, model.nbody)} - {"camera_stand"}
    assert bodies == set(arm.masses_kg) - {"base"}
    assert model.body("camera_stand").mass[0] == 0.0  # it stands beside the arm
    for body_name, mass_kg in arm.masses_kg.items():
        body = model.body(body_name)
        moments = np.sort(body.inertia)
        assert body.mass[0] == pytest.approx(mass_kg, rel=0.02), body_name
        assert moments[0] > 0.0
        assert moments[0] + moments[1] >= moments[2], body_name


@pytest.mark.parametrize(
    ("name", "gripper_rad"), [(name, each) for name, arm in ARMS.items() for each in arm.openings_m]
)
def test_the_jaw_opens_as_the_published_one(name: str, gripper_rad: float) -> None:
    one, other = pad_faces(name, posed(model_of(name), {"gripper": gripper_rad}))

    opening_m = ARMS[name].openings_m[gripper_rad]
    assert np.linalg.norm(other - one) == pytest.approx(opening_m, abs=0.003)


@arms
def test_the_hand_of_the_robot_file_opens_as_its_jaws(name: str) -> None:
    robot = load_robot(name)
    limits = robot.limits["gripper"]
    for gripper_rad in np.linspace(limits.min, limits.max, 6):
        one, other = pad_faces(name, posed(model_of(name), {"gripper": gripper_rad}))
        opening_m = robot.hands["hand"].opening_m(gripper_rad)
        assert opening_m == pytest.approx(np.linalg.norm(other - one), abs=0.01), gripper_rad


@arms
def test_the_grip_points_along_the_fingers_and_closes_along_y(name: str) -> None:
    data = posed(model_of(name), {"gripper": load_robot(name).poses["ready"]["gripper"]})
    grip = data.site("grip").xmat.reshape(3, 3)
    roll = list(ARMS[name].joints)[-2]
    hub, tip = data.joint(roll).xanchor, data.site("tip").xpos
    one, other = pad_faces(name, data)
    across = grip.T @ (other - one)
    from_grip = [grip.T @ (face - data.site("grip").xpos) for face in (one, other)]

    assert (grip.T @ (tip - hub))[2] > 0.06
    assert across[1] == pytest.approx(np.linalg.norm(across), rel=0.02)
    assert from_grip[0][1] < 0.0 < from_grip[1][1]
    assert all(abs(offset[2]) < 0.012 for offset in from_grip)


@arms
def test_pinocchio_reads_the_same_arm(name: str) -> None:
    model = model_of(name)
    other = pinocchio.buildModelFromMJCF(str(ROBOTS_DIR / name / f"{name}.xml"))
    data = other.createData()
    low, high = model.jnt_range.T
    names = [model.joint(index).name for index in range(model.njnt)]
    for drawn in np.random.default_rng(0).uniform(low, high, (5, model.nq)):
        ours = posed(model, dict(zip(names, drawn, strict=True)))
        q = np.array(ours.qpos)
        pinocchio.framesForwardKinematics(other, data, q)
        grip = data.oMf[other.getFrameId("grip")].translation
        weight = pinocchio.computeGeneralizedGravity(other, data, q)
        assert grip == pytest.approx(ours.site("grip").xpos, abs=1e-9)
        assert weight == pytest.approx(ours.qfrc_bias, abs=1e-9)


@arms
def test_every_actuator_is_the_datasheet_motor_of_its_servo(name: str) -> None:
    for joint_name, sheet in servo_models(name):
        motor, stall_nm = model_of(name).actuator(joint_name), sheet["stall_torque_nm"]
        assert motor.gainprm[0] == motor.forcerange[1] == stall_nm
        assert motor.biasprm[2] == pytest.approx(-stall_nm / sheet["no_load_speed_rad_s"], rel=1e-3)
        assert list(motor.ctrlrange) == [-1.0, 1.0]


@arms
def test_folded_and_ready_it_does_not_touch_itself(name: str) -> None:
    poses = document_of(name)["poses"]

    assert set(poses) == {"rest", "folded", "aside", "ready"}
    for pose in ("folded", "aside", "ready"):
        assert posed(model_of(name), poses[pose]).ncon == 0, pose


@arms
def test_the_limp_arm_stays_at_rest_on_the_table(name: str) -> None:
    world, rest = load_world("table"), document_of(name)["poses"]["rest"]
    model = compose(ROBOTS_DIR / name / f"{name}.xml", world.mjcf_path, world.mount)
    data = posed(model, rest)
    for _ in range(2000):
        mujoco.mj_step(model, data)

    for joint_name, value in rest.items():
        found, within = data.joint(joint_name).qpos[0], ARMS[name].sinks_rad
        assert found == pytest.approx(value, abs=within), joint_name
    assert np.abs(data.qvel[-len(rest) :]).max() < 0.001


@arms
def test_the_ready_hand_points_straight_down_over_the_table(name: str) -> None:
    grip = posed(model_of(name), document_of(name)["poses"]["ready"]).site("grip")
    turn, arm = grip.xmat.reshape(3, 3), ARMS[name]

    assert turn[:, 2] == pytest.approx(DOWN, abs=0.01)
    assert turn[:, 1] == pytest.approx(np.asarray(arm.ready_closing), abs=0.01)
    assert grip.xpos == pytest.approx(arm.ready_m, abs=0.002)


@arms
def test_the_robot_file_fits_the_mjcf(name: str) -> None:
    robot = load_robot(name)

    assert robot.joint_names == tuple(ARMS[name].joints)
    for servo in robot.servo_bus.servos:
        low, high = ARMS[name].joints[servo.joint].range
        limits, slack = robot.limits[servo.joint], 0.029 * servo.travel_per_rad
        # A gripper may close on itself.
        least = low if servo.joint == "gripper" else low + slack
        assert least <= limits.min < limits.max < high - slack
        assert max(abs(low - servo.offset), abs(high - servo.offset)) < pi * servo.travel_per_rad
    assert robot.hands["hand"].grip_site == "grip"
