"""Tell which platform profile is in force and what another would change; ask for another."""

import uuid
from http import HTTPStatus
from typing import Annotated, Any, Final

from fastapi import APIRouter, Depends, Request
from pydantic import BaseModel, ConfigDict, Field

from platforms.errors import ProfileError
from platforms.profile import profile_names
from platforms.profile_source import flat, read_source
from vla_deploy.dashboard.access import Role, note, require
from vla_deploy.dashboard.errors import Refused
from vla_deploy.supervisor.profile_choice import detect

router = APIRouter(prefix="/profile", tags=["profile"])

_Viewer: Final = Depends(require(Role.VIEWER))
_TO_INHERIT_FROM: Final = "base"


class Wanted(BaseModel):
    """Name the wanted profile; `dry_run` prepares everything and changes nothing."""

    model_config = ConfigDict(extra="forbid")

    name: Annotated[str, Field(max_length=64)]
    may_restart: bool = False
    dry_run: bool = False


class Asked(BaseModel):
    """Name the request: `last.request_id` of the topic `profile_status` is this once it ended."""

    request_id: str


@router.get("", dependencies=[_Viewer])
def profile(request: Request) -> dict[str, Any]:
    """Return the profile in force, a change under way, what fits this computer, what there is."""
    name, why = detect()
    return {
        "current": request.app.state.link.document("profile_status", age_limit_s=3.0),
        "detected": {"name": name, "why": why},
        "available": [
            {"name": one, "inherits": read_source(one).parents, "fits": one == name}
            for one in _names()
        ],
    }


@router.get("/{name}/difference", dependencies=[_Viewer])
def difference(name: str, request: Request) -> dict[str, Any]:
    """Return per key what is in force and what the named profile says, where they differ.

    Raises:
        Refused: there is no such profile, nobody tells which one is in force, or a file of theirs
            cannot be read, as that of an own profile that was moved meanwhile.
    """
    _check(name)
    told = request.app.state.link.document("profile_status", age_limit_s=3.0)
    if told is None:
        raise Refused(
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


@router.post("", status_code=HTTPStatus.ACCEPTED, dependencies=[Depends(require(Role.ADMIN))])
async def use(wanted: Wanted, request: Request) -> Asked:
    """Take the robot to another profile; it goes back by itself when that does not work."""
    _check(wanted.name)
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


def _values(name: str) -> dict[str, Any]:
    try:
        return dict(flat(read_source(name).values))
    except ProfileError as error:
        raise Refused(
            HTTPStatus.CONFLICT, "profile_unreadable", str(error), f"vla-deploy profile show {name}"
        ) from error


def _names() -> list[str]:
    return [name for name in profile_names() if not name.endswith(_TO_INHERIT_FROM)]


def _check(name: str) -> None:
    """Accept the name of a shipped profile: a path in its place would read any file."""
    if name not in _names():
        raise Refused(
            HTTPStatus.NOT_FOUND,
            "no_such_profile",
            f"no profile {name!r:.120}; there are {', '.join(_names())}",
            "see GET /api/v1/profile",
        )
