"""Follow a run in Rerun: a process of its own, which only reads shared memory."""

from collections.abc import Callable
from pathlib import Path
from typing import Final

from drivers.clock import NS_PER_S
from vla_deploy.ipc import SharedSpace
from vla_deploy.runtime.logs import LOGS_DIR
from vla_deploy.runtime.node import NodeContext
from vla_deploy.telemetry.following import Following
from vla_deploy.telemetry.recording.batch import Drafter
from vla_deploy.telemetry.recording.collecting import Collector
from vla_deploy.telemetry.recording.selection import Selection
from vla_deploy.telemetry.rerun.showing import Showing
from vla_deploy.telemetry.rerun.table import is_drawn

_IMAGE_PERIOD_S: Final = 0.2
_STILL_EVERY_NS: Final = 5 * NS_PER_S


class RerunNode:
    """Show what is new of a run, a robot's or a replay's; what becomes nothing is not drafted."""

    period_s = 0.05

    def __init__(
        self,
        context: NodeContext,
        selection: Selection,
        showing: Showing,
        wall_ns: Callable[[], int],
    ) -> None:
        self._context = context
        self._clock = context.clock
        self._selection = selection
        self._showing = showing
        self._wall_ns = wall_ns
        self._space = SharedSpace(context.run_dir / "ipc", context.clock)
        self._still_due_ns = 0

    def start(self) -> None:
        """Open the topics."""
        logs: Path = self._context.run_dir / LOGS_DIR
        self._following = Following(self._space, from_start=False)
        self._collector = Collector(self._space, logs, self._selection, _IMAGE_PERIOD_S)
        self._drafter = Drafter(self._context.robot, self._wanted)

    def step(self) -> None:
        """Show what is new.

        Raises:
            ExtraMissing: the viewer was closed, or the file cannot be written any more.
        """
        now_ns = self._clock.now_ns()
        offset_ns = self._wall_ns() - now_ns
        batch = self._collector.batch(now_ns, self._following.fresh())
        for message in self._drafter.messages(batch, offset_ns):
            self._showing.add(message.channel, message.stamp_ns + offset_ns, message.text)
        if now_ns >= self._still_due_ns:  # the robot's lens may have been calibrated
            self._still_due_ns = now_ns + _STILL_EVERY_NS
            for message in self._drafter.still(now_ns, offset_ns):
                self._showing.add(message.channel, message.stamp_ns + offset_ns, message.text)
            self._showing.flush()

    def stop(self) -> None:
        """Let the topics go."""
        self._space.close()

    def _wanted(self, channel: str) -> bool:
        return is_drawn(channel) and self._selection.takes(channel)
