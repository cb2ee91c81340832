"""Write the door's answers: pure functions from a request and what came of it to bytes."""

import json
from dataclasses import asdict
from http import HTTPStatus
from typing import Any, Final

from vla_deploy.stop_door.control_word import ControlWord, in_words
from vla_deploy.stop_door.page import STYLE_DIGEST, stop_page
from vla_deploy.stop_door.request import Request

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


def pressed(request: Request, word: ControlWord | None) -> bytes:
    """Answer a press that control will read in its next tick; `word` may be from before that."""
    if request.wants_page:
        page = stop_page("Stop demanded", in_words(word))
        return _answer(request, HTTPStatus.OK, page, _HTML)
    told = None if word is None else asdict(word)
    return _json(request, HTTPStatus.OK, {"pressed": True, "control": told})


def not_pressed(request: Request, why: str) -> bytes:
    """Answer a press that did not get through, in a way that nobody overlooks."""
    if request.wants_page:
        page = stop_page("NOT stopped", f"{why}; use the emergency stop button on the robot")
        return _answer(request, HTTPStatus.SERVICE_UNAVAILABLE, page, _HTML)
    hint = "use the emergency stop button on the robot"
    return _error(request, HTTPStatus.SERVICE_UNAVAILABLE, "not_pressed", why, hint)


def looked(request: Request, word: ControlWord | None) -> bytes:
    """Answer everything that is no press: the page, a preflight, or what is not here."""
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
    return _answer(request, HTTPStatus.OK, stop_page("Stop the robot", in_words(word)), _HTML)


def refused(status: HTTPStatus, what: str) -> bytes:
    """Answer what cannot be read as a request."""
    return _error(Request(method="", path=""), status, "bad_request", what, _STOP_HERE)


def _error(
    request: Request,
    status: HTTPStatus,
    code: str,
    what: str,
    hint: str,
    headers: dict[str, str] | None = None,
) -> bytes:
    return _json(request, status, {"error": {"code": code, "what": what, "try": hint}}, headers)


def _json(
    request: Request,
    status: HTTPStatus,
    document: dict[str, Any],
    headers: dict[str, str] | None = None,
) -> bytes:
    return _answer(request, status, json.dumps(document), _JSON, headers)


def _answer(
    request: Request,
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


def _cross_origin(request: Request) -> dict[str, str]:
    """Let the dashboard's page, which is another port of this host, press and read the answer."""
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
