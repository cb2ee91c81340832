"""Run the flight recorder: `python -m vla_deploy.telemetry --run-dir D --robot butler`."""

import sys
import time

from vla_deploy.runtime.node import NodeContext
from vla_deploy.runtime.process_main import main
from vla_deploy.telemetry.folder import FlightFolder, folder_of
from vla_deploy.telemetry.node import RecorderNode
from vla_deploy.telemetry.recording.recorder import RollingRecorder


def build(context: NodeContext) -> RecorderNode:
    """Build the node."""
    return RecorderNode(
        context,
        FlightFolder(folder_of(context.run_dir.parent)),
        time.time_ns,
        rolling=lambda space: RollingRecorder(context, space, time.time_ns),
    )


if __name__ == "__main__":
    sys.exit(main("recorder", build))
