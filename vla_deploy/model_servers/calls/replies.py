"""Judge a reply by its status: an answer, a refusal, or a failure that may pass."""

import re
from collections.abc import Iterator
from datetime import datetime
from email.utils import parsedate_to_datetime
from typing import Any, Final
from urllib.parse import urlsplit

from vla_deploy.model_servers.calls.exchange import ServerReply
from vla_deploy.model_servers.credentials import Secret
from vla_deploy.model_servers.errors import AnswerMalformed, ServerFailed, ServerRefused
from vla_deploy.model_servers.formats.base import Json
from vla_deploy.model_servers.json_answer import strict_json
from vla_deploy.model_servers.settings import ServerSettings
from vla_deploy.runtime.one_line import one_line

_PASSING: Final = frozenset({408, 425, 429})
# Servers repeat a wrong key, or the half of it, in what they say about it.
_ABOUT_KEYS: Final = frozenset({401, 403})
# A rate limit passes; money that is spent does not come back by waiting.
_SPENT: Final = frozenset(
    {"insufficient_quota", "credit_balance_exhausted", "enforced_spend_limit_reached"}
)
_REASON_CHARACTERS: Final = 200
_SECONDS: Final = re.compile(r"\d{1,9}(\.\d{1,9})?")


def document_of(reply: ServerReply, settings: ServerSettings, key: Secret | None) -> Json:
    """Return the JSON object that a server answers with.

    Raises:
        ServerRefused: it will not answer this request, or points elsewhere.
        ServerFailed: it cannot answer now.
        AnswerMalformed: what it sends is no JSON object.
    """
    if 200 <= reply.status < 300:
        return _object(reply)
    if 300 <= reply.status < 400:
        raise ServerRefused(_elsewhere(reply, settings), reply.status)
    said = _said(reply, key)
    message = f"{settings.url}: HTTP {reply.status}{said}"
    spent = not _SPENT.isdisjoint(_codes(_error(reply)))
    if reply.status >= 500 or (reply.status in _PASSING and not spent):
        raise ServerFailed(message, reply.status, retry_after_s(reply))
    raise ServerRefused(message + _remedy(reply.status, settings), reply.status)


def retry_after_s(reply: ServerReply) -> float | None:
    """Return how long the server asks to be left alone; a date counts from the reply's own."""
    text = reply.headers.get("retry-after", "").strip()
    if _SECONDS.fullmatch(text):
        return float(text)
    until, now = _date(text), _date(reply.headers.get("date", ""))
    if until is None or now is None:
        return None
    return max(0.0, (until - now).total_seconds())


def _object(reply: ServerReply) -> Json:
    try:
        found = strict_json(reply.body.decode("utf-8"))
    except ValueError as error:
        raise AnswerMalformed(f"expected JSON from the server: {error!s:.120}") from error
    if not isinstance(found, dict):
        raise AnswerMalformed(f"expected a JSON object from the server, got {found!r:.60}")
    return found


def _elsewhere(reply: ServerReply, settings: ServerSettings) -> str:
    parts = urlsplit(reply.headers.get("location", ""))
    target = f"{parts.scheme}://{parts.netloc.rpartition('@')[2]}" if parts.netloc else "elsewhere"
    return (
        f"{settings.url}: HTTP {reply.status} points to {target:.120}; that is not followed. "
        "If it is right, declare that url"
    )


def _said(reply: ServerReply, key: Secret | None) -> str:
    if reply.status in _ABOUT_KEYS:
        return ""
    error = _error(reply)
    text = error.get("message", error.get("error", error.get("detail", "")))
    told = one_line(text)
    told = told if key is None else key.hidden_in(told)
    return f": {told[:_REASON_CHARACTERS]}" if told else ""


def _error(reply: ServerReply) -> dict[str, Any]:
    """Return the object that describes an error, empty where there is none."""
    try:
        document = _object(reply)
    except AnswerMalformed:
        return {}
    inner = document.get("error")
    return inner if isinstance(inner, dict) else document


def _codes(error: dict[str, Any]) -> Iterator[str]:
    details = error.get("details")
    for table in (error, details if isinstance(details, dict) else {}):
        yield from (str(table[name]) for name in ("type", "code", "error_code") if name in table)


def _remedy(status: int, settings: ServerSettings) -> str:
    if status in _ABOUT_KEYS:
        named = f"credential {settings.credential}" if settings.credential else "no credential"
        return f": it refuses the key ({named})"
    return f"; look at url and model ({settings.model})" if status == 404 else ""


def _date(text: str) -> datetime | None:
    try:
        return parsedate_to_datetime(text)
    except ValueError:
        return None
