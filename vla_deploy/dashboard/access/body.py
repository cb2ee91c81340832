"""Read a request's whole body within bounds, before its route."""

import asyncio
import json
from collections.abc import Iterator
from typing import Any, Final, NoReturn

from starlette.types import Message, Receive

from vla_deploy.dashboard.access.request import IncomingRequest
from vla_deploy.dashboard.errors import AccessDenied, Denial

MOST_BYTES: Final = 128 * 1024
"""A plan matches into 64 KiB of shared memory; no request needs more."""
WITHIN_S: Final = 5.0
_MOST_DEPTH: Final = 32
STOP_BYTES: Final = 4096
_STOP_WITHIN_S: Final = 0.1
_REASON_LETTERS: Final = 150


async def read_body(request: IncomingRequest, receive: Receive) -> bytes:
    """Return the body of a change: JSON, or nothing.

    Raises:
        AccessDenied: it has more than 128 KiB, takes more than 5 s, or is no valid JSON.
    """
    if int(_length(request) or 0) > MOST_BYTES:
        _too_large()
    body = await _whole(receive, MOST_BYTES, WITHIN_S)
    if body:
        kind = request.first("content-type").partition(";")[0].strip().lower()
        if kind != "application/json":
            _refuse(f"content-type {kind!r:.60}, expected application/json")
        check_json(body)
    return body


async def read_stop_body(receive: Receive) -> bytes:
    """Return the reason of a stop as JSON; one that is invalid, late or too long is left out."""
    try:
        body = await _whole(receive, STOP_BYTES, _STOP_WITHIN_S)
    except AccessDenied:
        body = b""
    return json.dumps({"reason": reason_in(body)}).encode()


def reason_in(body: bytes) -> str:
    """Return the reason of a stop, "" where the body gives none that can be read."""
    try:
        said = json.loads(body)
    except (ValueError, RecursionError):
        return ""
    given = said.get("reason") if isinstance(said, dict) else None
    reason = given[:_REASON_LETTERS] if isinstance(given, str) else ""
    return reason.encode(errors="replace").decode()


def replay(body: bytes, receive: Receive) -> Receive:
    """Return a channel that gives the body in one message, then the messages after it."""
    pending: list[Message] = [{"type": "http.request", "body": body, "more_body": False}]

    async def next_message() -> Message:
        return pending.pop() if pending else await receive()

    return next_message


def check_json(body: bytes) -> None:
    """Accept JSON of bounded depth, with finite numbers and valid Unicode.

    Raises:
        AccessDenied: it is something else.
    """
    try:
        document = json.loads(body, parse_constant=_no_number)
        for text, depth in _texts(document):
            text.encode()
            if depth > _MOST_DEPTH:
                _refuse(f"JSON nested deeper than {_MOST_DEPTH}")
    except UnicodeError:
        _refuse("text that is not Unicode")
    except RecursionError:
        _refuse(f"JSON nested deeper than {_MOST_DEPTH}")
    except ValueError as error:
        _refuse(f"no JSON: {error}")


def _texts(document: Any) -> Iterator[tuple[str, int]]:
    """Yield every text with its depth, and "" for every other value."""
    left: list[tuple[Any, int]] = [(document, 0)]
    while left:
        value, depth = left.pop()
        yield (value if isinstance(value, str) else ""), depth
        if isinstance(value, dict):
            left.extend((key, depth) for key in value)
            left.extend((one, depth + 1) for one in value.values())
        elif isinstance(value, list):
            left.extend((one, depth + 1) for one in value)


async def _whole(receive: Receive, most_bytes: int, within_s: float) -> bytes:
    body = bytearray()
    try:
        async with asyncio.timeout(within_s):
            more = True
            while more:
                message = await receive()
                if message["type"] != "http.request":  # the client has disconnected
                    break
                body += message.get("body", b"")
                more = message.get("more_body", False)
                if len(body) > most_bytes:
                    _too_large(most_bytes)
    except TimeoutError:
        raise AccessDenied(
            Denial.BODY_TOO_SLOW, f"the body was not there within {within_s:g} s", "send it faster"
        ) from None
    return bytes(body)


def _length(request: IncomingRequest) -> str:
    given = request.first("content-length")
    return given if given.isascii() and given.isdigit() and len(given) < 19 else ""


def _no_number(name: str) -> NoReturn:
    raise ValueError(f"{name} is no number of JSON")


def _too_large(most_bytes: int = MOST_BYTES) -> NoReturn:
    raise AccessDenied(Denial.BODY_TOO_LARGE, f"more than {most_bytes} bytes", "send less")


def _refuse(what: str) -> NoReturn:
    raise AccessDenied(
        Denial.BODY_REFUSED, what, "send one JSON document, as /openapi.json describes it"
    )
