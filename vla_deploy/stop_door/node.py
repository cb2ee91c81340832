"""Keep the stop door open: try again where it cannot be, and tell how it stands."""

import logging
from collections.abc import Callable
from typing import Final

from drivers.clock import NS_PER_S, Clock
from vla_deploy.ipc import SharedSpace, StopButton
from vla_deploy.runtime.net import DashboardSettings, DashboardSettingsInvalid
from vla_deploy.stop_door.answering import Answering
from vla_deploy.stop_door.control_word import ControlWords
from vla_deploy.stop_door.door import Door
from vla_deploy.stop_door.errors import DoorClosed
from vla_deploy.stop_door.listener import open_listener
from vla_deploy.stop_door.pressing import SOURCE, Pressing

STATUS_TOPIC: Final = "stop_door_status"
DEFAULTS: Final = DashboardSettings()
_WAIT_S: Final = 0.2
_OPEN_PERIOD_S: Final = 0.001  # bounds what a flood of clients costs
_CLOSED_PERIOD_S: Final = 0.2
_TELL_NS: Final = NS_PER_S // 2
_RETRY_NS: Final = NS_PER_S
_WHY_LETTERS: Final = 400
_log = logging.getLogger(__name__)


class StopDoorNode:
    """Serve whoever wants to stop the robot; `search` takes the next free port where one is taken.

    A step of an open door waits for clients: they are this node's bus.
    """

    def __init__(
        self,
        space: SharedSpace,
        clock: Clock,
        settings: Callable[[], DashboardSettings],
        *,
        search: bool = False,
    ) -> None:
        """Open what it needs of shared memory.

        Raises:
            SpaceUnavailable: shared memory cannot be had.
        """
        self._clock = clock
        self._read_settings = settings
        self._settings = DEFAULTS
        self._search = search
        self._pressing = Pressing(StopButton(space, SOURCE, clock))
        self._answering = Answering(self._pressing, ControlWords(space, clock))
        self._status = space.cell_writer(STATUS_TOPIC)
        self._port = _port_before(space)
        self._door: Door | None = None
        self._why = self._unsettled = ""
        self._retry_ns = self._tell_ns = 0

    @property
    def period_s(self) -> float:
        """Return the shortest time between two steps."""
        return _CLOSED_PERIOD_S if self._door is None else _OPEN_PERIOD_S

    def start(self) -> None:
        """Open the door, or begin to try."""
        self.step()

    def step(self) -> None:
        """Serve for a moment; open a closed door once a second; tell twice a second."""
        if self._door is not None:
            self._door.serve(_WAIT_S)
        elif self._clock.now_ns() >= self._retry_ns:
            self._open()
        if self._clock.now_ns() >= self._tell_ns:
            self._tell()

    def stop(self) -> None:
        """Close the door."""
        if self._door is not None:
            self._door.close()
            self._door = None

    def _open(self) -> None:
        self._retry_ns = self._clock.now_ns() + _RETRY_NS
        self._take_settings()
        try:
            listener = open_listener(self._settings, search=self._search, before=self._port)
        except DoorClosed as error:
            if str(error) != self._why:
                self._why = str(error)
                _log.error("the stop door is closed: %s", error)
            return
        self._port, self._why = listener.port, ""
        self._door = Door(listener, self._answering.to, self._clock)
        _log.info("the stop door is open at %s port %d", self._settings.host, listener.port)

    def _take_settings(self) -> None:
        """Read the settings; with a spoilt file the door opens on loopback all the same."""
        try:
            self._settings, self._unsettled = self._read_settings(), ""
        except DashboardSettingsInvalid as error:
            self._settings, self._unsettled = DEFAULTS, str(error)
            _log.error("%s", error)

    def _tell(self) -> None:
        self._tell_ns = self._clock.now_ns() + _TELL_NS
        door = self._door
        self._status.put_document(
            {
                "open": door is not None,
                "why": (self._why or self._unsettled)[:_WHY_LETTERS],
                "host": self._settings.host,
                "port": self._settings.stop_port if door is None else self._port,
                "scheme": self._settings.scheme,
                "pressed": self._pressing.pressed,
                "joined": self._pressing.joined,
                "failed": self._pressing.failed,
                "refused": self._answering.refused,
                **_traffic(door),
            }
        )


def _traffic(door: Door | None) -> dict[str, int]:
    names = ("connections", "accepted", "expired", "lost", "crowded_out")
    return {name: 0 if door is None else getattr(door, name) for name in names}


def _port_before(space: SharedSpace) -> int | None:
    """Return the port of an earlier instance of this run, at which open pages look for the door."""
    told = space.cell_reader(STATUS_TOPIC).latest()
    return None if told is None else told.document().get("port")
