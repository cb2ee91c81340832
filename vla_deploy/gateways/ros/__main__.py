"""Run the ROS 2 gateway: `python -m vla_deploy.gateways.ros --run-dir D --robot R --profile P`.

The interpreter is that of ROS's environment; the supervisor finds it.
"""

import sys

from vla_deploy.gateways.ros.errors import RosGatewayError, RosIncomplete
from vla_deploy.runtime.node import Node, NodeContext
from vla_deploy.runtime.process_main import main


def build(context: NodeContext) -> Node:
    """Build the gateway.

    Raises:
        RosIncomplete: this interpreter has no ROS 2, or lacks a package of messages.
        ParametersUnusable: the file of parameters that was handed over has faults.
    """
    try:
        from vla_deploy.gateways.ros.node import RosGatewayNode
    except ImportError as error:
        raise RosIncomplete(
            f"{sys.executable} cannot import what the ROS gateway needs: {error}; "
            "see what is missing: vla-deploy doctor"
        ) from error
    return RosGatewayNode(context)


if __name__ == "__main__":
    sys.exit(main("ros", build, mendable=(RosGatewayError,)))
