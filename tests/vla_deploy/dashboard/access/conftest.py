from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from fastapi import Depends, FastAPI, WebSocket
from starlette.testclient import TestClient

from vla_deploy.dashboard.access import (
    Access,
    AccessRules,
    Anyone,
    Operator,
    Role,
    Viewer,
    guard,
    require,
)
from vla_deploy.dashboard.access.accounts_file import AccountsFile

HERE = "127.0.0.1"
ELSEWHERE = "192.168.1.7"


class StepClock:
    """Time passes when a test says so."""

    def __init__(self) -> None:
        self.now = 1_000_000_000_000

    def now_ns(self) -> int:
        return self.now

    def sleep_until(self, deadline_ns: int) -> None:
        self.now = max(self.now, deadline_ns)

    def pass_s(self, seconds: float) -> None:
        self.now += round(seconds * 1e9)


def small_app(access: Access) -> FastAPI:
    """One route for each role, the stop, and a WebSocket: all that the guard has to tell apart."""
    app = FastAPI()

    @app.get("/api/v1/state")
    async def state(who: Viewer) -> dict[str, str]:
        return {"user": who.user, "role": who.role, "way": who.way}

    @app.post("/api/v1/commands")
    async def commands(body: dict[str, Any], who: Operator) -> dict[str, Any]:
        return {"user": who.user, "body": body}

    @app.post("/api/v1/profile", dependencies=[Depends(require(Role.ADMIN))])
    async def profile() -> dict[str, bool]:
        return {"done": True}

    @app.post("/api/v1/stop")
    async def stop(body: dict[str, str], who: Anyone) -> dict[str, str]:
        return {"pressed_by": who.user, "reason": body["reason"]}

    @app.websocket("/api/v1/live")
    async def live(socket: WebSocket, who: Viewer) -> None:
        await socket.accept()
        await socket.send_json({"user": who.user})
        await socket.close()

    guard(app, access)
    return app


@dataclass
class World:
    """A guarded application, its clocks and its accounts."""

    access: Access
    app: FastAPI
    clock: StepClock
    wall: list[float]

    def client(self, address: str = HERE, host: str = "", **settings: Any) -> TestClient:
        """A client at an address; `host` is the name under which it reaches the robot."""
        name = host or (HERE if address == HERE else "192.168.1.4")
        scheme = "https" if self.access.rules.is_https else "http"
        url = f"{scheme}://{name}:8088"
        return TestClient(self.app, url, client=(address, 50_000), **settings)


@pytest.fixture
def world(tmp_path: Path) -> Iterator[Callable[..., World]]:
    def make(**rules: Any) -> World:
        clock, wall = StepClock(), [1_800_000_000.0]
        accounts = AccountsFile(tmp_path / "access" / "accounts.json")
        access = Access(AccessRules(**rules), accounts, clock, now_s=lambda: wall[0])
        return World(access, small_app(access), clock, wall)

    return make
