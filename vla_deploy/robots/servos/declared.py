"""Declare the servos of a robot file to the drivers of their family."""

from drivers.servo.family import ServoFamily, family_of
from drivers.servo.joint_servo import JointServo, WheelLimits
from vla_deploy.robots.description import RobotDescription
from vla_deploy.robots.devices import shadow_name


def bus_family(robot: RobotDescription) -> ServoFamily:
    """Return the family of a robot's servos, which is one for a bus.

    Raises:
        UnknownModel: no family has the model.
    """
    return family_of(robot.servo_bus.servos[0].model)


def servo_specs(robot: RobotDescription) -> list[JointServo]:
    """Return what the bus driver must know of each servo: of joints, shadows, then of wheels.

    Servos that are only read have no goals, so their own position limits do not matter.
    """
    family, bus = bus_family(robot), robot.servo_bus
    rows = [(one, one.joint) for one in bus.servos]
    rows += [(one, shadow_name(one.joint)) for one in bus.shadows]
    joints = [
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
    turning = [
        family.servo(
            servo_id=servo.id,
            model_name=servo.model,
            joint=servo.joint,
            sign=servo.sign,
            offset_rad=servo.offset,
            travel_per_rad=servo.travel_per_rad,
            wheel=wheel_limits(robot, servo.model),
        )
        for servo in bus.wheels
    ]
    return [*joints, *turning]


def wheel_limits(robot: RobotDescription, model: str) -> WheelLimits:
    """Return how fast a wheel's servo may turn, and what the base asks of it where it must stop."""
    base, sheet = robot.base, robot.servo_models[model]
    braking_m_s2 = base.stop_deceleration_m_s2 or base.max_acceleration_m_s2
    rim_m_s2 = braking_m_s2 + base.lever_m * base.max_turn_acceleration_rad_s2
    return WheelLimits(
        speed_rad_s=base.max_wheel_rad_s or sheet.no_load_speed_rad_s,
        acceleration_rad_s2=rim_m_s2 / base.wheel_radius_m,
    )
