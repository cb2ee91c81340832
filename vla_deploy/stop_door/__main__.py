"""Run the stop door: `python -m vla_deploy.stop_door --run-dir D --robot butler --profile P`."""

import sys

from vla_deploy.ipc import SharedSpace
from vla_deploy.runtime.net import read_settings
from vla_deploy.runtime.node import NodeContext
from vla_deploy.runtime.process_main import main
from vla_deploy.stop_door.node import StopDoorNode


def build(context: NodeContext) -> StopDoorNode:
    """Return the node for a run; robots on one computer, as twins are, share its ports."""
    return StopDoorNode(
        SharedSpace(context.run_dir / "ipc", context.clock),
        context.clock,
        lambda: read_settings(context.run_dir.parent),
        search=context.devices_dir is not None,
    )


if __name__ == "__main__":
    sys.exit(main("stop_door", build, adapts=False))
