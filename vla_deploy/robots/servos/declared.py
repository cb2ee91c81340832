"""Declare the servos of a robot file to the drivers of their family."""

from drivers.servo.family import ServoFamily, family_of
from drivers.servo.joint_servo import JointServo
from vla_deploy.robots.description import RobotDescription
from vla_deploy.robots.devices import shadow_name


def bus_family(robot: RobotDescription) -> ServoFamily:
    """Return the family of a robot's servos, which is one for a bus.

    Raises:
        UnknownModel: no family has the model.
    """
    return family_of(robot.servo_bus.servos[0].model)


def servo_specs(robot: RobotDescription) -> list[JointServo]:
    """Return what the bus driver must know of each servo of a robot, those of shadows last.

    Servos that are only read have no goals, so their own position limits do not matter.
    """
    family, bus = bus_family(robot), robot.servo_bus
    rows = [(one, one.joint) for one in bus.servos]
    rows += [(one, shadow_name(one.joint)) for one in bus.shadows]
    return [
        family.servo(
            servo_id=servo.id,
            model_name=servo.model,
            joint=name,
            sign=servo.sign,
            offset_rad=servo.offset,
            travel_per_rad=servo.travel_per_rad,
            goal_range=None
            if robot.read_only
            else (robot.limits[servo.joint].min, robot.limits[servo.joint].max),
        )
        for servo, name in rows
    ]
