"""Answer which platform profile is in force and how others differ; request another one."""

import uuid
from http import HTTPStatus
from typing import Annotated, Any, Final

from fastapi import APIRouter, Depends, Request
from pydantic import BaseModel, ConfigDict, Field

from platforms.errors import ProfileError
from platforms.profile import profile_names
from platforms.profile_source import flat, read_source
from vla_deploy.client.link import RobotLink
from vla_deploy.dashboard.access import UserRole, note, require
from vla_deploy.dashboard.errors import ApiError
from vla_deploy.ipc import topics
from vla_deploy.ipc.payloads.supervision import ProfileStatus
from vla_deploy.supervisor.profiles.profile_choice import detect

router = APIRouter(prefix="/profile", tags=["profile"])

_Viewer: Final = Depends(require(UserRole.VIEWER))
_TO_INHERIT_FROM: Final = "base"


class ProfileBody(BaseModel):
    """Name the requested profile; `dry_run` prepares everything and changes nothing."""

    model_config = ConfigDict(extra="forbid")

    name: Annotated[str, Field(max_length=4096)]
    may_restart: bool = False
    dry_run: bool = False


class ProfileRequested(BaseModel):
    """Hold the request's id, which `profile_status` has as `last.request_id` after its end."""

    request_id: str


@router.get("", dependencies=[_Viewer])
def profile(request: Request) -> dict[str, Any]:
    """Return the profile in force with a current change, the fitting one, and all available."""
    name, why = detect()
    current = _profile_status(request)
    return {
        "current": current,
        "detected": {"name": name, "why": why},
        "available": [
            {"name": one, "inherits": _parents(one), "fits": one == name} for one in _names(current)
        ],
    }


@router.get("/{name:path}/difference", dependencies=[_Viewer])
def difference(name: str, request: Request) -> dict[str, Any]:
    """Return the keys in which the named profile differs from the one in force, with both values.

    Raises:
        ApiError: there is no such profile, the supervisor is silent, or a profile's file cannot be
            read, as after it was moved.
    """
    status = _profile_status(request)
    _check(name, status)
    if status is None:
        raise ApiError(
            HTTPStatus.SERVICE_UNAVAILABLE,
            "no_profile",
            "the supervisor does not tell which profile is in force",
            "vla-deploy status",
        )
    mine, its = (_values(one) for one in (status["profile"], name))
    keys = sorted(key for key in mine | its if mine.get(key) != its.get(key))
    return {
        "current": status["profile"],
        "name": name,
        "keys": {key: {"current": mine.get(key), "wanted": its.get(key)} for key in keys},
    }


@router.post("", status_code=HTTPStatus.ACCEPTED, dependencies=[Depends(require(UserRole.ADMIN))])
async def use(body: ProfileBody, request: Request) -> ProfileRequested:
    """Request another profile; the robot returns to the old one by itself if it fails."""
    _check(body.name, _profile_status(request))
    request_id = uuid.uuid4().hex
    link: RobotLink = request.app.state.link
    link.writer(topics.PROFILE_REQUEST).publish(
        {
            "request_id": request_id,
            "profile": body.name,
            "allow_restart": body.may_restart,
            "dry_run": body.dry_run,
        }
    )
    note(request, profile=body.name, dry_run=body.dry_run)
    return ProfileRequested(request_id=request_id)


def _profile_status(request: Request) -> ProfileStatus | None:
    link: RobotLink = request.app.state.link
    return link.document(topics.PROFILE_STATUS, age_limit_s=3.0)


def _parents(name: str) -> tuple[str, ...]:
    try:
        return read_source(name).parents
    except ProfileError:  # a custom file that is missing or broken: `difference` says why
        return ()


def _values(name: str) -> dict[str, Any]:
    try:
        return dict(flat(read_source(name).values))
    except ProfileError as error:
        raise ApiError(
            HTTPStatus.CONFLICT, "profile_unreadable", str(error), f"vla-deploy profile show {name}"
        ) from error


def _names(status: ProfileStatus | None) -> list[str]:
    """Return the shipped profiles, and the custom one with which the run began."""
    shipped = [name for name in profile_names() if not name.endswith(_TO_INHERIT_FROM)]
    begun_with = "" if status is None else status["begun_with"]
    return shipped if begun_with in ("", *shipped) else [begun_with, *shipped]


def _check(name: str, status: ProfileStatus | None) -> None:
    """Accept only offered names: a path could read any file."""
    names = _names(status)
    if name not in names:
        raise ApiError(
            HTTPStatus.NOT_FOUND,
            "no_such_profile",
            f"no profile {name!r:.120}; there are {', '.join(names)}",
            "see GET /api/v1/profile",
        )
