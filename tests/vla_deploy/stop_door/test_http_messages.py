"""Requests are read by their head alone, and scripts of the same host alone read the answer."""

import pytest

from vla_deploy.stop_door.http_messages import Malformed, read_head


def test_a_press_needs_no_more_than_its_first_line():
    request = read_head(b"POST /stop HTTP/1.1")
    assert request.is_press
    assert (request.host, request.origin, request.wants_page) == ("", "", False)


@pytest.mark.parametrize("line", ["GET /stop", "POST /", "POST /stop/x", "post /stop"])
def test_only_a_post_to_stop_presses(line):
    assert not read_head(f"{line} HTTP/1.1".encode()).is_press


def test_a_query_changes_nothing():
    assert read_head(b"POST /stop?from=phone HTTP/1.0").is_press


def test_headers_that_are_none_hide_nothing():
    head = b"POST /stop HTTP/1.1\r\nnonsense\r\n: x\r\nHOST:  robot:8089 \r\nAccept: text/html,*/*"
    request = read_head(head)
    assert (request.is_press, request.host, request.wants_page) == (True, "robot:8089", True)


def test_lines_end_as_a_person_types_them_too():
    request = read_head(b"POST /stop HTTP/1.1\nHost: robot\nAccept: text/html")
    assert (request.is_press, request.host, request.wants_page) == (True, "robot", True)


@pytest.mark.parametrize(
    "head", [b"", b"\r\nPOST /stop HTTP/1.1", b"POST /stop", b"\x16\x03\x01\x02", b"A B C D"]
)
def test_what_is_no_http_is_refused(head):
    with pytest.raises(Malformed, match=r"expected METHOD PATH HTTP/1\.1"):
        read_head(head)


@pytest.mark.parametrize(
    ("host", "origin", "allowed"),
    [
        ("127.0.0.1:8089", "http://127.0.0.1:8088", True),
        ("robot.local:8089", "https://robot.local", True),
        ("[::1]:8089", "http://[::1]:8088", True),
        ("ROBOT:8089", "http://robot:8088", True),
        ("127.0.0.1:8089", "http://localhost:8088", False),
        ("robot:8089", "http://evil.example:8088", False),
        ("robot:8089", "http://robot.evil.example", False),
        ("robot:8089", "null", False),
        ("robot:8089", "", False),
        ("", "http://robot:8088", False),
        ("[::1", "http://[::1", False),
        ("robot:8089", "http://robot\rSet-Cookie: a=b", False),
        ("robot:8089", "http://robot:8088/", False),
    ],
)
def test_scripts_of_the_same_host_alone_may_read_the_answer(host, origin, allowed):
    head = f"POST /stop HTTP/1.1\r\nHost: {host}\r\nOrigin: {origin}".encode()
    request = read_head(head)
    assert request.is_press
    assert request.allowed_origin == (origin if allowed else "")
    assert request.foreign_origin == ("" if allowed else origin)
