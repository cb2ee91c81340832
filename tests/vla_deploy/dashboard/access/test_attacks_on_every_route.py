"""Attack the whole application from its own description: routes that are added are attacked, too.

The application, its shared memory and its accounts are the real ones; whoever asks comes from
another computer. After each attack the rings are read: nothing may have reached the robot that
the attacker's role does not allow.
"""

import asyncio
import json
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import quote

import httpx
import pytest
import schemathesis
from fastapi import FastAPI
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from schemathesis import GenerationMode
from starlette.testclient import TestClient

from drivers.clock import MonotonicClock
from vla_deploy.client.access.accounts import AccountsFile, User, new_token, wall_s
from vla_deploy.client.access.audit_log import AuditFile, AuditLog
from vla_deploy.client.access.passwords import Cost, hash_password
from vla_deploy.client.link import RobotLink
from vla_deploy.dashboard.access import AccessControl, AccessRules, UserRole
from vla_deploy.dashboard.app import create_app
from vla_deploy.ipc import RingReader, SharedSpace
from vla_deploy.ipc.topics import TOPICS, TopicKind
from vla_deploy.runtime.net import DashboardSettings

PASSWORD = "the robot wears blue socks"
BAIT = "what no route may ever show"
STOP = "/api/v1/stop"
SECRETS = (BAIT, PASSWORD, "scrypt$", "Traceback", "site-packages", "accounts.json")
OPEN = {
    STOP,
    "/api/v1/login",
    "/api/v1/login/code",
    "/api/v1/logout",
    "/api/v1/session",
    "/healthz",
}
RINGS = [topic.name for topic in TOPICS if topic.kind is TopicKind.RING]
ALLOWED_ACTS = {
    UserRole.ANYONE: {"estop"},
    UserRole.VIEWER: {"estop"},
    UserRole.OPERATOR: {"estop", "reset", "arm", "disarm"},
    UserRole.ADMIN: {"estop", "reset", "arm", "disarm"},
}
ROLES = list(UserRole)


@dataclass
class Target:
    """The robot's page under attack, and what of the attack arrives at the robot."""

    app: FastAPI
    client: httpx.AsyncClient
    runner: asyncio.Runner
    folder: Path
    tokens: dict[UserRole, str]
    rings: dict[str, RingReader]
    strategies: dict[Any, Any]
    asked: int = 0

    def ask(self, role: UserRole, method: str, url: str, **content: Any) -> Any:
        """Ask once; every answer has to keep the promises that hold for all."""
        headers = {str(name): value for name, value in (content.pop("headers", None) or {}).items()}
        headers = {name: value for name, value in headers.items() if _may_be_sent(name, value)}
        if role is not UserRole.ANYONE:
            headers["Authorization"] = f"Bearer {self.tokens[role]}"
        answer = self.runner.run(self.client.request(method, url, headers=headers, **content))
        self.asked += 1
        self._judge(role, method, url, answer)
        return answer

    def _judge(self, role: UserRole, method: str, url: str, answer: Any) -> None:
        where = f"{role} {method} {url!r:.200} -> {answer.status_code} {answer.text:.300}"
        assert answer.status_code < 500 or answer.status_code == 503, where
        shown = answer.text + str(answer.headers)
        own = (str(self.folder),) if role is UserRole.ANYONE else ()
        for secret in (*SECRETS, *self.tokens.values(), *own):
            assert secret not in shown, where
        if answer.status_code >= 400 and answer.content:
            assert set(answer.json()["error"]) >= {"code", "what", "try"}, where
        path = url.partition("?")[0]
        if role is UserRole.ANYONE and path.startswith("/api/") and path not in OPEN:
            assert answer.status_code >= 400, where

    def arrived(self) -> dict[str, list[dict[str, Any]]]:
        """Return what has come on the robot's rings since the last look."""
        came = {
            name: [event.payload for event in ring.drain()] for name, ring in self.rings.items()
        }
        return {name: events for name, events in came.items() if events}


def _may_be_sent(name: str, value: Any) -> bool:
    """Tell whether the client sends such a header at all, and it is none that says who asks."""
    own = name.lower() in ("authorization", "cookie", "host", "content-length", "transfer-encoding")
    is_name = re.fullmatch(r"[!#$%&'*+.^_`|~0-9A-Za-z-]+", name) is not None
    return is_name and not own and str(value).isascii() and str(value).isprintable()


@pytest.fixture(scope="module")
def target(tmp_path_factory):
    folder = tmp_path_factory.mktemp("attacked")
    run_dir = folder / "base" / "20260101-000000-1"
    (run_dir / "logs").mkdir(parents=True)
    for place in (folder, run_dir, run_dir / "logs", folder / "base"):
        (place / "bait.txt").write_text(BAIT)
        (place / "bait.mcap").write_text(BAIT)
    clock = MonotonicClock()
    accounts = AccountsFile(folder / "access" / "accounts.json")
    audit = AuditLog(AuditFile(folder / "access" / "audit.jsonl"), clock)
    rules = AccessRules(trust_loopback=True, acts_hz=1000.0, acts_burst=10_000)
    access = AccessControl(
        rules, accounts, audit, clock, cost=Cost(log2_rounds=10, block=1, parallel=1)
    )
    access._unknown._burst = 10**9  # the attack is to reach the routes, not the brakes
    user = User(role=UserRole.ADMIN, password=hash_password(PASSWORD), changed_s=0.0)
    accounts.change(lambda held: (held.with_user("ann", user), None))
    tokens = {}
    for role in ROLES[1:]:
        token_id, text, token = new_token(role.value, role, wall_s(), None)
        accounts.change(lambda held, i=token_id, t=token: (held.with_token(i, t), None))
        tokens[role] = text
    link = RobotLink(run_dir, clock)
    app = create_app(link, DashboardSettings(), access)
    space = SharedSpace(run_dir / "ipc", clock)
    rings = {name: space.ring_reader(name, from_start=True) for name in RINGS}
    far = httpx.ASGITransport(app, client=("192.168.1.7", 50_000))
    with asyncio.Runner() as runner:
        client = httpx.AsyncClient(transport=far, base_url="http://192.168.1.4:8088")
        yield Target(app, client, runner, folder, tokens, rings, described(app))
        runner.run(client.aclose())
    for part in app.state.parts:
        part.stop()
    space.close()
    link.close()


@pytest.fixture(autouse=True)
def nobody_answers_at_once(monkeypatch):
    """Control is away here; acts would wait for it three seconds each."""
    monkeypatch.setattr("vla_deploy.dashboard.api.operate._WITHIN_S", 0.0)


def operations(target):
    return list(target.strategies)


def described(app: FastAPI) -> dict[Any, Any]:
    """Return what to send to each operation: what matches its description, and what does not."""
    schema = schemathesis.openapi.from_dict(app.openapi())
    found = [one.ok() for one in schema.get_all_operations()]
    return {
        one: st.one_of(*(one.as_strategy(generation_mode=mode) for mode in GenerationMode))
        for one in found
    }


def attack(target, role, most_examples):
    """Send what matches the description of every operation, and what does not."""
    bounds = settings(
        max_examples=most_examples,
        derandomize=True,
        database=None,
        deadline=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    for cases in target.strategies.values():

        @bounds
        @given(case=cases)
        def send(case):
            sent = case.as_transport_kwargs(base_url="http://192.168.1.4:8088")
            content = {
                name: sent[name] for name in ("params", "json", "data", "headers") if name in sent
            }
            if isinstance(content.get("data"), bytes | str):
                content["content"] = content.pop("data")
            target.ask(role, sent["method"], _path(sent["url"]), **content)

        send()


def _path(url):
    return "/" + url.partition("://")[2].partition("/")[2]


def check_rings(role, arrived):
    acts = {event["act"] for event in arrived.pop("operator", [])}
    assert acts <= ALLOWED_ACTS[role]
    if not role.allows(UserRole.OPERATOR):
        assert arrived == {}
    if role is not UserRole.ADMIN:
        assert "profile_request" not in arrived
    assert not set(arrived) & {"plan", "motion_command", "motion_result"}


@pytest.mark.parametrize("role", ROLES)
def test_what_is_made_up_from_the_description_breaks_nothing_and_moves_nothing(target, role):
    target.arrived()
    attack(target, role, most_examples=4)
    check_rings(role, target.arrived())


@pytest.mark.slow
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("role", ROLES)
def test_nor_does_ten_minutes_of_it(target, role):
    target.arrived()
    attack(target, role, most_examples=200)
    check_rings(role, target.arrived())


def test_who_may_operate_reaches_the_robot_by_what_fits(target):
    """The attacks above reach the routes: this is how one that is allowed arrives."""
    target.arrived()
    target.ask(UserRole.OPERATOR, "POST", "/api/v1/arm", json={})
    target.ask(UserRole.OPERATOR, "POST", "/api/v1/commands", json={"text": "wave"})
    arrived = target.arrived()
    assert [event["act"] for event in arrived["operator"]] == ["arm"]
    assert [event["text"] for event in arrived["utterance"]] == ["wave"]
    told, _ = target.app.state.access.audit.newest(2)
    assert (told["user"], told["act"], told["details"]["text"]) == (
        "token:operator", "POST /api/v1/commands", "wave"
    )  # fmt: skip


BODIES = [
    b"", b"{", b"[]", b"null", b"3", b'"x"', b"\x00", b"\xff\xfe", b"{}" * 2, b'{"a":1,"a":2}',
    b'{"text": {"$ne": 1}}', b'{"text": "\\u0000"}', b'{"text": "\\ud800"}', b'{"text": NaN}',
    b'{"text": 1e999}', b'{"plan": ' + b"[" * 60_000,
    b'{"plan": {"actions": ' + b"9" * 9000 + b"}}",
    b'{"text": "' + b"a" * 127_000 + b'"}', b'{"text": "' + b"a" * 300_000 + b'"}',
    b'{"reason": "' + b"\xf0\x9f\x98\x80" * 2000 + b'"}',
    b'{"user": ["ann"], "password": {}}',
    b'{"__proto__": {}, "name": "../../x", "may_restart": "yes"}',
]  # fmt: skip


@pytest.mark.parametrize("kind", ["application/json", "text/plain", "multipart/form-data", ""])
def test_bodies_that_are_none_do_nothing(target, kind):
    target.arrived()
    changes = [one for one in operations(target) if one.method.upper() != "GET"]
    for operation in changes:
        path = re.sub(r"\{[^}]+\}", "1", operation.path)
        for body in BODIES if kind == "application/json" else BODIES[1:4]:
            sent = {"content": body, "headers": {"content-type": kind} if kind else {}}
            target.ask(UserRole.ADMIN, operation.method.upper(), path, **sent)
    arrived = target.arrived()
    assert not any(event.get("plan") for event in arrived.get("utterance", []))
    assert "profile_request" not in arrived


NAMES = [
    "../bait.txt", "../../bait.txt", "../../../bait.txt", "/etc/passwd", "//etc/passwd",
    "..\\bait.txt", "....//bait.txt", "bait.mcap", "bait.mcap\x00.mcap", "%2e%2e%2fbait.txt",
    "file:///etc/passwd", "~/x", "a" * 5000, "\u202e", "\r\nSet-Cookie: a=b", "{{7*7}}", "'; --",
    "-1", "1e400", "NaN", "🤖", "con", "x/../../bait.txt",
]  # fmt: skip


def test_no_name_in_a_path_leads_out_of_its_folder(target):
    for operation in operations(target):
        if "{" not in operation.path:
            continue
        for name in NAMES:
            path = re.sub(r"\{[^}]+\}", quote(name, safe=""), operation.path)
            answer = target.ask(UserRole.ADMIN, operation.method.upper(), path)
            assert answer.status_code >= 400, path
            assert "set-cookie" not in answer.headers
    for name in NAMES:
        for folder in ("/static/", "/static/vendor/", "/api/v1/", "/"):
            answer = target.ask(UserRole.ADMIN, "GET", folder + quote(name, safe=""))
            assert "root:x:" not in answer.text


def test_methods_that_no_route_has_are_refused(target):
    target.arrived()
    for operation in operations(target):
        path = re.sub(r"\{[^}]+\}", "1", operation.path)
        for method in ("PUT", "PATCH", "DELETE", "TRACE", "PROPFIND", "X" * 50):
            assert target.ask(UserRole.ADMIN, method, path).status_code in (404, 405)
    for method in ("GET", "HEAD", "OPTIONS"):
        assert target.ask(UserRole.ADMIN, method, STOP).status_code == 405
    assert target.arrived() == {}


def test_no_other_page_moves_the_robot_through_a_browser_that_sits_at_it(target):
    target.arrived()
    here = TestClient(target.app, "http://127.0.0.1:8088", client=("127.0.0.1", 50_000))
    for operation in operations(target):
        if operation.method.upper() == "GET" or operation.path in OPEN:
            continue
        path = re.sub(r"\{[^}]+\}", "1", operation.path)
        for asked in (
            {"origin": "http://evil.example", "content-type": "text/plain"},
            {"origin": "null", "content-type": "application/json"},
            {"origin": "http://127.0.0.1:9999", "content-type": "application/json"},
            {"host": "evil.example:8088", "origin": "http://evil.example:8088"},
            {"sec-fetch-site": "cross-site", "content-type": "application/json"},
        ):
            refused = here.post(path, content=json.dumps({"text": "dance"}), headers=asked)
            assert refused.status_code in (403, 421), (path, asked)
    assert target.arrived() == {}


def test_the_description_itself_tells_no_secret(target):
    answer = target.ask(UserRole.ADMIN, "GET", "/api/v1/openapi.json")
    assert answer.status_code == 200
    assert "/api/v1/arm" in answer.json()["paths"]
