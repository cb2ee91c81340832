"""Log in and out, say who asks, show the audit log."""

from typing import Annotated, Any, Final, Literal

from fastapi import APIRouter, Depends, Query, Request, Response
from pydantic import BaseModel, ConfigDict, Field

from vla_deploy.client.access.accounts import Role
from vla_deploy.client.access.errors import AccountsUnusable, AuditUnusable
from vla_deploy.client.access.passwords import LONGEST
from vla_deploy.dashboard.access.access import Access
from vla_deploy.dashboard.access.asked import asked_of
from vla_deploy.dashboard.access.errors import AccountsAway, AuditAway
from vla_deploy.dashboard.access.requiring import Anyone, require
from vla_deploy.dashboard.access.witness import note

_MOST_ENTRIES: Final = 1000
_ANYONE: Final = [Depends(require(Role.ANYONE))]
router = APIRouter(tags=["access"])


class Login(BaseModel):
    """Hold what a person logs in with."""

    model_config = ConfigDict(extra="forbid", strict=True, hide_input_in_errors=True)

    user: Annotated[str, Field(min_length=1, max_length=32)]
    password: Annotated[str, Field(min_length=1, max_length=LONGEST)]


class SessionTold(BaseModel):
    """Say who asks; changes by cookie repeat `csrf` in the header X-CSRF-Token."""

    role: Role
    user: str
    way: Literal["none", "loopback", "socket", "session", "token"]
    csrf: str
    login_needed: bool


@router.get("/session")
async def get_session(who: Anyone) -> SessionTold:
    """Return who asks, and what they may do."""
    return SessionTold(
        role=who.role,
        user=who.user,
        way=who.way.value,
        csrf=who.csrf,
        login_needed=who.role is Role.ANYONE,
    )


@router.post("/login", dependencies=_ANYONE)
async def log_in(login: Login, request: Request, response: Response) -> SessionTold:
    """Begin a session, whose id only the cookie holds; one that there was ends."""
    access: Access = request.app.state.access
    asked = asked_of(request.scope)
    try:
        is_known = access.logins.knows(login.user)
        note(request, name=login.user if is_known else "(unknown)")  # it may be a password
        session_id, session, role = await access.logins.log_in(
            login.user, login.password, asked.peer.home
        )
    except AccountsUnusable as error:
        raise AccountsAway(
            "the file of accounts cannot be used", "see the dashboard's log on the robot"
        ) from error
    access.sessions.end(access.session_id(asked))
    response.set_cookie(
        access.cookie_name(),
        session_id,
        secure=access.rules.is_https,
        httponly=True,
        samesite="strict",
    )
    return SessionTold(
        role=role, user=login.user, way="session", csrf=session.csrf, login_needed=False
    )


@router.post("/logout", dependencies=_ANYONE)
async def log_out(request: Request, response: Response) -> dict[str, bool]:
    """End the session, if there is one."""
    access: Access = request.app.state.access
    access.sessions.end(access.session_id(asked_of(request.scope)))
    response.delete_cookie(
        access.cookie_name(), secure=access.rules.is_https, httponly=True, samesite="strict"
    )
    return {"logged_out": True}


@router.get("/audit", dependencies=[Depends(require(Role.ADMIN))])
async def get_audit(
    request: Request, limit: Annotated[int, Query(ge=1, le=_MOST_ENTRIES)] = 100
) -> dict[str, list[dict[str, Any]]]:
    """Return the last acts, the newest first."""
    access: Access = request.app.state.access
    try:
        return {"entries": access.audit.newest(limit)}
    except AuditUnusable as error:
        raise AuditAway(str(error), "see the dashboard's log on the robot") from error
