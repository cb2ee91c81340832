from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from fastapi import Depends, FastAPI, WebSocket, WebSocketDisconnect
from starlette.testclient import TestClient

from vla_deploy.client.access.accounts import AccountsFile, User, new_token
from vla_deploy.client.access.audit_log import AuditFile, AuditLog
from vla_deploy.client.access.passwords import Cost, hash_password
from vla_deploy.dashboard.access import (
    AccessControl,
    AccessRules,
    Anyone,
    Operator,
    UserRole,
    Viewer,
    guard,
    require,
)
from vla_deploy.dashboard.access.routes import router

HERE = "127.0.0.1"
ELSEWHERE = "192.168.1.7"
CHEAP = Cost(log2_rounds=10, block=1, parallel=1)
PASSWORD = "the robot wears blue socks"


def small_app(access: AccessControl) -> FastAPI:
    """One route for each role, the stop, and a WebSocket: all that the guard has to tell apart."""
    app = FastAPI()

    @app.get("/api/v1/state")
    async def state(who: Viewer) -> dict[str, str]:
        return {"user": who.user, "role": who.role, "way": who.way}

    @app.post("/api/v1/commands")
    async def commands(body: dict[str, Any], who: Operator) -> dict[str, Any]:
        return {"user": who.user, "body": body}

    @app.post("/api/v1/profile", dependencies=[Depends(require(UserRole.ADMIN))])
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

    @app.websocket("/api/v1/echo")
    async def echo(socket: WebSocket, who: Viewer) -> None:
        await socket.accept()
        with suppress(WebSocketDisconnect):
            while True:
                await socket.send_text(await socket.receive_text())

    app.include_router(router, prefix="/api/v1")
    guard(app, access)
    return app


@dataclass
class World:
    """A guarded application, its clocks and its accounts."""

    access: AccessControl
    app: FastAPI
    clock: Any
    wall: list[float]

    def client(self, address: str = HERE, host: str = "", **settings: Any) -> TestClient:
        """A client at an address; `host` is the name under which it reaches the robot."""
        name = host or (HERE if address == HERE else "192.168.1.4")
        scheme = "https" if self.access.rules.is_https else "http"
        url = f"{scheme}://{name}:8088"
        return TestClient(self.app, url, client=(address, 50_000), **settings)

    def add_user(self, name: str, role: UserRole, password: str = PASSWORD) -> None:
        user = User(role=role, password=hash_password(password, CHEAP), changed_s=self.wall[0])
        self.access.accounts.change(lambda held: (held.with_user(name, user), None))

    def add_token(self, name: str, role: UserRole, lasts_s: float | None = None) -> str:
        token_id, text, token = new_token(name, role, self.wall[0], lasts_s)
        self.access.accounts.change(lambda held: (held.with_token(token_id, token), None))
        return text

    def audit(self) -> list[dict[str, Any]]:
        return self.access.audit.newest(1000)


@pytest.fixture
def world(tmp_path: Path, hand_clock: Any) -> Callable[..., World]:
    def make(**rules: Any) -> World:
        wall = [1_800_000_000.0]
        accounts = AccountsFile(tmp_path / "access" / "accounts.json")
        file = AuditFile(tmp_path / "access" / "audit.jsonl")
        audit = AuditLog(file, hand_clock, now_s=lambda: wall[0])
        access = AccessControl(
            AccessRules(**rules), accounts, audit, hand_clock, now_s=lambda: wall[0], cost=CHEAP
        )
        return World(access, small_app(access), hand_clock, wall)

    return make
