"""A device on HTTP, served by a real server: a Shelly, a Tasmota plug, and hostile ones."""

import base64
import json
import threading
from collections.abc import Callable, Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest

from vla_deploy.devices import DeviceAway, DeviceError, DeviceNotUsable, StateUnreadable, http_link
from vla_deploy.devices.http_link import HttpLink
from vla_deploy.devices.login import read_login
from vla_deploy.robots.home_devices import HttpRequests

Answer = Callable[[BaseHTTPRequestHandler], None]


class Plug(ThreadingHTTPServer):
    """A plug whose requests a test answers; it keeps what it was asked."""

    daemon_threads = True

    def __init__(self) -> None:
        super().__init__(("127.0.0.1", 0), _Handler)
        self.is_on = False
        self.asked: list[str] = []
        self.headers: list[str | None] = []
        self.ended = threading.Event()
        self.answer: Answer = shelly

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.server_port}"


class _Handler(BaseHTTPRequestHandler):
    server: Plug

    def do_GET(self) -> None:
        self.server.asked.append(self.path)
        self.server.headers.append(self.headers["Authorization"])
        self.server.answer(self)

    def do_POST(self) -> None:
        self.do_GET()

    def log_message(self, *_: object) -> None:
        pass


def send(handler: BaseHTTPRequestHandler, body: bytes, status: int = 200, **headers: str) -> None:
    handler.send_response(status)
    for name, value in {"Content_Length": str(len(body)), **headers}.items():
        handler.send_header(name.replace("_", "-"), value)
    handler.end_headers()
    handler.wfile.write(body)


def shelly(handler: BaseHTTPRequestHandler) -> None:
    plug = handler.server
    assert isinstance(plug, Plug)
    if "turn=" in handler.path:
        plug.is_on = handler.path.endswith("on")
    send(handler, json.dumps({"ison": plug.is_on, "has_timer": False}).encode())


def tasmota(handler: BaseHTTPRequestHandler) -> None:
    plug = handler.server
    assert isinstance(plug, Plug)
    if "turn=" in handler.path:
        plug.is_on = handler.path.endswith("on")
    send(handler, json.dumps({"POWER": "ON" if plug.is_on else "OFF"}).encode())


def plain(handler: BaseHTTPRequestHandler) -> None:
    plug = handler.server
    assert isinstance(plug, Plug)
    if "turn=" in handler.path:
        plug.is_on = handler.path.endswith("on")
    send(handler, b"ON\r\n" if plug.is_on else b"off")


@pytest.fixture
def plug(monkeypatch: pytest.MonkeyPatch) -> Iterator[Plug]:
    monkeypatch.setattr(http_link, "REQUEST_S", 10.0)  # as a busy computer may take
    monkeypatch.setattr(http_link, "STATE_S", 10.0)
    with Plug() as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.01,))
        thread.start()
        yield server
        server.ended.set()
        server.shutdown()
        thread.join()


def link_to(plug: Plug, **changes: str) -> HttpLink:
    state = f"{plug.url}/relay/0"
    declared = {"on": f"{state}?key=hush&turn=on", "off": f"{state}?key=hush&turn=off"}
    shelly_words = {"pointer": "/ison", "state_on": "true", "state_off": "false"}
    return HttpLink(HttpRequests(**{**declared, "state": state, **shelly_words, **changes}))


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (shelly, {}),
        (tasmota, {"pointer": "/POWER", "state_on": "ON", "state_off": "OFF", "method": "POST"}),
        (plain, {"pointer": "", "state_on": "on", "state_off": "off"}),
    ],
    ids=["Shelly", "Tasmota", "plain text"],
)
def test_it_is_switched_and_asked(plug: Plug, answer: Answer, words: dict[str, str]) -> None:
    plug.answer = answer
    link = link_to(plug, **words)
    assert not link.read().is_on
    assert link.switch(True).is_on
    assert plug.is_on
    assert not link.switch(False).is_on
    assert plug.asked[-2:] == ["/relay/0?key=hush&turn=off", "/relay/0"]


def test_one_that_stays_as_it_is_says_so(plug: Plug, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(http_link, "STATE_S", 0.5)
    plug.answer = lambda handler: send(handler, b'{"ison": false}')
    assert not link_to(plug).switch(True).is_on


def trickle(handler: BaseHTTPRequestHandler) -> None:
    """Send a letter of a header now and then, as long as anybody listens."""
    plug = handler.server
    assert isinstance(plug, Plug)
    handler.wfile.write(b"HTTP/1.1 200 OK\r\nX: ")
    while not plug.ended.wait(0.02):
        try:
            handler.wfile.write(b"x")
        except OSError:
            return


@pytest.mark.parametrize(
    ("answer", "kind", "why"),
    [
        (lambda h: send(h, b"{}"), StateUnreadable, "there is no"),
        (lambda h: send(h, b'{"ison": "\x1b[2J"}'), StateUnreadable, "expected"),
        (lambda h: send(h, b"<html>"), StateUnreadable, "expected JSON"),
        (lambda h: send(h, b"x" * 1_000_000), StateUnreadable, "over 65536 bytes"),
        (lambda h: send(h, b"{}", Content_Length="9"), DeviceAway, "no whole answer|no answer"),
        (lambda h: send(h, b"", 302, Location="http://192.0.2.1/"), DeviceNotUsable, "elsewhere"),
        (lambda h: send(h, b"", 401), DeviceNotUsable, "refuses us .HTTP 401"),
        (lambda h: send(h, b"", 500), DeviceAway, "HTTP 500"),
        (lambda h: h.wfile.write(b"SSH-2.0-x\r\n\r\n"), DeviceAway, "no answer"),
        (lambda h: h.connection.close(), DeviceAway, "no answer"),
        (trickle, DeviceAway, "no answer|no whole answer"),
    ],
    ids=["empty", "control characters", "page", "flood", "short", "redirect", "login", "broken",
         "other protocol", "hangs up", "trickle"],
)  # fmt: skip
def test_what_is_no_answer_is_named(
    plug: Plug,
    answer: Answer,
    kind: type[DeviceError],
    why: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    if answer is trickle:
        monkeypatch.setattr(http_link, "REQUEST_S", 0.5)
    plug.answer = answer
    with pytest.raises(kind, match=why) as refused:
        link_to(plug).switch(True)
    assert "hush" not in str(refused.value)
    assert plug.url in str(refused.value)
    assert str(refused.value).isprintable()


def test_one_that_is_away_is_named(plug: Plug) -> None:
    link = link_to(plug, on="http://127.0.0.1:1/on?key=hush")
    with pytest.raises(
        DeviceAway, match=r"http://127\.0\.0\.1:1/on: no answer: Connection refused"
    ):
        link.switch(True)


def test_who_is_interrupted_asks_no_more(plug: Plug) -> None:
    link = link_to(plug)
    link.interrupt()
    with pytest.raises(DeviceAway, match="the robot ends"):
        link.read()
    assert not plug.asked


def test_user_and_password_come_from_a_file_that_only_the_owner_reads(
    plug: Plug, tmp_path: Path
) -> None:
    file = tmp_path / "plug.toml"
    state = f"{plug.url}/"
    declared = HttpRequests(on=state, off=state, state=state, state_on="on", state_off="off")
    link = HttpLink(declared, lambda: read_login(file))
    for content, mode, why in (
        (None, 0, "No such file"),
        ('user = "a"\npassword = "hush"', 0o644, "mode 644 lets others read it, expected 600"),
        ("hush", 0o600, "not TOML"),
        ('user = "a"\npassword = 7', 0o600, "expected two lines"),
    ):
        if content is not None:
            file.write_text(content)
            file.chmod(mode)
        with pytest.raises(DeviceNotUsable, match=why) as refused:
            link.read()
        assert "hush" not in f"{refused.value!r} {refused.value.__cause__!r}"
    file.write_text('user = "a"\npassword = "hush"')
    plug.answer = plain
    assert not link.read().is_on
    assert plug.headers[-1] == f"Basic {base64.b64encode(b'a:hush').decode()}"
