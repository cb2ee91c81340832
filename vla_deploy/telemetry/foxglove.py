"""Serve viewers live, over Foxglove's WebSocket protocol.

Whoever connects sees the channels of a recording; nobody can publish, call or set anything. The
library serves from threads of its own and drops the oldest for a client that is slow.
"""

import logging
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from vla_deploy.ipc import SharedSpace
from vla_deploy.runtime.logs import LOGS_DIR
from vla_deploy.runtime.node import NodeContext
from vla_deploy.telemetry.errors import ExtraMissing
from vla_deploy.telemetry.following import Following
from vla_deploy.telemetry.recording.batch import Drafter
from vla_deploy.telemetry.recording.collecting import Collector
from vla_deploy.telemetry.recording.recording_file import ALL_CHANNELS
from vla_deploy.telemetry.recording.selection import Selection
from vla_deploy.telemetry.recording.settings import FoxgloveSettings

_IMAGE_PERIOD_S: Final = 0.2
_STILL_EVERY_NS: Final = 5_000_000_000
_BACKLOG_MESSAGES: Final = 256
_log = logging.getLogger(__name__)


class FoxgloveNode:
    """Log to each channel that somebody has subscribed to; the others are not even drawn."""

    period_s = 0.05

    def __init__(
        self, context: NodeContext, settings: FoxgloveSettings, wall_ns: Callable[[], int]
    ) -> None:
        self.port = 0
        self._context = context
        self._settings = settings
        self._clock = context.clock
        self._wall_ns = wall_ns
        self._selection = Selection(topics=tuple(settings.topics), without=tuple(settings.without))
        self._space = SharedSpace(context.run_dir / "ipc", context.clock)
        self._channels: dict[str, Any] = {}
        self._scope: Any = None
        self._server: Any = None
        self._still_due_ns = 0

    def start(self) -> None:
        """Open the topics and listen.

        Raises:
            ExtraMissing: foxglove-sdk is not installed, or the address cannot be listened at.
        """
        foxglove = _library()
        self._scope = scope = foxglove.Context()  # channels live as long as it does
        for channel in ALL_CHANNELS:
            if self._selection.takes(channel.topic):
                schema = foxglove.Schema(
                    name=channel.schema_name, encoding="jsonschema", data=channel.schema_text
                )
                self._channels[channel.topic] = foxglove.Channel(
                    channel.topic, message_encoding="json", schema=schema, context=scope
                )
        try:
            self._server = foxglove.start_server(
                name=f"vla-deploy {self._context.robot}",
                host=self._settings.host,
                port=self._settings.port,
                capabilities=[],
                context=scope,
                message_backlog_size=_BACKLOG_MESSAGES,
            )
        except (OSError, RuntimeError) as error:
            where = f"{self._settings.host}:{self._settings.port}"
            raise ExtraMissing(
                f"foxglove: cannot listen at {where}: {error}; choose another port in "
                "recording.toml, [foxglove]"
            ) from error
        self.port = self._server.port
        self._following = Following(self._space, from_start=False)
        logs: Path = self._context.run_dir / LOGS_DIR
        self._collector = Collector(self._space, logs, self._selection, _IMAGE_PERIOD_S)
        self._drafter = Drafter(self._context.robot, self._is_watched)
        _log.info("viewers: ws://%s:%d", self._settings.host, self.port)

    def step(self) -> None:
        """Hand on what is new to whoever watches."""
        now_ns = self._clock.now_ns()
        offset_ns = self._wall_ns() - now_ns
        batch = self._collector.batch(now_ns, self._following.fresh())
        for message in self._drafter.messages(batch, offset_ns):
            stamp_ns = message.stamp_ns + offset_ns
            self._channels[message.channel].log(message.text, log_time=stamp_ns)
        if now_ns >= self._still_due_ns:  # for whoever has come since
            self._still_due_ns = now_ns + _STILL_EVERY_NS
            for message in self._drafter.still(now_ns, offset_ns):
                self._channels[message.channel].log(message.text, log_time=now_ns + offset_ns)

    def stop(self) -> None:
        """Let the viewers go."""
        if self._server is not None:
            self._server.stop()
        self._space.close()

    def _is_watched(self, channel: str) -> bool:
        known = self._channels.get(channel)
        return known is not None and bool(known.has_sinks())


def _library() -> Any:
    try:
        import foxglove
    except ImportError as error:
        raise ExtraMissing(
            "viewers need foxglove-sdk, which is not installed: pip install 'vla-deploy[foxglove]'"
        ) from error
    return foxglove
