"""Answer every failure of a request in one form: `{"error": {"code", "what", "try"}}`.

ApiError            a route cannot do what was requested
└── AccessDenied    the request is refused before or instead of its route; nothing was done
"""

import logging
from collections.abc import Mapping
from enum import Enum
from functools import partial
from http import HTTPStatus
from math import ceil
from typing import Any, Final

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from starlette.exceptions import HTTPException

from vla_deploy.ipc import BadPayload, IpcError, ReplayOnly
from vla_deploy.robots.errors import PartMissing

_DESCRIPTION: Final = "see the API's description: /api/v1/openapi.json"
_IPC_ANSWERS: Final[Mapping[type[IpcError], tuple[HTTPStatus, str, str]]] = {
    BadPayload: (HTTPStatus.UNPROCESSABLE_ENTITY, "unfit", "send plain text, and less of it"),
    ReplayOnly: (HTTPStatus.CONFLICT, "replay", "look only; no robot is here"),
    IpcError: (HTTPStatus.SERVICE_UNAVAILABLE, "robot_unreachable", "vla-deploy status"),
}
_log = logging.getLogger(__name__)


class ApiError(Exception):
    """Refuse a request: HTTP status, a code for programs, what is wrong, what to try."""

    def __init__(self, status: HTTPStatus, code: str, what: str, hint: str) -> None:
        super().__init__(what)
        self.status = status
        self.code = code
        self.what = what
        self.hint = hint


class Denial(Enum):
    """Name why access is denied: HTTP status and code."""

    LOGIN_NEEDED = HTTPStatus.UNAUTHORIZED, "login_needed"
    LOGIN_FAILED = HTTPStatus.UNAUTHORIZED, "login_failed"
    LINK_REFUSED = HTTPStatus.UNAUTHORIZED, "link_refused"
    TOKEN_REFUSED = HTTPStatus.UNAUTHORIZED, "token_refused"
    ROLE_TOO_LOW = HTTPStatus.FORBIDDEN, "role_too_low"
    ORIGIN_REFUSED = HTTPStatus.FORBIDDEN, "origin_refused"
    CSRF_REFUSED = HTTPStatus.FORBIDDEN, "csrf_refused"
    HOST_REFUSED = HTTPStatus.MISDIRECTED_REQUEST, "host_refused"
    BODY_REFUSED = HTTPStatus.BAD_REQUEST, "body_refused"
    BODY_TOO_LARGE = HTTPStatus.REQUEST_ENTITY_TOO_LARGE, "body_too_large"
    BODY_TOO_SLOW = HTTPStatus.REQUEST_TIMEOUT, "body_too_slow"
    TOO_MANY = HTTPStatus.TOO_MANY_REQUESTS, "too_many"
    TOO_MANY_READS = HTTPStatus.SERVICE_UNAVAILABLE, "too_many_reads"
    ACCOUNTS_AWAY = HTTPStatus.SERVICE_UNAVAILABLE, "accounts_away"
    AUDIT_AWAY = HTTPStatus.SERVICE_UNAVAILABLE, "audit_away"


class AccessDenied(ApiError):
    """Deny a request; `wait_s` is set where only time helps. The audit log records the code."""

    def __init__(self, why: Denial, what: str, hint: str, wait_s: float | None = None) -> None:
        super().__init__(*why.value, what, hint)
        self.why = why
        self.wait_s = wait_s

    @property
    def headers(self) -> dict[str, str]:
        """Return what the answer adds for the client's HTTP library."""
        headers = {}
        if self.wait_s is not None:
            headers["Retry-After"] = str(ceil(self.wait_s))
        if self.why is Denial.LOGIN_NEEDED:
            headers["WWW-Authenticate"] = "Bearer"
        return headers


def error_response(
    status: int, code: str, what: str, hint: str, headers: Mapping[str, str] | None = None
) -> JSONResponse:
    """Return the answer to a request that failed."""
    content = {"error": {"code": code, "what": what, "try": hint}}
    return JSONResponse(content, status, dict(headers) if headers else None)


def denial_response(denied: AccessDenied) -> JSONResponse:
    """Return the answer to a request that was denied."""
    return error_response(denied.status, denied.code, denied.what, denied.hint, denied.headers)


def add_error_handlers(app: FastAPI) -> None:
    """Answer what the routes raise."""
    app.add_exception_handler(ApiError, _refused)
    app.add_exception_handler(RequestValidationError, _invalid)
    for kind, answer in _IPC_ANSWERS.items():
        app.add_exception_handler(kind, partial(_ipc, *answer))
    app.add_exception_handler(PartMissing, _missing)
    app.add_exception_handler(HTTPException, _http)
    app.add_exception_handler(Exception, _broken)


async def _refused(_: Request, error: Any) -> JSONResponse:
    return error_response(error.status, error.code, error.what, error.hint)


async def _invalid(_: Request, error: Any) -> JSONResponse:
    faults = [
        f"{'.'.join(map(str, fault['loc']))}: {fault['msg']}" for fault in error.errors()[:10]
    ]
    return error_response(
        HTTPStatus.UNPROCESSABLE_ENTITY, "invalid", "; ".join(faults)[:2000], _DESCRIPTION
    )


async def _ipc(status: HTTPStatus, code: str, hint: str, _: Request, error: Any) -> JSONResponse:
    return error_response(status, code, str(error), hint)


async def _missing(_: Request, error: Any) -> JSONResponse:
    return error_response(HTTPStatus.NOT_FOUND, "part_missing", str(error), "vla-deploy status")


async def _http(_: Request, error: Any) -> JSONResponse:
    status = HTTPStatus(error.status_code)
    code = status.phrase.lower().replace(" ", "_")
    return error_response(status, code, str(error.detail), _DESCRIPTION, error.headers)


async def _broken(request: Request, error: Any) -> JSONResponse:
    # Starlette raises the error again after this answer; the server's log gets the traceback.
    _log.error("%s %s failed: %r", request.method, request.url.path, error)
    return error_response(
        HTTPStatus.INTERNAL_SERVER_ERROR,
        "broken",
        "the dashboard failed",
        "vla-deploy logs dashboard",
    )
