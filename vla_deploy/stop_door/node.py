"""Keep the stop door open, retry where it cannot be opened, and publish its status."""

import logging
from collections.abc import Callable
from typing import Final

from drivers.clock import NS_PER_S, Clock
from vla_deploy.ipc import SharedSpace, topics
from vla_deploy.runtime.net import DashboardSettings, DashboardSettingsInvalid, NetError
from vla_deploy.stop_door.handler import StopHandler
from vla_deploy.stop_door.server import StopServer, open_listener

DEFAULTS: Final = DashboardSettings()
_WAIT_S: Final = 0.2
_OPEN_PERIOD_S: Final = 0.001  # bounds what a flood of clients costs
_CLOSED_PERIOD_S: Final = 0.2
_PUBLISH_NS: Final = NS_PER_S // 2
_RETRY_NS: Final = NS_PER_S
_WHY_LETTERS: Final = 400
_log = logging.getLogger(__name__)


class StopDoorNode:
    """Serve the stop door; with `search` it takes the next free port where its own is taken.

    A step of an open door waits for clients, as other nodes wait for a bus.
    """

    def __init__(
        self,
        space: SharedSpace,
        clock: Clock,
        settings: Callable[[], DashboardSettings],
        *,
        search: bool = False,
    ) -> None:
        """Open the topics in shared memory.

        Raises:
            SpaceUnavailable: shared memory cannot be opened.
        """
        self._clock = clock
        self._read_settings = settings
        self._settings = DEFAULTS
        self._search = search
        self._handler = StopHandler(space, clock)
        self._status = space.cell_writer(topics.STOP_DOOR_STATUS)
        self._port = _port_before(space)
        self._server: StopServer | None = None
        self._why = self._settings_fault = ""
        self._retry_ns = self._publish_ns = 0

    @property
    def period_s(self) -> float:
        """Return the shortest time between two steps."""
        return _CLOSED_PERIOD_S if self._server is None else _OPEN_PERIOD_S

    def start(self) -> None:
        """Open the door, or start to retry."""
        self.step()

    def step(self) -> None:
        """Serve for a moment; retry a closed door once a second; publish twice a second."""
        if self._server is not None:
            self._server.serve(_WAIT_S)
        elif self._clock.now_ns() >= self._retry_ns:
            self._open()
        if self._clock.now_ns() >= self._publish_ns:
            self._publish()

    def stop(self) -> None:
        """Close the door."""
        if self._server is not None:
            self._server.close()
            self._server = None

    def _open(self) -> None:
        self._retry_ns = self._clock.now_ns() + _RETRY_NS
        self._reload_settings()
        try:
            listener = open_listener(self._settings, search=self._search, before=self._port)
        except NetError as error:
            if str(error) != self._why:
                self._why = str(error)
                _log.error("the stop door is closed: %s", error)
            return
        self._port, self._why = listener.port, ""
        self._server = StopServer(listener, self._handler.responder, self._clock)
        _log.info("the stop door is open at %s port %d", self._settings.host, listener.port)

    def _reload_settings(self) -> None:
        """Read the settings; with an invalid file the door opens on loopback."""
        try:
            self._settings, self._settings_fault = self._read_settings(), ""
        except DashboardSettingsInvalid as error:
            self._settings, self._settings_fault = DEFAULTS, str(error)
            _log.error("%s", error)

    def _publish(self) -> None:
        self._publish_ns = self._clock.now_ns() + _PUBLISH_NS
        server = self._server
        self._status.put_document(
            {
                "open": server is not None,
                "why": (self._why or self._settings_fault)[:_WHY_LETTERS],
                "host": self._settings.host,
                "port": (server and self._port) or self._settings.stop_port,
                "scheme": self._settings.scheme,
                "pressed": self._handler.pressed,
                "joined": self._handler.joined,
                "failed": self._handler.failed,
                "refused": self._handler.refused,
                "connections": 0 if server is None else server.connections,
                "accepted": 0 if server is None else server.accepted,
                "expired": 0 if server is None else server.expired,
                "lost": 0 if server is None else server.lost,
                "crowded_out": 0 if server is None else server.crowded_out,
            }
        )


def _port_before(space: SharedSpace) -> int | None:
    """Return the port of an earlier instance of this run, at which open pages look for it."""
    sample = space.cell_reader(topics.STOP_DOOR_STATUS).latest()
    return None if sample is None else sample.document().get("port")
