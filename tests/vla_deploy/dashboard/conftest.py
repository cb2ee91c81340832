import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
from fastapi import FastAPI
from starlette.testclient import TestClient

from drivers.clock import NS_PER_S, MonotonicClock
from sim_twin.contracts.scripted import ManualClock
from vla_deploy.client.access.accounts import AccountsFile
from vla_deploy.client.access.audit_log import AuditFile, AuditLog
from vla_deploy.client.link import RobotLink
from vla_deploy.dashboard.access import AccessControl, AccessRules
from vla_deploy.dashboard.app import create_app
from vla_deploy.dashboard.live.message import LiveMessage
from vla_deploy.ipc import RingReader, SharedSpace
from vla_deploy.runtime.net import DashboardSettings


def payload_of(message: LiveMessage) -> bytes:
    """Return what a client receives by a message's frame."""
    length = message.frame[1]
    return message.frame[{126: 4, 127: 10}.get(length, 2) :]


class HandClock(ManualClock):
    """Time passes when a test says so."""

    def pass_s(self, seconds: float) -> None:
        self.ns += round(seconds * NS_PER_S)

    def wall_ns(self) -> int:
        return self.ns + 1_800_000_000 * NS_PER_S


@dataclass
class RobotProcesses:
    """Play the processes at the other end of shared memory."""

    space: SharedSpace
    _readers: dict[str, RingReader] = field(default_factory=dict)

    def hears(self, topic: str) -> list[dict[str, Any]]:
        """Return what came on a ring since the last call."""
        if topic not in self._readers:
            self._readers[topic] = self.space.ring_reader(topic, from_start=True)
        return [event.payload for event in self._readers[topic].drain()]

    def tells(self, command_id: str, event: str, **details: Any) -> None:
        ring = self.space.ring_writer("task_event")
        ring.publish({"command_id": command_id, "event": event} | details)

    def shows(self, topic: str, **document: Any) -> None:
        self.space.cell_writer(topic).put_document(document)

    def control_is(self, state: str, **changes: Any) -> None:
        status = {"state": state, "estop_latched": False, "cause": "", "detail": ""}
        self.shows("control_status", **(status | changes))


@dataclass
class Dashboard:
    """An application over the shared memory of a run, asked from loopback."""

    app: FastAPI
    client: TestClient
    robot: RobotProcesses
    link: RobotLink
    base: Path

    def get(self, path: str, status: int = 200, **parameters: Any) -> Any:
        answer = self.client.get(f"/api/v1/{path}", params=parameters)
        assert answer.status_code == status, answer.text
        return answer.json()

    def post(self, path: str, status: int = 202, body: Any = None) -> Any:
        answer = self.client.post(f"/api/v1/{path}", json=body)
        assert answer.status_code == status, answer.text
        return answer.json()


@pytest.fixture
def hand_clock() -> HandClock:
    return HandClock(1000 * NS_PER_S)


@pytest.fixture
def dashboard(tmp_path: Path) -> Iterator[Dashboard]:
    base = tmp_path / "base"
    run_dir = base / "20260101-000000-1"
    (run_dir / "logs").mkdir(parents=True)
    clock = MonotonicClock()
    accounts = AccountsFile(tmp_path / "access" / "accounts.json")
    audit = AuditLog(AuditFile(tmp_path / "access" / "audit.jsonl"), clock, now_s=time.monotonic)
    access = AccessControl(
        AccessRules(trust_loopback=True), accounts, audit, clock, now_s=time.monotonic
    )
    link = RobotLink(run_dir, clock)
    app = create_app(link, DashboardSettings(), access)
    client = TestClient(app, "http://127.0.0.1:8088", client=("127.0.0.1", 50_000))
    robot = RobotProcesses(SharedSpace(run_dir / "ipc", clock))
    yield Dashboard(app, client, robot, link, base)
    for part in app.state.parts:
        part.stop()
    robot.space.close()
    link.close()


@pytest.fixture
def stranger(dashboard: Dashboard) -> TestClient:
    return TestClient(dashboard.app, "http://127.0.0.1:8088", client=("192.0.2.7", 50_000))
