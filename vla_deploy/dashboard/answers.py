"""Tell every failure of a request in one form: `{"error": {"code", "what", "try"}}`."""

import logging
from collections.abc import Mapping
from http import HTTPStatus
from typing import Any, Final

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from starlette.exceptions import HTTPException

from vla_deploy.dashboard.errors import Refused
from vla_deploy.ipc import BadPayload, IpcError, ReplayOnly

_DESCRIPTION: Final = "see the API's description: /api/v1/openapi.json"
_log = logging.getLogger(__name__)


def error_answer(
    status: int, code: str, what: str, try_: str, headers: Mapping[str, str] | None = None
) -> JSONResponse:
    """Return the answer to a request that failed."""
    content = {"error": {"code": code, "what": what, "try": try_}}
    return JSONResponse(content, status, dict(headers) if headers else None)


def add_error_answers(app: FastAPI) -> None:
    """Answer what the routes raise."""
    app.add_exception_handler(Refused, _refused)
    app.add_exception_handler(RequestValidationError, _invalid)
    app.add_exception_handler(BadPayload, _unfit)
    app.add_exception_handler(ReplayOnly, _replayed)
    app.add_exception_handler(IpcError, _unreachable)
    app.add_exception_handler(HTTPException, _http)
    app.add_exception_handler(Exception, _broken)


async def _refused(_: Request, error: Any) -> JSONResponse:
    return error_answer(error.status, error.code, error.what, error.try_)


async def _invalid(_: Request, error: Any) -> JSONResponse:
    faults = [
        f"{'.'.join(map(str, fault['loc']))}: {fault['msg']}" for fault in error.errors()[:10]
    ]
    return error_answer(
        HTTPStatus.UNPROCESSABLE_ENTITY, "invalid", "; ".join(faults)[:2000], _DESCRIPTION
    )


async def _unfit(_: Request, error: Any) -> JSONResponse:
    return error_answer(
        HTTPStatus.UNPROCESSABLE_ENTITY, "unfit", str(error), "send plain text, and less of it"
    )


async def _replayed(_: Request, error: Any) -> JSONResponse:
    return error_answer(HTTPStatus.CONFLICT, "replay", str(error), "look only; no robot is here")


async def _unreachable(_: Request, error: Any) -> JSONResponse:
    return error_answer(
        HTTPStatus.SERVICE_UNAVAILABLE, "robot_unreachable", str(error), "vla-deploy status"
    )


async def _http(_: Request, error: Any) -> JSONResponse:
    status = HTTPStatus(error.status_code)
    code = status.phrase.lower().replace(" ", "_")
    return error_answer(status, code, str(error.detail), _DESCRIPTION, error.headers)


async def _broken(request: Request, error: Any) -> JSONResponse:
    # Starlette raises the error again after this answer; the server's log gets the traceback.
    _log.error("%s %s failed: %r", request.method, request.url.path, error)
    return error_answer(
        HTTPStatus.INTERNAL_SERVER_ERROR,
        "broken",
        "the dashboard failed",
        "vla-deploy logs dashboard",
    )
