"""Declare what can go wrong with the ROS 2 gateway.

RosGatewayError
├── RosIncomplete        the environment of ROS 2 lacks a part: install it, or name another one
└── ParametersUnusable   the node's parameter file cannot be used: mend it, or leave it out
"""


class RosGatewayError(Exception):
    """Report what keeps the robot out of the ROS graph; a person has to mend it."""


class RosIncomplete(RosGatewayError):
    """Report what the interpreter of ROS 2 cannot import."""


class ParametersUnusable(RosGatewayError):
    """Report which file of parameters cannot be used, and why."""
