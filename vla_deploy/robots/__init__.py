"""Describe robots: `load_robot` turns a folder into one immutable value."""

from vla_deploy.robots.description import RobotDescription
from vla_deploy.robots.errors import RobotFileError
from vla_deploy.robots.loader import load_robot, robot_names

__all__ = ["RobotDescription", "RobotFileError", "load_robot", "robot_names"]
