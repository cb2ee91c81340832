"""Declare what keeps agents from the robot.

AgentGatewayError
├── McpMissing      install the extra: the protocol's SDK is not there
├── NotLoopback     serve on this computer alone
├── NoRobot         start the robot: none runs here
└── CallRefused     a rule refuses a call; carries its name
"""


class AgentGatewayError(Exception):
    """Report what keeps agents from the robot."""


class McpMissing(AgentGatewayError):
    """Say how the SDK of the protocol is installed."""

    def __init__(self) -> None:
        super().__init__("serving agents needs the MCP SDK: pip install 'vla-deploy[mcp]'")


class NotLoopback(AgentGatewayError):
    """Say that agents are served on this computer alone."""


class NoRobot(AgentGatewayError):
    """Say that no robot runs, or that a part of it is silent."""


class CallRefused(AgentGatewayError):
    """Say which rule refuses a call, and why."""

    def __init__(self, rule: str, why: str) -> None:
        self.rule = rule
        super().__init__(why)
