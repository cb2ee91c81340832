"""Open a real stop door on a port of its own, on a clock that tests step."""

import socket
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from drivers.clock import NS_PER_S
from sim_twin.contracts.scripted import ManualClock
from vla_deploy.ipc import SharedSpace
from vla_deploy.runtime.net import DashboardSettings
from vla_deploy.stop_door.node import StopDoorNode

MOST_STEPS = 40


class StepClock(ManualClock):
    """Stand still until a test moves it on."""

    def advance(self, duration_s: float) -> None:
        self.ns += round(duration_s * NS_PER_S)


class Doorway:
    """Hold a stop door beside the shared memory that it presses into."""

    def __init__(self, folder: Path, settings: DashboardSettings | None = None) -> None:
        self.clock = StepClock(NS_PER_S)
        self.space = SharedSpace(folder / "ipc", self.clock)
        self.settings: Callable[[], DashboardSettings] = lambda: (
            settings or DashboardSettings(stop_port=0)
        )
        self.node = StopDoorNode(self.space, self.clock, lambda: self.settings())
        self._operator = self.space.ring_reader("operator", from_start=True)
        self._control = self.space.cell_writer("control_status")

    def call(self) -> socket.socket:
        """Connect as a client that waits for nothing."""
        client = socket.create_connection(("127.0.0.1", self.told()["port"]))
        client.setblocking(False)
        return client

    def answer(self, client: socket.socket) -> bytes:
        """Serve until the door has closed its side, and return what the client got."""
        received = bytearray()
        for _ in range(MOST_STEPS):
            self.node.step()
            try:
                while data := client.recv(65536):
                    received += data
                return bytes(received)
            except BlockingIOError:
                continue
            except ConnectionResetError:
                return bytes(received)
        raise AssertionError(f"no end of the answer after {MOST_STEPS} steps: {received!r}")

    def ask(self, request: bytes) -> bytes:
        """Send a request and return the answer."""
        with closing(self.call()) as client:
            client.sendall(request)
            return self.answer(client)

    def pressed(self) -> list[dict[str, Any]]:
        """Return the operator's acts since the last call."""
        return [event.payload for event in self._operator.drain()]

    def control_says(self, state: str, *, latched: bool) -> None:
        """Let control tell its state."""
        self._control.put_document({"state": state, "estop_latched": latched})

    def told(self) -> dict[str, Any]:
        """Return the door's status."""
        sample = self.space.cell_reader("stop_door_status").latest()
        assert sample is not None
        return sample.document()

    def tell(self) -> dict[str, Any]:
        """Return the door's status of now."""
        self.clock.advance(0.5)
        self.node.step()
        return self.told()

    def close(self) -> None:
        """Close the door and its shared memory."""
        self.node.stop()
        self.space.close()


@pytest.fixture
def doorway(tmp_path: Path) -> Iterator[Doorway]:
    with closing(Doorway(tmp_path)) as doorway:
        doorway.node.start()
        yield doorway
