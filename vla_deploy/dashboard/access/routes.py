"""Log in and out, return the own identity and the audit log."""

from typing import Annotated, Any, Final, Literal

from fastapi import APIRouter, Depends, Query, Request, Response
from pydantic import BaseModel, ConfigDict, Field

from vla_deploy.client.access.accounts import UserRole
from vla_deploy.client.access.errors import AccountsUnusable, AuditUnusable
from vla_deploy.client.access.passwords import LONGEST
from vla_deploy.dashboard.access.access_control import AccessControl, accounts_away
from vla_deploy.dashboard.access.audit_middleware import note
from vla_deploy.dashboard.access.guard import Anyone, require
from vla_deploy.dashboard.access.request import read_request
from vla_deploy.dashboard.errors import AccessDenied, Denial

_MOST_ENTRIES: Final = 1000
_ANYONE: Final = [Depends(require(UserRole.ANYONE))]
router = APIRouter(tags=["access"])


class Login(BaseModel):
    """Hold the credentials of a login."""

    model_config = ConfigDict(extra="forbid", strict=True, hide_input_in_errors=True)

    user: Annotated[str, Field(min_length=1, max_length=32)]
    password: Annotated[str, Field(min_length=1, max_length=LONGEST)]


class SessionState(BaseModel):
    """Describe the own identity; changes by cookie repeat `csrf` as header X-CSRF-Token."""

    role: UserRole
    user: str
    way: Literal["none", "loopback", "socket", "session", "token"]
    csrf: str
    login_needed: bool


@router.get("/session")
async def get_session(who: Anyone) -> SessionState:
    """Return the own identity and role."""
    return SessionState(
        role=who.role,
        user=who.user,
        way=who.way.value,
        csrf=who.csrf,
        login_needed=who.role is UserRole.ANYONE,
    )


@router.post("/login", dependencies=_ANYONE)
async def log_in(login: Login, request: Request, response: Response) -> SessionState:
    """Begin a session, whose id only the cookie holds; the browser's previous one ends."""
    access: AccessControl = request.app.state.access
    incoming = read_request(request.scope)
    try:
        is_known = access.logins.knows(login.user)
        # An unknown name may be a password in the wrong field.
        note(request, name=login.user if is_known else "(unknown)")
        session_id, session, role = await access.logins.log_in(
            login.user, login.password, incoming.peer.rate_key
        )
    except AccountsUnusable as error:
        raise accounts_away() from error
    access.sessions.end(access.session_id(incoming))
    response.set_cookie(
        access.cookie_name(),
        session_id,
        secure=access.rules.is_https,
        httponly=True,
        samesite="strict",
    )
    return SessionState(
        role=role, user=login.user, way="session", csrf=session.csrf, login_needed=False
    )


@router.post("/logout", dependencies=_ANYONE)
async def log_out(request: Request, response: Response) -> dict[str, bool]:
    """End the session, if there is one."""
    access: AccessControl = request.app.state.access
    access.sessions.end(access.session_id(read_request(request.scope)))
    response.delete_cookie(
        access.cookie_name(), secure=access.rules.is_https, httponly=True, samesite="strict"
    )
    return {"logged_out": True}


@router.get("/audit", dependencies=[Depends(require(UserRole.ADMIN))])
async def get_audit(
    request: Request, limit: Annotated[int, Query(ge=1, le=_MOST_ENTRIES)] = 100
) -> dict[str, list[dict[str, Any]]]:
    """Return the last audit entries, the newest first."""
    access: AccessControl = request.app.state.access
    try:
        return {"entries": access.audit.newest(limit)}
    except AuditUnusable as error:
        raise AccessDenied(
            Denial.AUDIT_AWAY, str(error), "see the dashboard's log on the robot"
        ) from error
