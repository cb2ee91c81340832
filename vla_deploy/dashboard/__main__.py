"""Run the dashboard: `python -m vla_deploy.dashboard --run-dir D --robot butler --profile P`."""

import asyncio
import sys
from collections.abc import Callable

from drivers.clock import Clock
from vla_deploy.dashboard.node import DashboardNode
from vla_deploy.dashboard.serving import serve
from vla_deploy.runtime.net import NetError, read_settings
from vla_deploy.runtime.node import Node, NodeContext
from vla_deploy.runtime.process_main import main


class Dashboard:
    """Build the node, and step it in the event loop that answers requests."""

    def __init__(self) -> None:
        self._node: DashboardNode

    def build(self, context: NodeContext) -> DashboardNode:
        """Build the node by the process's arguments.

        Raises:
            DashboardSettingsInvalid: dashboard.toml has faults.
        """
        self._node = DashboardNode(context, read_settings(context.run_dir.parent))
        return self._node

    def run(self, node: Node, clock: Clock, should_stop: Callable[[], bool]) -> None:
        """Serve until `should_stop()`; `node` wraps the built one."""
        try:
            node.start()
            probe = self._node.probe
            serving = serve(
                self._node.app,
                self._node.sockets,
                node,
                clock,
                should_stop,
                probe=probe,
                press=self._node.press,
            )
            asyncio.run(serving)
        finally:
            node.stop()


if __name__ == "__main__":
    dashboard = Dashboard()
    sys.exit(main("dashboard", dashboard.build, run=dashboard.run, mendable=(NetError,)))
