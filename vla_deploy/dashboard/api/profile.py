"""Tell which platform profile is in force and what another would change; ask for another."""

import uuid
from http import HTTPStatus
from typing import Annotated, Any, Final

from fastapi import APIRouter, Depends, Request
from pydantic import BaseModel, ConfigDict, Field

from platforms.errors import ProfileError
from platforms.profile import profile_names
from platforms.profile_source import flat, read_source
from vla_deploy.dashboard.access import UserRole, note, require
from vla_deploy.dashboard.errors import ApiError
from vla_deploy.supervisor.profile_choice import detect

router = APIRouter(prefix="/profile", tags=["profile"])

_Viewer: Final = Depends(require(UserRole.VIEWER))
_TO_INHERIT_FROM: Final = "base"


class Wanted(BaseModel):
    """Name the wanted profile; `dry_run` prepares everything and changes nothing."""

    model_config = ConfigDict(extra="forbid")

    name: Annotated[str, Field(max_length=4096)]
    may_restart: bool = False
    dry_run: bool = False


class Asked(BaseModel):
    """Name the request: `last.request_id` of the topic `profile_status` is this once it ended."""

    request_id: str


@router.get("", dependencies=[_Viewer])
def profile(request: Request) -> dict[str, Any]:
    """Return the profile in force, a change under way, what fits this computer, what there is."""
    name, why = detect()
    current = _told(request)
    return {
        "current": current,
        "detected": {"name": name, "why": why},
        "available": [
            {"name": one, "inherits": _parents(one), "fits": one == name} for one in _names(current)
        ],
    }


@router.get("/{name:path}/difference", dependencies=[_Viewer])
def difference(name: str, request: Request) -> dict[str, Any]:
    """Return per key what is in force and what the named profile says, where they differ.

    Raises:
        ApiError: there is no such profile, nobody tells which one is in force, or a file of theirs
            cannot be read, as that of an own profile that was moved meanwhile.
    """
    told = _told(request)
    _check(name, told)
    if told is None:
        raise ApiError(
            HTTPStatus.SERVICE_UNAVAILABLE,
            "no_profile",
            "the supervisor does not tell which profile is in force",
            "vla-deploy status",
        )
    mine, its = (_values(one) for one in (told["profile"], name))
    keys = sorted(key for key in mine | its if mine.get(key) != its.get(key))
    return {
        "current": told["profile"],
        "name": name,
        "keys": {key: {"current": mine.get(key), "wanted": its.get(key)} for key in keys},
    }


@router.post("", status_code=HTTPStatus.ACCEPTED, dependencies=[Depends(require(UserRole.ADMIN))])
async def use(wanted: Wanted, request: Request) -> Asked:
    """Take the robot to another profile; it goes back by itself when that does not work."""
    _check(wanted.name, _told(request))
    request_id = uuid.uuid4().hex
    request.app.state.link.publish(
        "profile_request",
        {
            "request_id": request_id,
            "profile": wanted.name,
            "allow_restart": wanted.may_restart,
            "dry_run": wanted.dry_run,
        },
    )
    note(request, profile=wanted.name, dry_run=wanted.dry_run)
    return Asked(request_id=request_id)


def _told(request: Request) -> dict[str, Any] | None:
    told: dict[str, Any] | None = request.app.state.link.document("profile_status", age_limit_s=3.0)
    return told


def _parents(name: str) -> tuple[str, ...]:
    try:
        return read_source(name).parents
    except ProfileError:  # an own file that is gone or broken: whoever looks closer is told why
        return ()


def _values(name: str) -> dict[str, Any]:
    try:
        return dict(flat(read_source(name).values))
    except ProfileError as error:
        raise ApiError(
            HTTPStatus.CONFLICT, "profile_unreadable", str(error), f"vla-deploy profile show {name}"
        ) from error


def _names(told: dict[str, Any] | None) -> list[str]:
    """Return the shipped profiles, and the own one that the run has begun with."""
    shipped = [name for name in profile_names() if not name.endswith(_TO_INHERIT_FROM)]
    begun_with = str((told or {}).get("begun_with", ""))
    return shipped if begun_with in ("", *shipped) else [begun_with, *shipped]


def _check(name: str, told: dict[str, Any] | None) -> None:
    """Accept what is offered: any other path would read any file."""
    names = _names(told)
    if name not in names:
        raise ApiError(
            HTTPStatus.NOT_FOUND,
            "no_such_profile",
            f"no profile {name!r:.120}; there are {', '.join(names)}",
            "see GET /api/v1/profile",
        )
