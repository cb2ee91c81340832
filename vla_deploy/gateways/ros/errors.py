"""Declare what can go wrong with the ROS 2 gateway."""


class RosGatewayError(Exception):
    """Report what keeps the robot out of the ROS graph; a person has to mend it."""


class RosNotFound(RosGatewayError):
    """Report that no environment of ROS 2 was found, or one that lacks a part."""
