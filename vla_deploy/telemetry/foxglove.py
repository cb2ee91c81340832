"""Serve viewers live, over Foxglove's WebSocket protocol.

A viewer gets the channels of a recording; it cannot publish, call or set anything. The library
serves from threads of its own and drops the oldest messages of a slow viewer.
"""

import logging
from collections.abc import Callable, Iterable
from typing import Any, Final

from vla_deploy.ipc import SharedSpace
from vla_deploy.runtime.node import NodeContext
from vla_deploy.telemetry.errors import ExtraMissing
from vla_deploy.telemetry.recording.messages import DraftMessage, RunMessages
from vla_deploy.telemetry.recording.recording_file import ALL_CHANNELS
from vla_deploy.telemetry.recording.request import ChannelSelection
from vla_deploy.telemetry.recording.settings import FoxgloveSettings

_IMAGE_PERIOD_S: Final = 0.2
_CONSTANT_PERIOD_NS: Final = 5_000_000_000
_BACKLOG_MESSAGES: Final = 256
_log = logging.getLogger(__name__)


class FoxgloveNode:
    """Serve the channels of a run; only those that a viewer has subscribed to are drawn."""

    period_s = 0.05

    def __init__(
        self, context: NodeContext, settings: FoxgloveSettings, wall_ns: Callable[[], int]
    ) -> None:
        self.port = 0
        self._context = context
        self._settings = settings
        self._clock = context.clock
        self._wall_ns = wall_ns
        self._selection = ChannelSelection(
            topics=tuple(settings.topics), without=tuple(settings.without)
        )
        self._space = SharedSpace(context.run_dir / "ipc", context.clock)
        self._channels: dict[str, Any] = {}
        self._scope: Any = None
        self._server: Any = None
        self._constant_due_ns = 0

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
        self._messages = RunMessages(
            self._space,
            self._context,
            self._selection,
            image_period_s=_IMAGE_PERIOD_S,
            wanted=self._is_watched,
        )
        _log.info("viewers: ws://%s:%d", self._settings.host, self.port)

    def step(self) -> None:
        """Send what is new to the viewers."""
        now_ns = self._clock.now_ns()
        offset_ns = self._wall_ns() - now_ns
        self._log(self._messages.new(now_ns, offset_ns), offset_ns)
        if now_ns >= self._constant_due_ns:  # for viewers that have connected since
            self._constant_due_ns = now_ns + _CONSTANT_PERIOD_NS
            self._log(self._messages.constant_views(now_ns, offset_ns), offset_ns)

    def stop(self) -> None:
        """Disconnect the viewers and close the topics."""
        if self._server is not None:
            self._server.stop()
        self._space.close()

    def _log(self, messages: Iterable[DraftMessage], offset_ns: int) -> None:
        for message in messages:
            stamp_ns = message.stamp_ns + offset_ns
            self._channels[message.channel].log(message.text, log_time=stamp_ns)

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
