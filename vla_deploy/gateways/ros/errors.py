"""Declare what can go wrong with the ROS 2 gateway.

RosGatewayError
├── RosNotFound          no environment of ROS 2, or one that lacks a part: install it, or name it
└── ParametersUnusable   the node's parameter file cannot be used: mend it, or leave it out
"""


class RosGatewayError(Exception):
    """Report what keeps the robot out of the ROS graph; a person has to mend it."""


class RosNotFound(RosGatewayError):
    """Report that no environment of ROS 2 was found, or one that lacks a part."""


class ParametersUnusable(RosGatewayError):
    """Report which file of parameters cannot be used, and why."""
