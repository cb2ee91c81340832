"""Clients of a real stop door: a browser, a script, a stuck one and hostile ones."""

import json
import socket
from contextlib import ExitStack, closing
from typing import Any

import pytest

from vla_deploy.stop_door.server import (
    LINGER_NS,
    MAX_CONNECTIONS,
    MAX_HEAD_BYTES,
    READ_NS,
    WRITE_NS,
    Connection,
    ConnectionStage,
)

PRESS = b"POST /stop HTTP/1.1\r\nHost: 127.0.0.1:8089\r\nContent-Length: 0\r\n\r\n"
LATE_S = READ_NS / 1e9


def split(answer: bytes) -> tuple[int, dict[str, str], str]:
    head, _, body = answer.decode().partition("\r\n\r\n")
    status, *lines = head.split("\r\n")
    return int(status.split(" ")[1]), dict(line.split(": ", 1) for line in lines), body


def test_a_press_reaches_the_operators_ring_with_its_address(doorway):
    status, headers, body = split(doorway.ask(PRESS))
    assert (status, headers["Content-Type"]) == (200, "application/json")
    assert json.loads(body) == {"pressed": True, "control": None}
    assert doorway.pressed() == [
        {"act": "estop", "source": "page", "reason": "stop door, from 127.0.0.1"}
    ]


def test_the_answer_tells_what_control_says_so_that_a_page_knows_when_to_stop_asking(doorway):
    doorway.control_says("stopped", latched=True)
    doorway.clock.advance(0.25)
    told = json.loads(split(doorway.ask(PRESS))[2])["control"]
    assert told == {"state": "stopped", "estop_latched": True, "age_s": 0.25}
    doorway.clock.advance(1.0)
    assert json.loads(split(doorway.ask(PRESS))[2])["control"] is None


@pytest.mark.parametrize("document", [{}, {"state": "armed"}])
def test_a_control_that_tells_nonsense_does_not_keep_a_press_from_counting(doorway, document):
    doorway.space.cell_writer("control_status").put_document(document)
    assert json.loads(split(doorway.ask(PRESS))[2]) == {"pressed": True, "control": None}
    assert len(doorway.pressed()) == 1


@pytest.mark.parametrize("body", [b"{}", b'{"reason": "it leans"}', b"x" * 5000, b"\x00\xff"])
def test_a_body_of_any_kind_changes_nothing(doorway, body):
    request = PRESS.replace(b"Length: 0", b"Length: %d" % len(body)) + body
    assert split(doorway.ask(request))[0] == 200
    assert len(doorway.pressed()) == 1


def test_the_page_has_a_button_that_needs_no_script(doorway):
    doorway.control_says("armed", latched=False)
    status, headers, page = split(doorway.ask(b"GET / HTTP/1.1\r\nHost: robot\r\n\r\n"))
    assert status == 200
    assert '<form method="post" action="/stop"><button autofocus>STOP</button></form>' in page
    assert "control: armed" in page
    assert "<script" not in page
    assert "'unsafe" not in headers["Content-Security-Policy"]
    assert doorway.pressed() == []


def test_a_pressed_form_is_answered_by_a_page(doorway):
    doorway.control_says("stopping", latched=True)
    request = PRESS.replace(b"\r\n\r\n", b"\r\nAccept: text/html\r\n\r\n")
    status, headers, page = split(doorway.ask(request))
    assert (status, headers["Content-Type"]) == (200, "text/html; charset=utf-8")
    assert "Stop demanded" in page
    assert "control: stopping, emergency stop latched" in page


def test_head_gives_the_pages_head_alone(doorway):
    status, headers, body = split(doorway.ask(b"HEAD / HTTP/1.1\r\n\r\n"))
    assert (status, body) == (200, "")
    assert int(headers["Content-Length"]) > 500


@pytest.mark.parametrize(
    ("line", "status", "code"),
    [
        ("GET /stop", 405, "method_not_allowed"),
        ("POST /", 405, "method_not_allowed"),
        ("GET /../../etc/passwd", 404, "not_found"),
        ("POST /reset", 404, "not_found"),
        ("POST /api/v1/arm", 404, "not_found"),
    ],
)
def test_it_can_do_nothing_else(doorway, line, status, code):
    got, _, body = split(doorway.ask(f"{line} HTTP/1.1\r\nHost: robot\r\n\r\n".encode()))
    error = json.loads(body)["error"]
    assert (got, error["code"]) == (status, code)
    assert error["try"].startswith("POST /stop stops the robot")
    assert doorway.pressed() == []


def test_what_is_no_http_is_refused_and_counted(doorway):
    status, _, body = split(doorway.ask(b"\x16\x03\x01 hello\r\n\r\n"))
    assert (status, json.loads(body)["error"]["code"]) == (400, "bad_request")
    assert doorway.tell()["refused"] == 1


def test_another_port_of_this_host_may_ask_beforehand_and_read(doorway):
    request = b"OPTIONS /stop HTTP/1.1\r\nHost: robot:8089\r\nOrigin: http://robot:8088\r\n\r\n"
    status, headers, body = split(doorway.ask(request))
    assert (status, body) == (204, "")
    assert headers["Access-Control-Allow-Origin"] == "http://robot:8088"
    assert headers["Access-Control-Allow-Methods"] == "POST"
    assert doorway.pressed() == []


def test_a_page_of_another_host_presses_all_the_same_but_is_named_and_may_not_read(doorway):
    request = PRESS.replace(b"\r\n\r\n", b"\r\nOrigin: http://evil.example\r\n\r\n")
    status, headers, _ = split(doorway.ask(request))
    assert status == 200
    assert "Access-Control-Allow-Origin" not in headers
    assert doorway.pressed()[0]["reason"] == (
        "stop door, from 127.0.0.1, by a page of http://evil.example"
    )


def test_a_flood_is_never_refused_and_leaves_the_ring_to_others(doorway):
    for _ in range(200):
        assert split(doorway.ask(PRESS))[0] == 200
        doorway.clock.advance(0.005)
    assert 9 <= len(doorway.pressed()) <= 11
    told = doorway.tell()
    assert told["pressed"] + told["joined"] == 200


def test_a_press_whose_head_never_ends_counts_when_its_time_is_over(doorway):
    with closing(doorway.call()) as client:
        client.sendall(b"POST /stop HTTP/1.1\r\nHost: robot")
        doorway.node.step()
        assert doorway.pressed() == []
        doorway.clock.advance(LATE_S)
        assert split(doorway.answer(client))[0] == 200
    assert len(doorway.pressed()) == 1


def test_a_press_with_too_long_a_head_counts(doorway):
    cookies = b"Cookie: " + b"c" * (MAX_HEAD_BYTES + 1)
    assert doorway.ask(PRESS.replace(b"\r\n\r\n", b"\r\n" + cookies)).startswith(b"HTTP/1.1 200")
    assert len(doorway.pressed()) == 1


def test_a_press_that_is_typed_with_bare_line_ends_counts_at_once(doorway):
    assert doorway.ask(b"POST /stop HTTP/1.1\nHost: robot\n\n").startswith(b"HTTP/1.1 200")
    assert len(doorway.pressed()) == 1


def test_a_typed_press_that_ends_after_its_first_line_counts(doorway):
    with closing(doorway.call()) as client:
        client.sendall(b"POST /stop HTTP/1.1\n")
        client.shutdown(socket.SHUT_WR)
        assert doorway.answer(client).startswith(b"HTTP/1.1 200")
    assert len(doorway.pressed()) == 1


def test_a_press_of_a_client_that_hangs_up_at_once_counts(doorway):
    with closing(doorway.call()) as client:
        client.sendall(PRESS)
    doorway.node.step()
    assert len(doorway.pressed()) == 1


def test_whoever_drips_is_cut_off_while_others_are_served(doorway):
    with closing(doorway.call()) as dripping:
        doorway.node.step()
        for byte in (b"G", b"E", b"T"):
            dripping.sendall(byte)
            doorway.clock.advance(LATE_S / 4)
            assert split(doorway.ask(PRESS))[0] == 200
        doorway.clock.advance(LATE_S / 4)
        assert doorway.answer(dripping) == b""
    assert doorway.tell()["expired"] == 1


def test_a_client_that_never_reads_its_answer_goes_without_holding_up_others(doorway):
    with closing(doorway.call()) as deaf:
        deaf.sendall(b"GET / HTTP/1.1\r\n\r\n")
        doorway.node.step()
        assert doorway.tell()["connections"] == 1
        assert split(doorway.ask(PRESS))[0] == 200
        doorway.clock.advance((WRITE_NS + LINGER_NS) / 1e9)
        assert doorway.tell()["connections"] == 0


def test_a_full_house_makes_room_at_the_cost_of_whoever_holds_most(doorway):
    with ExitStack() as opened:
        for _ in range(MAX_CONNECTIONS + 5):
            opened.enter_context(closing(doorway.call()))
            doorway.node.step()
        assert doorway.tell()["connections"] == MAX_CONNECTIONS
        assert split(doorway.ask(PRESS))[0] == 200
        assert doorway.tell()["crowded_out"] >= 5
    assert len(doorway.pressed()) == 1


def test_many_who_reset_their_connections_at_once_leave_the_door_open(doorway):
    for _ in range(50):
        client = doorway.call()
        client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\x01\0\0\0\0\0\0\0")
        client.close()
    assert split(doorway.ask(PRESS))[0] == 200
    assert doorway.tell()["connections"] == 0


MOST_READS = 100


class Torrent(socket.socket):
    """Be the wire to a client that sends without end, and faster than anybody reads."""

    def __init__(self, head: bytes) -> None:
        super().__init__()
        self._head = head
        self._reads = 0

    def recv(self, most: int, *_: Any) -> bytes:
        self._reads += 1
        assert self._reads < MOST_READS, "it reads on and serves nobody else"
        head, self._head = self._head[:most], self._head[most:]
        return head or b"x" * most

    def send(self, data: Any, *_: Any) -> int:
        return len(data)

    def shutdown(self, how: int) -> None:
        return None


@pytest.mark.parametrize("head", [b"GET / HTTP/1.1\r\n\r\n", b"", b"POST /stop HTTP/1.1\r\n"])
def test_who_sends_without_end_gets_a_turn_like_everybody_else(head):
    answered: list[bytes] = []

    def answer(head: bytes, whole: bool) -> bytes:
        answered.append(head)
        return b"HTTP/1.1 200 OK\r\n\r\n"

    connection = Connection(Torrent(head), "192.168.1.9", answer, 0)
    for _ in range(3):
        connection.proceed(0)
    assert (connection.stage, len(answered)) == (ConnectionStage.LINGERING, 1)
    assert connection.deadline_ns <= LINGER_NS
    connection.expire(LINGER_NS)
    assert connection.stage is ConnectionStage.CLOSED
