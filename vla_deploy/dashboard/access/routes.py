"""Log in and out, return the own identity and the audit log."""

from typing import Annotated, Any, Final, Literal

from fastapi import APIRouter, Depends, Query, Request, Response
from pydantic import BaseModel, ConfigDict, Field

from vla_deploy.client.access.accounts import UserRole
from vla_deploy.client.access.errors import AccountsUnusable, AuditUnusable
from vla_deploy.client.access.local_token import LOCAL
from vla_deploy.client.access.passwords import LONGEST
from vla_deploy.dashboard.access.access_control import AccessControl, accounts_away
from vla_deploy.dashboard.access.audit_middleware import note
from vla_deploy.dashboard.access.guard import Admin, Anyone, require
from vla_deploy.dashboard.access.identity import AuthMethod, Identity
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
    return _state_of(who)


def _state_of(who: Identity) -> SessionState:
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
    _hand_over(access, request, response, session_id)
    return SessionState(
        role=role, user=login.user, way="session", csrf=session.csrf, login_needed=False
    )


class LinkCode(BaseModel):
    """Hold the code of a link for a login, which counts once."""

    model_config = ConfigDict(extra="forbid", strict=True, hide_input_in_errors=True)

    code: Annotated[str, Field(min_length=1, max_length=64)]


@router.post("/login/link")
async def make_link(request: Request, who: Admin) -> LinkCode:
    """Return the code of a new link for the robot's own user: `/#/login/CODE`, valid for 10 min."""
    access: AccessControl = request.app.state.access
    if who.way is not AuthMethod.SOCKET and who.user != f"token:{LOCAL}":
        raise AccessDenied(
            Denial.ROLE_TOO_LOW,
            f"{who.user} is not the robot's own user",
            "on the robot, as the user whom it runs as: vla-deploy dashboard",
        )
    return LinkCode(code=access.links.issue())


@router.post("/login/code", dependencies=_ANYONE)
async def follow_link(link: LinkCode, request: Request, response: Response) -> SessionState:
    """Begin a session of the robot's own user, whose id only the cookie holds."""
    access: AccessControl = request.app.state.access
    session_id, identity = access.begin_local(link.code)
    note(request, name=identity.user)
    _hand_over(access, request, response, session_id)
    return _state_of(identity)


def _hand_over(access: AccessControl, request: Request, response: Response, new_id: str) -> None:
    """Replace the browser's session by a new one."""
    access.end_session(access.session_id(read_request(request.scope)))
    response.set_cookie(
        access.cookie_name(),
        new_id,
        secure=access.rules.is_https,
        httponly=True,
        samesite="strict",
    )


@router.post("/logout", dependencies=_ANYONE)
async def log_out(request: Request, response: Response) -> dict[str, bool]:
    """End the session, if there is one."""
    access: AccessControl = request.app.state.access
    access.end_session(access.session_id(read_request(request.scope)))
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
