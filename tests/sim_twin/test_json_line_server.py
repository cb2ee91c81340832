import json
import socket
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest

from sim_twin.errors import RefereeRefusal
from sim_twin.ports.json_line_server import JsonLineServer


def echo(request: Mapping[str, Any]) -> dict[str, Any]:
    if request.get("op") == "refuse":
        raise RefereeRefusal("no such thing")
    return {"heard": request}


@pytest.fixture
def server(tmp_path: Path) -> Iterator[JsonLineServer]:
    server = JsonLineServer(tmp_path / "s", echo)
    yield server
    server.close()


def connect(tmp_path: Path) -> socket.socket:
    client = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    client.settimeout(5)
    client.connect(str(tmp_path / "s"))
    return client


def ask(server: JsonLineServer, client: socket.socket, data: bytes) -> list[Any]:
    client.sendall(data)
    server.poll_once()
    return [json.loads(line) for line in client.recv(4096).splitlines()]


def test_each_line_gets_an_answer(server: JsonLineServer, tmp_path: Path) -> None:
    with connect(tmp_path) as client:
        replies = ask(server, client, b'{"op": "a"}\n{"op": "b"}\n')
    assert replies == [{"ok": True, "heard": {"op": "a"}}, {"ok": True, "heard": {"op": "b"}}]


def test_half_a_line_waits_for_the_rest(server: JsonLineServer, tmp_path: Path) -> None:
    with connect(tmp_path) as client:
        client.sendall(b'{"op": ')
        server.poll_once()
        assert ask(server, client, b'"a"}\n')[0]["ok"]


@pytest.mark.parametrize("line", [b"nonsense\n", b"[1]\n", b'{"op": "refuse"}\n', b"\xff\n"])
def test_a_bad_request_gets_a_reason(server: JsonLineServer, tmp_path: Path, line: bytes) -> None:
    with connect(tmp_path) as client:
        reply = ask(server, client, line)[0]
    assert not reply["ok"]
    assert reply["error"]


def test_a_client_that_leaves_is_forgotten(server: JsonLineServer, tmp_path: Path) -> None:
    alone = len(server.filenos())
    with connect(tmp_path) as client:
        ask(server, client, b"{}\n")
        assert len(server.filenos()) == alone + 1
    server.poll_once()
    assert len(server.filenos()) == alone


def test_an_endless_request_is_cut_off(server: JsonLineServer, tmp_path: Path) -> None:
    with connect(tmp_path) as client:
        for _ in range(2):
            client.sendall(b"x" * 60_000)
            server.poll_once()
        assert client.recv(1) == b""


def test_closing_removes_the_socket(tmp_path: Path) -> None:
    server = JsonLineServer(tmp_path / "s", echo)
    server.close()
    assert not (tmp_path / "s").exists()


def test_another_user_is_hung_up_on(
    server: JsonLineServer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sim_twin.ports.json_line_server.is_own_user", lambda client: False)
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as stranger:
        stranger.connect(str(tmp_path / "s"))
        server.poll_once()
        assert stranger.recv(1) == b""
