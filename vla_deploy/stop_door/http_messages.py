"""Read the head of a request and write the answer: pure functions, a small part of HTTP/1.1."""

import hashlib
import json
import re
from base64 import b64encode
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from html import escape
from http import HTTPStatus
from typing import Any, Final
from urllib.parse import urlsplit

_LINE_END: Final = re.compile(r"\r?\n")
_KNOWN: Final = frozenset({"host", "origin", "accept"})
_HTML_TYPE: Final = "text/html"
_ORIGIN: Final = re.compile(r"https?://[A-Za-z0-9._:\[\]-]+")  # it is written into an answer
_STYLE: Final = """
:root { color-scheme: light dark; font: 1.25rem/1.5 system-ui, sans-serif; }
body { margin: 0; min-height: 100vh; display: grid; place-content: center; gap: 1.5rem;
  padding: 1rem; box-sizing: border-box; text-align: center; }
button { width: min(80vmin, 24rem); aspect-ratio: 1; border: 1rem solid #ffd400;
  border-radius: 50%; background: #b00020; color: #fff; font: bold 4rem system-ui, sans-serif; }
button:focus-visible { outline: .5rem solid Highlight; outline-offset: .25rem; }
"""
_PAGE: Final = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>Stop the robot</title>
<style>{style}</style>
</head>
<body>
<main>
<h1>{heading}</h1>
<form method="post" action="/stop"><button autofocus>STOP</button></form>
<p role="status">{line}</p>
</main>
</body>
</html>
"""
STYLE_DIGEST: Final = b64encode(hashlib.sha256(_STYLE.encode()).digest()).decode()
"""The hash by which the content security policy admits the page's style."""
_SILENT: Final = "control is silent; use the emergency stop button on the robot"
_ALWAYS: Final = {
    "Connection": "close",
    "Cache-Control": "no-store",
    "Content-Security-Policy": (
        f"default-src 'none'; style-src 'sha256-{STYLE_DIGEST}'; form-action 'self'; "
        "base-uri 'none'; frame-ancestors 'none'"
    ),
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Vary": "Origin",
}
_JSON: Final = "application/json"
_HTML: Final = "text/html; charset=utf-8"
_METHODS: Final = {"/": "GET, HEAD, OPTIONS", "/stop": "POST, OPTIONS"}
_STOP_HERE: Final = "POST /stop stops the robot, GET / shows a page with a stop button"


class Malformed(Exception):
    """Report that a request cannot be read."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StopRequest:
    """Hold the used parts of one request; its body, if any, is ignored."""

    method: str
    path: str
    host: str = ""
    origin: str = ""
    accept: str = ""

    @property
    def is_press(self) -> bool:
        """Return whether this presses the stop."""
        return (self.method, self.path) == ("POST", "/stop")

    @property
    def wants_page(self) -> bool:
        """Return whether a browser shows the answer, instead of a script that reads it."""
        return _HTML_TYPE in self.accept

    @property
    def allowed_origin(self) -> str:
        """Return the origin whose scripts may read the answer: any port of the same host, or ""."""
        if not _ORIGIN.fullmatch(self.origin):
            return ""
        here, there = _host_name(f"//{self.host}"), _host_name(self.origin)
        return self.origin if here and here == there else ""

    @property
    def foreign_origin(self) -> str:
        """Return the origin of another host's page, or "" where there is none."""
        return "" if self.allowed_origin else self.origin


def read_head(head: bytes) -> StopRequest:
    """Return the request of a head, which may be cut off after its first line.

    Malformed headers are skipped: with one request a connection nothing can hide in them.

    Raises:
        Malformed: the first line is not that of HTTP/1.x.
    """
    first, *rest = _LINE_END.split(head.decode("latin-1"))
    words = first.split(" ")
    if len(words) != 3 or not words[2].startswith("HTTP/1."):
        raise Malformed(f"request line {first[:60]!r}: expected METHOD PATH HTTP/1.1")
    return StopRequest(method=words[0], path=words[1].partition("?")[0], **dict(_headers(rest)))


def _headers(lines: list[str]) -> Iterator[tuple[str, str]]:
    for line in lines:
        name, _, value = line.partition(":")
        if name.lower() in _KNOWN:
            yield name.lower(), value.strip()


def _host_name(url: str) -> str:
    try:
        return urlsplit(url).hostname or ""
    except ValueError:  # a malformed address in brackets
        return ""


def stop_page(heading: str, line: str) -> str:
    """Return the page with a heading and a line below the button."""
    return _PAGE.format(style=_STYLE, heading=escape(heading), line=escape(line))


@dataclass(frozen=True, slots=True, kw_only=True)
class ControlState:
    """Hold what control published `age_s` ago."""

    state: str
    estop_latched: bool
    age_s: float


def control_text(control: ControlState | None) -> str:
    """Return control's state for a person."""
    if control is None:
        return _SILENT
    latched = ", emergency stop latched" if control.estop_latched else ""
    return f"control: {control.state.replace('_', ' ')}{latched}"


def pressed(request: StopRequest, control: ControlState | None) -> bytes:
    """Answer a press, which control reads in its next tick; `control` may be older."""
    if request.wants_page:
        page = stop_page("Stop demanded", control_text(control))
        return _answer(request, HTTPStatus.OK, page, _HTML)
    status = None if control is None else asdict(control)
    return _json(request, HTTPStatus.OK, {"pressed": True, "control": status})


def not_pressed(request: StopRequest, why: str) -> bytes:
    """Answer a press that failed, in large letters on the page."""
    if request.wants_page:
        page = stop_page("NOT stopped", f"{why}; use the emergency stop button on the robot")
        return _answer(request, HTTPStatus.SERVICE_UNAVAILABLE, page, _HTML)
    hint = "use the emergency stop button on the robot"
    return _error(request, HTTPStatus.SERVICE_UNAVAILABLE, "not_pressed", why, hint)


def other_answer(request: StopRequest, control: ControlState | None) -> bytes:
    """Answer all other requests: the page, a preflight, or an error."""
    methods = _METHODS.get(request.path)
    if methods is None:
        what = f"{request.path[:60]}: not here"
        return _error(request, HTTPStatus.NOT_FOUND, "not_found", what, _STOP_HERE)
    if request.method == "OPTIONS":
        return _answer(request, HTTPStatus.NO_CONTENT, "", _JSON, {"Allow": methods})
    if request.method not in methods.split(", "):
        what = f"{request.method[:20]} {request.path}: expected {methods}"
        status = HTTPStatus.METHOD_NOT_ALLOWED
        return _error(request, status, "method_not_allowed", what, _STOP_HERE, {"Allow": methods})
    return _answer(
        request, HTTPStatus.OK, stop_page("Stop the robot", control_text(control)), _HTML
    )


def refused(status: HTTPStatus, what: str) -> bytes:
    """Answer what is no request."""
    return _error(StopRequest(method="", path=""), status, "bad_request", what, _STOP_HERE)


def _error(
    request: StopRequest,
    status: HTTPStatus,
    code: str,
    what: str,
    hint: str,
    headers: dict[str, str] | None = None,
) -> bytes:
    return _json(request, status, {"error": {"code": code, "what": what, "try": hint}}, headers)


def _json(
    request: StopRequest,
    status: HTTPStatus,
    document: dict[str, Any],
    headers: dict[str, str] | None = None,
) -> bytes:
    return _answer(request, status, json.dumps(document), _JSON, headers)


def _answer(
    request: StopRequest,
    status: HTTPStatus,
    text: str,
    kind: str,
    headers: dict[str, str] | None = None,
) -> bytes:
    body = text.encode()
    fields = {
        **_ALWAYS,
        **_cross_origin(request),
        **(headers or {}),
        "Content-Type": kind,
        "Content-Length": str(len(body)),
    }
    head = [f"HTTP/1.1 {status.value} {status.phrase}", *(f"{k}: {v}" for k, v in fields.items())]
    return "\r\n".join([*head, "", ""]).encode("latin-1") + (
        b"" if request.method == "HEAD" else body
    )


def _cross_origin(request: StopRequest) -> dict[str, str]:
    """Return the CORS headers: a page on another port of this host may read the answer."""
    origin = request.allowed_origin
    if not origin:
        return {}
    allowed = {"Access-Control-Allow-Origin": origin}
    if request.method != "OPTIONS":
        return allowed
    return allowed | {
        "Access-Control-Allow-Methods": "POST",
        "Access-Control-Allow-Headers": "Content-Type",
        "Access-Control-Allow-Private-Network": "true",
        "Access-Control-Max-Age": "600",
    }
