"""Compose one MuJoCo model from a robot's MJCF and a world's MJCF."""

import math
import warnings
from collections.abc import Sequence
from pathlib import Path

import mujoco

from sim_twin.errors import TwinModelMismatch
from sim_twin.worlds.placement import BodyPose

STEP_S = 0.002
ROBOT_ROOT = "base"
ROBOT_LOOKS_GROUP = 2
ROBOT_COLLISION_GROUP = 3
"""The world keeps to groups 0 and 1 for what is seen, 4 for collision shapes that are not."""
TREAD = "_tread"
"""What the MJCF calls the part of an omni wheel that is on the floor, after the wheel's joint."""
_ROLLERS = (0.03, 0.7, 0.002, 0.0001, 0.0001)
"""Friction along the axle, where rollers turn, and across it: rubber on boards (both judged)."""
_FILM_SIZE = (640, 480)
_IMPEDANCE_RATIO = 100.0
"""Friction over normal impedance: at 10, a held thing creeps 4 mm a minute through the fingers."""


def compose(
    robot_xml: Path,
    world_xml: Path,
    mount: BodyPose | None = None,
    omni_wheels: Sequence[str] = (),
) -> mujoco.MjModel:
    """Put the robot into the world, a fixed one at the mount, and return the compiled model.

    The robot's geoms move to groups 2 (looks) and 3 (collision), so that rays can pass them by.
    `omni_wheels` are the joints of wheels that slip along their axles.

    Raises:
        ModelMismatch: a file does not compile, the robot has no root body `base`, or an omni wheel
            has no tread.
    """
    world = _load(world_xml)
    robot = _load(robot_xml)
    if robot.body(ROBOT_ROOT) is None:
        raise TwinModelMismatch(
            f"{robot_xml}: expected a root body named {ROBOT_ROOT!r}, found none"
        )
    for geom in robot.geoms:
        looks = geom.group <= ROBOT_LOOKS_GROUP
        geom.group = ROBOT_LOOKS_GROUP if looks else ROBOT_COLLISION_GROUP
    _set_options(world)
    _let_slip(world, robot, omni_wheels)
    try:
        return _attach(robot, world, mount)
    except ValueError as error:
        raise TwinModelMismatch(f"{robot_xml} in {world_xml}: {error}") from error


def _let_slip(world: mujoco.MjSpec, robot: mujoco.MjSpec, wheels: Sequence[str]) -> None:
    """Give the treads of omni wheels their rollers: a grip that differs by direction.

    A tread is a capsule along the axle: MuJoCo lays the first direction of its friction with a
    plane along the capsule, and the second across, in which the wheel rolls.
    """
    for wheel in wheels:
        tread = robot.geom(f"{wheel}{TREAD}")
        if tread is None or tread.type != mujoco.mjtGeom.mjGEOM_CAPSULE:
            raise TwinModelMismatch(f"expected a capsule {wheel}{TREAD!r} along the axle, got none")
        tread.contype = tread.conaffinity = 0
        for floor in world.geoms:
            if floor.type == mujoco.mjtGeom.mjGEOM_PLANE:
                pair = world.add_pair(geomname1=tread.name, geomname2=floor.name, condim=4)
                pair.friction = _ROLLERS


def _load(path: Path) -> mujoco.MjSpec:
    try:
        return mujoco.MjSpec.from_file(str(path))
    except ValueError as error:
        raise TwinModelMismatch(f"{path}: {error}") from error


def _attach(robot: mujoco.MjSpec, world: mujoco.MjSpec, mount: BodyPose | None) -> mujoco.MjModel:
    """Compose without MuJoCo's warning about saving, and its log file: nothing is saved."""
    mujoco.set_mju_user_warning(_drop)
    try:
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "Attaching a spec with an empty prefix")
            world.attach(robot, prefix="", frame=_frame_of(robot, world, mount))
            return world.compile()
    finally:
        mujoco.set_mju_user_warning(None)


def _frame_of(
    robot: mujoco.MjSpec, world: mujoco.MjSpec, mount: BodyPose | None
) -> mujoco.MjsFrame:
    """Return where the robot is put: one that can be moved about is placed later."""
    if mount is None or robot.body(ROBOT_ROOT).joints:
        return world.worldbody.add_frame()
    half = mount.yaw_rad / 2.0
    turn = (math.cos(half), 0.0, 0.0, math.sin(half))
    return world.worldbody.add_frame(pos=mount.position_m, quat=turn)


def _drop(_message: str) -> None:
    """Drop MuJoCo's own print; what matters arrives as a Python warning too."""


def _set_options(world: mujoco.MjSpec) -> None:
    """Set what grasps need: pyramidal friction cones creep and drop heavy objects."""
    world.option.timestep = STEP_S
    world.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    world.option.solver = mujoco.mjtSolver.mjSOL_NEWTON
    world.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    world.option.impratio = _IMPEDANCE_RATIO
    world.visual.quality.shadowsize = 0
    world.visual.quality.offsamples = 0
    # Along cylinders and capsules more than this shows nothing, and costs a third of a frame.
    world.visual.quality.numstacks = 10
    width, height = _FILM_SIZE
    world.visual.global_.offwidth = max(width, world.visual.global_.offwidth)
    world.visual.global_.offheight = max(height, world.visual.global_.offheight)
