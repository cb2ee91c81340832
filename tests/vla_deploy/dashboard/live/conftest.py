import asyncio
import contextlib
import socket
from collections.abc import AsyncIterator, Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
import uvicorn
from fastapi import FastAPI

from drivers.clock import NS_PER_S
from sim_twin.contracts.scripted import ManualClock
from vla_deploy.dashboard.access import UserRole, require
from vla_deploy.dashboard.live import endpoint
from vla_deploy.dashboard.live.endpoint import LiveProtocol
from vla_deploy.dashboard.live.hub import LiveHub
from vla_deploy.dashboard.live.message import LiveMessage, LookTime, json_message
from vla_deploy.ipc import SharedSpace

WALL_NS = 1_800_000_000 * NS_PER_S


class Script:
    """Be a feed that tells what the test puts into it, and counts the looks."""

    def __init__(self, topic: str, *, queued: bool = False, period_s: float = 0.1) -> None:
        self.topic = topic
        self.period_s = period_s
        self.waiting: list[Any] = []
        self.looks = 0
        self._queued = queued

    def begin(self) -> None:
        if self._queued:
            self.waiting.clear()

    def look(self, now: LookTime) -> Sequence[LiveMessage]:
        self.looks += 1
        waiting, self.waiting = self.waiting, []
        return [
            json_message(self.topic, now.run_ns, now, data, queued=self._queued) for data in waiting
        ]


@dataclass(frozen=True)
class Served:
    """Say where a hub is served, and which connections the server has."""

    port: int
    connections: set[Any]

    @property
    def url(self) -> str:
        return f"ws://127.0.0.1:{self.port}/live"


async def until(holds: Callable[[], object]) -> None:
    """Let the event loop run until something holds."""
    for _ in range(2000):
        if holds():
            return
        await asyncio.sleep(0.005)
    raise AssertionError("it never came true")


@pytest.fixture
def clock() -> ManualClock:
    return ManualClock()


@pytest.fixture
def space(tmp_path: Path, clock: ManualClock) -> SharedSpace:
    return SharedSpace(tmp_path / "run" / "ipc", clock)


@pytest.fixture
def script() -> type[Script]:
    return Script


@pytest.fixture
def make_hub(clock: ManualClock) -> Callable[..., LiveHub]:
    """Return a hub whose wall clock goes with the run's."""
    return lambda *feeds: LiveHub(feeds, clock, lambda: WALL_NS + clock.ns)


@pytest.fixture(name="until")
def _until() -> Any:
    return until


@pytest.fixture
def serve() -> Any:
    """Serve a hub at a port of this computer, as the process does."""

    @contextlib.asynccontextmanager
    async def serving(hub: LiveHub, prepare: Any = None) -> AsyncIterator[Served]:
        app = FastAPI()
        app.state.live = hub
        app.include_router(endpoint.router)
        app.dependency_overrides[require(UserRole.VIEWER)] = lambda: None
        if prepare is not None:
            prepare(app)
        config = uvicorn.Config(
            app, log_config=None, lifespan="off", ws=LiveProtocol, ws_per_message_deflate=False
        )
        server = uvicorn.Server(config)
        with socket.create_server(("127.0.0.1", 0)) as listener:
            task = asyncio.create_task(server.serve([listener]))
            await until(lambda: server.started)
            yield Served(listener.getsockname()[1], server.server_state.connections)
            server.should_exit = True
            hub.stop()
            await task

    return serving
