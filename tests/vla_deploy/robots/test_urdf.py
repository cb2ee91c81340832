"""The URDF is the robot of the MJCF: pinocchio computes the same with both, and MuJoCo reads it."""

import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from xml.etree import ElementTree

import mujoco
import numpy as np
import pinocchio
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.vla_deploy.robots.conftest import small_robot
from vla_deploy.robots import RobotDescription, RobotFileError, load_robot
from vla_deploy.robots.camera import CameraMounting
from vla_deploy.robots.kinematics.model import RobotModel
from vla_deploy.robots.kinematics.urdf import roll_pitch_yaw, urdf_of

EXACT = 1e-9
FRAMES = {
    "base": "base_link",
    "lidar": "lidar_link",
    "imu": "imu_link",
    "head_camera": "camera_color_optical_frame",
}
"""What the URDF calls otherwise than the MJCF."""

MARKS = (pinocchio.FrameType.BODY, pinocchio.FrameType.OP_FRAME)
"""Pinocchio's words for links, and for sites of an MJCF."""


@pytest.fixture(scope="module")
def robot() -> RobotDescription:
    return load_robot("butler")


@pytest.fixture(scope="module")
def ours(robot: RobotDescription) -> pinocchio.Model:
    """Return the model of the URDF, its base fixed; each follower has a coordinate of its own."""
    return pinocchio.buildModelFromXML(urdf_of(robot))


@pytest.fixture(scope="module")
def theirs(robot: RobotDescription) -> pinocchio.Model:
    """Return the model of the MJCF, its base fixed, without the rotors' inertia."""
    whole = pinocchio.buildModelFromMJCF(str(robot.mjcf_path))
    locked = [whole.getJointId("base_free")]
    model = pinocchio.buildReducedModel(whole, locked, pinocchio.neutral(whole))
    model.armature = np.zeros(model.nv)  # URDF has no place for it
    return model


def configuration(model: pinocchio.Model, values: dict[str, float]) -> np.ndarray:
    """Return pinocchio's coordinates: cosine and sine for a joint without ends."""
    q = pinocchio.neutral(model)
    for name, value in values.items():
        joint = model.joints[model.getJointId(name)]
        turned = (np.cos(value), np.sin(value)) if joint.nq == 2 else (value,)
        q[joint.idx_q : joint.idx_q + joint.nq] = turned
    return q


def columns(model: pinocchio.Model, names: list[str]) -> list[int]:
    return [model.joints[model.getJointId(name)].idx_v for name in names]


def placement(model: pinocchio.Model, data: pinocchio.Data, frame: str) -> np.ndarray:
    (found,) = (i for i, one in enumerate(model.frames) if one.name == frame and one.type in MARKS)
    return np.array(data.oMf[found].homogeneous)


def test_frames_masses_and_gravity_are_those_of_the_mjcf(
    robot: RobotDescription, ours: pinocchio.Model, theirs: pinocchio.Model
) -> None:
    names = [name for name in theirs.names if name != "universe"]
    assert sorted(names) == sorted(name for name in ours.names if name != "universe")
    marked = [frame.name for frame in theirs.frames if frame.type in MARKS]
    assert {"left_grip", "left_finger_mimic", *FRAMES} < set(marked)
    random = np.random.default_rng(3)
    for _ in range(20):
        values = dict(zip(names, random.uniform(-2.0, 2.0, len(names)), strict=True))
        found = []
        for model in (ours, theirs):
            data, q, v = model.createData(), configuration(model, values), columns(model, names)
            pinocchio.framesForwardKinematics(model, data, q)
            mass = pinocchio.crba(model, data, q)
            mass = np.triu(mass) + np.triu(mass, 1).T
            gravity = pinocchio.computeGeneralizedGravity(model, data, q)
            mapping = FRAMES if model is ours else {}
            poses = [placement(model, data, mapping.get(name, name)) for name in marked]
            found.append((poses, mass[np.ix_(v, v)], gravity[v]))
        for mine, its in zip(*found, strict=True):
            assert np.allclose(mine, its, rtol=0.0, atol=EXACT)


def test_coupled_fingers_weigh_on_their_servo_as_in_the_stack(robot: RobotDescription) -> None:
    model, stack = pinocchio.buildModelFromXML(urdf_of(robot), True), RobotModel(robot)
    data, names = model.createData(), list(robot.joint_names)
    random = np.random.default_rng(4)
    for _ in range(10):
        values = random.uniform(robot.position_min, robot.position_max)
        q = configuration(model, dict(zip(names, values, strict=True)))
        gravity = pinocchio.computeGeneralizedGravity(model, data, q)
        assert np.allclose(gravity[columns(model, names)], stack.gravity(values), atol=EXACT)
        pinocchio.framesForwardKinematics(model, data, q)
        tip = placement(model, data, "left_finger_mimic")
        assert np.allclose(tip, stack_pose(stack, "left_gripper_mimic", values), atol=EXACT)


def stack_pose(stack: RobotModel, joint: str, values: np.ndarray) -> np.ndarray:
    return stack.joint_poses(values)[joint]


def test_the_whole_mass_is_there_also_for_mujoco(robot: RobotDescription) -> None:
    text = urdf_of(robot)
    floating = pinocchio.buildModelFromXML(text, pinocchio.JointModelFreeFlyer())
    # MuJoCo would weld what is fixed to the world, and forget its mass.
    keep = f'<robot name="{robot.name}"><mujoco><compiler fusestatic="false"/></mujoco>'
    read = mujoco.MjModel.from_xml_string(text.replace(f'<robot name="{robot.name}">', keep))
    drawn = mujoco.MjModel.from_xml_path(str(robot.mjcf_path))
    expected = float(drawn.body_mass.sum())
    assert pinocchio.computeTotalMass(floating) == pytest.approx(expected, abs=EXACT)
    assert float(read.body_mass.sum()) == pytest.approx(expected, abs=EXACT)
    for name in (drawn.body(i).name for i in range(1, drawn.nbody)):
        mine = read.body(FRAMES.get(name, name))
        assert mine.mass[0] == pytest.approx(drawn.body(name).mass[0], abs=EXACT)
        moments = sorted(drawn.body(name).inertia)
        assert np.allclose(sorted(mine.inertia), moments, atol=EXACT)


def test_limits_are_the_robot_files_and_the_servos(
    robot: RobotDescription, ours: pinocchio.Model
) -> None:
    def of(name: str) -> tuple[float, float, float, float]:
        joint = ours.joints[ours.getJointId(name)]
        bounds = (ours.lowerPositionLimit, ours.upperPositionLimit)
        ends = [float(bound[joint.idx_q]) for bound in bounds]
        return (*ends, *(float(one[joint.idx_v]) for one in (ours.velocityLimit, ours.effortLimit)))

    for name, limits in robot.limits.items():
        assert of(name)[:3] == pytest.approx((limits.min, limits.max, limits.velocity))
    assert of("left_shoulder_yaw")[3] == pytest.approx(10.6)
    assert of("head_pan")[3] == pytest.approx(1.5)
    # 1.6 N m on a pinion of 12 mm.
    assert of("left_gripper")[3] == of("left_gripper_mimic")[3] == pytest.approx(1.6 / 0.012)
    assert of("left_gripper_mimic") == of("left_gripper")
    # 0.5 m/s and 1.5 rad/s at once, on the outer wheel.
    assert of("left_wheel")[2:] == pytest.approx(((0.5 + 1.5 * 0.17) / 0.08, 4.0))


def test_joints_are_of_the_kind_that_moves_them(robot: RobotDescription) -> None:
    top = ElementTree.fromstring(urdf_of(robot))
    joints = {joint.get("name"): joint for joint in top.findall("joint")}
    kinds = {"left_wheel": "continuous", "left_elbow": "revolute", "left_gripper": "prismatic"}
    assert {name: joints[name].get("type") for name in kinds} == kinds
    mimic = joints["right_gripper_mimic"].find("mimic")
    assert mimic is not None
    assert mimic.attrib == {"joint": "right_gripper", "multiplier": "1", "offset": "0"}
    dynamics = joints["left_wheel"].find("dynamics")
    assert dynamics is not None
    assert dynamics.attrib == {"damping": "0.02", "friction": "0.3"}
    children = {child.get("link") for child in top.findall("joint/child")}
    assert {link.get("name") for link in top.findall("link")} - children == {"base_link"}


def test_the_camera_is_where_calibration_has_found_it(robot: RobotDescription) -> None:
    turn = np.array((0.02, -0.03, 0.01, 1.0))
    turn /= np.linalg.norm(turn)
    camera = robot.camera
    mounting = CameraMounting(
        site=camera.site,
        model=camera.model,
        focal_px=camera.focal_px,
        translation_m=(0.004, -0.003, 0.002),
        quaternion_xyzw=tuple(float(one) for one in turn),
        residual_m=0.001,
        made_at="",
    )
    calibrated = replace(
        robot, parts=replace(robot.parts, camera=replace(camera, mounting=mounting))
    )
    model, stack = pinocchio.buildModelFromXML(urdf_of(calibrated)), RobotModel(calibrated)
    data = model.createData()
    values = np.random.default_rng(5).uniform(robot.position_min, robot.position_max)
    named = dict(zip(robot.joint_names, values, strict=True))
    pinocchio.framesForwardKinematics(model, data, configuration(model, named))
    optical = placement(model, data, "camera_color_optical_frame")
    assert np.allclose(optical, stack.camera_pose(values), atol=EXACT)
    body = placement(model, data, "camera_link")
    forward, left, up = body[:3, :3].T
    assert np.allclose(optical[:3, :3].T, (-left, -up, forward), atol=EXACT)
    assert np.allclose(optical[:3, 3], body[:3, 3], atol=EXACT)


def test_shapes_that_urdf_does_not_have_become_several_or_one_around(
    small: Callable[..., RobotDescription],
) -> None:
    geoms = """<geom type="capsule" size="0.1" fromto="0 0 0 0 0.6 0"/>
      <geom type="ellipsoid" size="0.3 0.32 0.31" contype="0" mass="0"/>
      <geom type="ellipsoid" size="0.1 0.2 0.3" pos="1 0 0"/>
      <geom type="ellipsoid" size="0.3 0.32 0.31" pos="2 0 0"/>"""
    top = ElementTree.fromstring(urdf_of(small(geoms)))
    found = [
        (geometry[0].tag, dict(geometry[0].attrib), origin.get("xyz"))
        for collision in top.iterfind("link[@name='base_link']/collision")
        for geometry, origin in zip(
            collision.findall("geometry"), collision.findall("origin"), strict=True
        )
    ]
    assert found[0] == ("cylinder", {"radius": "0.1", "length": "0.6"}, "0 0.3 0")
    assert sorted(place for _, _, place in found[1:3] if place) == ["0 0 0", "0 0.6 0"]
    assert all(size == {"radius": "0.1"} for _, size, _ in found[1:3])
    # contype 0 alone: conaffinity still lets it collide.
    assert found[3][:2] == ("sphere", {"radius": "0.32"})
    assert found[4] == ("box", {"size": "0.2 0.4 0.6"}, "1 0 0")
    assert found[5] == ("sphere", {"radius": "0.32"}, "2 0 0")


def test_a_mesh_is_left_out_and_said_so(small: Callable[..., RobotDescription]) -> None:
    mesh = """<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
      <geom type="mesh" mesh="shell"/><geom size="0.1"/>"""
    text = urdf_of(small(mesh))
    assert "a mesh is left out here (visual)" in text
    assert "a mesh is left out here (collision)" in text
    assert len(ElementTree.fromstring(text).findall("link/collision")) == 1


COUPLED = '<body name="a"><joint name="x"/><geom size="1"/></body>'
WELD = '<equality><weld body1="base"/></equality>'
CURVE = '<equality><joint joint1="x" joint2="y" polycoef="0 1 2 0 0"/></equality>'


@pytest.mark.parametrize(
    ("inside", "joints", "around", "message"),
    [
        ('<body name="a"><joint name="j" type="ball"/></body>', "j", "", "ball joint"),
        ('<body name="a"><joint name="j" ref="0.2"/></body>', "j", "", "ref 0.2"),
        ('<joint name="j"/>', "j", "", "a joint of the root body"),
        ('<frame><geom size="1"/></frame>', "", "", "a <frame>"),
        ("<body/>", "", "", "without a name"),
        ('<body name="imu_link"/>', "", "", "frame imu_link: got 2 frames of that name"),
        (COUPLED, "", WELD, "no closed loops"),
        (COUPLED, "", CURVE, "zeros behind the second number"),
        (COUPLED, "", CURVE, "joint2 'y'"),
        ('<geom type="mesh" mesh="shell"/>', "", "", "a mesh that has mass"),
        ('<geom size="1" shellinertia="true"/>', "", "", "shellinertia"),
        ("", "", '<compiler settotalmass="3"/>', "compiler.settotalmass: got 3"),
        ("", "", '<compiler balanceinertia="true"/>', "compiler.balanceinertia"),
    ],
)
def test_what_urdf_cannot_hold_is_refused_by_name(
    small: Callable[..., RobotDescription], inside: str, joints: str, around: str, message: str
) -> None:
    with pytest.raises(RobotFileError, match=r"small\.xml") as caught:
        urdf_of(small(inside, *joints.split(), around=around))
    assert message in str(caught.value)


def test_angles_are_exact_where_x_points_straight_up() -> None:
    random = np.random.default_rng(6)
    for pitch in (np.pi / 2, -np.pi / 2, np.pi / 2 - 1e-9, 0.3):
        for _ in range(20):
            roll, yaw = random.uniform(-np.pi, np.pi, 2)
            rotation = pinocchio.rpy.rpyToMatrix(roll, pitch, yaw)
            again = pinocchio.rpy.rpyToMatrix(*roll_pitch_yaw(rotation))
            assert np.allclose(again, rotation, atol=1e-12)


def numbers(values: np.ndarray) -> str:
    return " ".join(f"{value:.17g}" for value in values)


class Invented:
    """Draw an MJCF at random: bodies turned in every way, solids, joints beside their origins."""

    def __init__(self, seed: int) -> None:
        self.random = np.random.default_rng(seed)
        self.joints: list[str] = []
        self.bodies: list[str] = []
        self.degrees = self.one_of(True, False)
        angle = "degree" if self.degrees else "radian"
        order = self.one_of("xyz", "ZYx", "YXZ")
        self.around = f'<compiler angle="{angle}" eulerseq="{order}"/>'
        self.inside = self.one_of("", '<freejoint name="free"/>') + self.solid() + self.body(3)
        self.inside += self.body(2)

    def one_of(self, *choices: object) -> object:
        return choices[self.random.integers(len(choices))]

    def vector(self, count: int = 3) -> np.ndarray:
        return self.random.uniform(-1.0, 1.0, count)

    def turned(self) -> str:
        scale = 57.3 if self.degrees else 1.0
        return str(
            self.one_of(
                "",
                f'quat="{numbers(self.vector(4))}"',
                f'euler="{numbers(self.vector() * 3 * scale)}"',
                f'axisangle="{numbers(self.vector())} {2.0 * scale}"',
                f'xyaxes="{numbers(self.vector(6))}"',
                f'zaxis="{numbers(self.vector())}"',
            )
        )

    def solid(self) -> str:
        kind = self.one_of("box", "sphere", "capsule", "cylinder", "ellipsoid")
        size = numbers(self.random.uniform(0.02, 0.2, 3))
        heavy = self.one_of('mass="0.7"', 'density="400"', "")
        place = f'pos="{numbers(self.vector())}" {self.turned()}'
        if kind != "sphere" and self.one_of(True, False):
            place = f'fromto="{numbers(self.vector(6))}"'
        return f'<geom type="{kind}" size="{size}" {heavy} {place}/>'

    def inertial(self) -> str:
        moments = self.random.uniform(0.2, 0.3, 3)
        place = f'<inertial mass="2" pos="{numbers(self.vector())}"'
        if self.one_of(True, False):
            return f'{place} diaginertia="{numbers(moments)}" {self.turned()}/>'
        turned = pinocchio.rpy.rpyToMatrix(self.vector())
        full = turned @ np.diag(moments) @ turned.T
        order = (full[0, 0], full[1, 1], full[2, 2], full[0, 1], full[0, 2], full[1, 2])
        return f'{place} fullinertia="{numbers(np.array(order))}"/>'

    def joint(self) -> str:
        name = f"joint_{len(self.joints)}"
        self.joints.append(name)
        kind = self.one_of("hinge", "slide")
        anchor = self.one_of("", f'pos="{numbers(self.vector())}"')
        return f'<joint name="{name}" type="{kind}" axis="{numbers(self.vector())}" {anchor}/>'

    def body(self, depth: int) -> str:
        name = f"body_{len(self.bodies)}"
        self.bodies.append(name)
        joints = "".join(self.joint() for _ in range(self.random.integers(3)))
        # What nobody moves stays where it is drawn.
        joints = joints or str(self.one_of("", '<joint type="ball"/>', '<joint pos="1 2 3"/>'))
        own = str(self.one_of("", self.inertial())) + self.solid() + self.solid()
        below = self.body(depth - 1) if depth else ""
        place = f'pos="{numbers(self.vector())}" {self.turned()}'
        return f'<body name="{name}" {place}>{joints}{own}{below}</body>'


@settings(max_examples=40)
@given(seed=st.integers(0, 2**32 - 1))
def test_an_invented_robot_is_to_pinocchio_what_it_is_to_mujoco(
    seed: int, tmp_path_factory: pytest.TempPathFactory
) -> None:
    invented = Invented(seed)
    folder = tmp_path_factory.mktemp("invented")
    robot = small_robot(folder, invented.inside, invented.joints, invented.around)
    model = pinocchio.buildModelFromXML(urdf_of(robot))
    physics = mujoco.MjModel.from_xml_path(str(robot.mjcf_path))
    state, data, names = mujoco.MjData(physics), model.createData(), invented.joints
    values = invented.vector(len(names)) * 2.0
    for name, value in zip(names, values, strict=True):
        state.joint(name).qpos[0] = value
    mujoco.mj_forward(physics, state)
    q = configuration(model, dict(zip(names, values, strict=True)))
    pinocchio.framesForwardKinematics(model, data, q)
    for name in invented.bodies:
        pose = placement(model, data, name)
        assert np.allclose(pose[:3, 3], state.body(name).xpos, atol=EXACT)
        assert np.allclose(pose[:3, :3].ravel(), state.body(name).xmat, atol=EXACT)
    full = np.zeros((physics.nv, physics.nv))
    mujoco.mj_fullM(physics, state, full)
    theirs = [physics.joint(name).dofadr[0] for name in names]
    ours = columns(model, names)
    mass = pinocchio.crba(model, data, q)
    mass = (np.triu(mass) + np.triu(mass, 1).T)[np.ix_(ours, ours)]
    assert np.allclose(mass, full[np.ix_(theirs, theirs)], rtol=EXACT, atol=EXACT)
    gravity = pinocchio.computeGeneralizedGravity(model, data, q)[ours]
    assert np.allclose(gravity, state.qfrc_bias[theirs], rtol=EXACT, atol=EXACT)


ALONE = """
import sys
OURS = {"vla_deploy", "drivers", "platforms", "numpy", "yaml", "_yaml"}
class Refuse:
    def find_spec(self, name, path=None, target=None):
        top = name.partition(".")[0]
        if top not in OURS and top not in sys.stdlib_module_names:
            raise ImportError(f"{name} is not there")
sys.meta_path.insert(0, Refuse())
from vla_deploy.robots import load_robot
from vla_deploy.robots.kinematics.frame_tree import FrameTree
from vla_deploy.robots.kinematics.urdf import urdf_of
robot = load_robot("butler")
FrameTree.of(robot).transforms({})
sys.stdout.write(urdf_of(robot))
"""


def test_it_takes_nothing_but_numpy_and_yaml(robot: RobotDescription) -> None:
    done = subprocess.run(
        [sys.executable, "-c", ALONE],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        check=False,
    )
    assert done.stderr == ""
    assert done.stdout == urdf_of(robot)
