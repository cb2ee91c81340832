"""Load a robot into a world: the composed model, and its state at the start of a run."""

import mujoco

from sim_twin.errors import TwinModelMismatch
from sim_twin.physics.compose import ROBOT_ROOT, compose
from sim_twin.physics.engine import Engine
from sim_twin.physics.shafts import Shaft
from sim_twin.worlds.placement import draw_poses, load_world
from vla_deploy.robots import RobotDescription

REST_POSE = "rest"
"""The robot file's name for how its joints lie without power."""


def load_model(robot: RobotDescription, world: str) -> mujoco.MjModel:
    """Compose robot and world, "" for that of the robot file.

    Raises:
        ModelMismatch: there is no such world, or the two do not fit together.
    """
    try:
        found = load_world(world or robot.twin.world)
        if robot.parts.base is None and found.mount is None:
            raise TwinModelMismatch(
                f"world {found.name}: {robot.name} does not drive, and this world's file has no "
                "[mount] to screw it down; take one that has, such as table"
            )
        base = robot.parts.base
        omni = robot.wheel_joints if base and base.is_holonomic else ()
        return compose(robot.mjcf_path, found.mjcf_path, found.mount, omni)
    except FileNotFoundError as error:
        raise TwinModelMismatch(str(error)) from error


def load_engine(robot: RobotDescription, world: str, seed: int) -> Engine:
    """Return the physics with the robot at its start pose and the objects where the seed puts them.

    Raises:
        ModelMismatch: there is no such world, or robot and world do not fit together.
    """
    engine = Engine(load_model(robot, world), servo_shafts(robot), drive_shafts(robot))
    if robot.parts.base is not None:
        start = robot.start_pose
        engine.place(ROBOT_ROOT, start.x_m, start.y_m, 0.0, start.yaw_rad)
    engine.pose(robot.poses.get(REST_POSE, {}))
    for name, pose in draw_poses(world or robot.twin.world, seed).items():
        engine.place(name, *pose.position_m, pose.yaw_rad)
    return engine


def servo_shafts(robot: RobotDescription) -> list[Shaft]:
    """Return how each servo's shaft drives its joint: those of shadows, then of wheels last."""
    bus = robot.servo_bus
    return [
        Shaft(
            joint=servo.joint,
            actuator=named.joint,
            offset=servo.offset,
            ratio=servo.sign * servo.travel_per_rad,
        )
        for servo, named in zip(
            (*bus.servos, *bus.shadows, *bus.wheels), bus.all_servos, strict=True
        )
    ]


def drive_shafts(robot: RobotDescription) -> list[Shaft]:
    """Return the wheels' shafts as they are: the emulated drives know their gear and sign."""
    can_bus = robot.parts.can_bus
    return [Shaft(joint=drive.joint) for drive in (can_bus.drives if can_bus else ())]
