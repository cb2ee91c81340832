"""Follow a run in Rerun, in a process of its own that only reads shared memory."""

from collections.abc import Callable, Iterable
from typing import Final

from drivers.clock import NS_PER_S
from vla_deploy.ipc import SharedSpace
from vla_deploy.runtime.node import NodeContext
from vla_deploy.telemetry.recording.messages import DraftMessage, RunMessages
from vla_deploy.telemetry.recording.request import ChannelSelection
from vla_deploy.telemetry.rerun.entity_logger import EntityLogger
from vla_deploy.telemetry.rerun.table import is_drawn

_IMAGE_PERIOD_S: Final = 0.2
_CONSTANT_PERIOD_NS: Final = 5 * NS_PER_S


class RerunNode:
    """Log what is new in a run, a robot's or a replay's; only channels that are drawn."""

    period_s = 0.05

    def __init__(
        self,
        context: NodeContext,
        selection: ChannelSelection,
        logger: EntityLogger,
        wall_ns: Callable[[], int],
    ) -> None:
        self._context = context
        self._clock = context.clock
        self._selection = selection
        self._logger = logger
        self._wall_ns = wall_ns
        self._space = SharedSpace(context.run_dir / "ipc", context.clock)
        self._constant_due_ns = 0

    def start(self) -> None:
        """Open the topics."""
        self._messages = RunMessages(
            self._space,
            self._context,
            self._selection,
            image_period_s=_IMAGE_PERIOD_S,
            wanted=self._is_wanted,
        )

    def step(self) -> None:
        """Log what is new.

        Raises:
            ExtraMissing: the viewer was closed, or the file cannot be written.
        """
        now_ns = self._clock.now_ns()
        offset_ns = self._wall_ns() - now_ns
        self._log(self._messages.new(now_ns, offset_ns), offset_ns)
        if now_ns >= self._constant_due_ns:  # the robot's lens may have been calibrated
            self._constant_due_ns = now_ns + _CONSTANT_PERIOD_NS
            self._log(self._messages.constant_views(now_ns, offset_ns), offset_ns)
            self._logger.flush()

    def stop(self) -> None:
        """Close the topics."""
        self._space.close()

    def _log(self, messages: Iterable[DraftMessage], offset_ns: int) -> None:
        for message in messages:
            self._logger.add(message.channel, message.stamp_ns + offset_ns, message.text)

    def _is_wanted(self, channel: str) -> bool:
        return is_drawn(channel) and self._selection.takes(channel)
