"""The robot's own user is known by a token's file, by the Unix socket, or by a link for a login."""

import asyncio
import contextlib
import socket
import stat
import threading

import pytest

from drivers.clock import MonotonicClock
from vla_deploy.client import peer_credentials
from vla_deploy.client.access.accounts import UserRole
from vla_deploy.client.access.errors import LocalTokenUnusable
from vla_deploy.client.access.local_token import LOCAL, local_headers, provide_local_token
from vla_deploy.dashboard.access.login_links import VALID_S
from vla_deploy.dashboard.serving import HttpSocket, open_socket, serve
from vla_deploy.runtime.state_dir import access_dir_of

STATE, COMMANDS = "/api/v1/state", "/api/v1/commands"
LINK, FOLLOW = "/api/v1/login/link", "/api/v1/login/code"
NOBODY = 65534


@pytest.fixture
def made(world, tmp_path):
    """A robot whose dashboard has made the token of its user; tests find its folder in `base`."""
    made = world()
    made.base = tmp_path / "base"
    provide_local_token(made.base, made.access.accounts)
    return made


def link_code(made):
    answer = made.client().post(LINK, headers=local_headers(made.base))
    assert answer.status_code == 200, answer.text
    return answer.json()["code"]


def follow(client, code):
    return client.post(FOLLOW, json={"code": code})


def test_who_can_read_the_file_is_admin(made):
    told = made.client().get(STATE, headers=local_headers(made.base)).json()
    assert told == {"user": "token:local", "role": "admin", "way": "token"}


def test_the_file_is_for_its_owner_alone_and_stays_while_it_counts(made):
    file = access_dir_of(made.base) / "local_token"
    assert stat.S_IMODE(file.stat().st_mode) == 0o600
    before = local_headers(made.base)
    provide_local_token(made.base, made.access.accounts)
    assert local_headers(made.base) == before


def test_a_file_that_others_may_read_is_refused_and_replaced(made):
    file, before = access_dir_of(made.base) / "local_token", local_headers(made.base)
    file.chmod(0o644)
    with pytest.raises(LocalTokenUnusable, match="others may read it"):
        local_headers(made.base)
    provide_local_token(made.base, made.access.accounts)
    assert local_headers(made.base) != before
    assert made.client().get(STATE, headers=before).status_code == 401


def test_a_link_logs_one_browser_in_once(made):
    code, client = link_code(made), made.client()
    told = follow(client, code).json()
    assert (told["user"], told["role"], told["way"]) == ("local", "admin", "session")
    assert client.get(STATE).json()["way"] == "session"
    assert client.post(COMMANDS, json={}).status_code == 403  # without the session's own word
    asked = {"x-csrf-token": told["csrf"]}
    assert client.post(COMMANDS, json={}, headers=asked).status_code == 200
    again = follow(made.client(), code)
    assert (again.status_code, again.json()["error"]["code"]) == (401, "link_refused")


def test_a_link_that_nobody_has_followed_ends(made):
    code = link_code(made)
    made.clock.pass_s(VALID_S + 1)
    assert follow(made.client(), code).status_code == 401


def test_such_a_login_outlives_the_dashboard_and_ends_with_the_token(made, world):
    client = made.client()
    follow(client, link_code(made))
    restarted = world().client(cookies=dict(client.cookies))
    assert restarted.get(STATE).json()["user"] == "local"
    spoilt = {"vla_session": client.cookies["vla_session"].replace("local.", "local.9")}
    assert world().client(cookies=spoilt).get(STATE).status_code == 401
    made.access.accounts.change(lambda held: (held.without_token(LOCAL), None))
    assert restarted.get(STATE).status_code == 401


def test_such_a_login_ends_after_a_week_and_by_the_logout(made):
    client = made.client()
    told = follow(client, link_code(made)).json()
    cookie = dict(client.cookies)
    made.wall[0] += made.access.rules.session_longest_s + 1
    assert made.client(cookies=cookie).get(STATE).status_code == 401
    made.wall[0] -= made.access.rules.session_longest_s
    assert client.post("/api/v1/logout", headers={"x-csrf-token": told["csrf"]}).status_code == 200
    assert made.client(cookies=cookie).get(STATE).status_code == 401


def test_other_admins_make_no_links(made):
    other = {"Authorization": f"Bearer {made.add_token('other', UserRole.ADMIN)}"}
    assert made.client().post(LINK, headers=other).status_code == 403
    assert made.client().post(LINK).status_code == 401


@pytest.mark.parametrize(("uid", "answered"), [(0, True), (NOBODY, False)])
def test_the_unix_socket_asks_the_kernel_who_is_there(made, monkeypatch, uid, answered):
    """Whoever gets to the socket's file, through a folder that somebody has opened, is nobody."""
    monkeypatch.setattr(peer_credentials.os, "geteuid", lambda: 4711)
    packed = peer_credentials._CREDENTIALS.pack(1, uid, uid)
    real = socket.socket.getsockopt

    class Peer(socket.socket):
        def getsockopt(self, level, name, *size):
            is_asked = name == socket.SO_PEERCRED
            return packed if is_asked else real(self, level, name, *size)

    with Peer(socket.AF_UNIX) as connection:
        assert peer_credentials.is_own_user(connection) is answered


def test_a_stranger_at_the_unix_socket_is_hung_up_on(made, tmp_path, monkeypatch):
    monkeypatch.setattr("vla_deploy.dashboard.accepting.is_own_user", lambda connection: False)
    path, ended = tmp_path / "s", threading.Event()
    listener = open_socket(path)
    serving = serve(made.app, [HttpSocket(listener)], Idle(), MonotonicClock(), ended.is_set)
    thread = threading.Thread(target=asyncio.run, args=(serving,))
    thread.start()
    try:
        with socket.socket(socket.AF_UNIX) as client:
            client.connect(str(path))
            with contextlib.suppress(OSError):
                client.sendall(b"GET /api/v1/state HTTP/1.1\r\nHost: robot\r\n\r\n")
            with contextlib.suppress(ConnectionResetError):
                assert client.recv(100) == b""
    finally:
        ended.set()
        thread.join()
        listener.close()


class Idle:
    """A node with nothing to do."""

    period_s = 0.02

    def start(self):
        pass

    def step(self):
        pass

    def stop(self):
        pass
