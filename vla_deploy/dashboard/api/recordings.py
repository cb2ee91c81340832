"""List, hand out, begin and end recordings."""

from http import HTTPStatus
from typing import Annotated, Any, Final

from fastapi import APIRouter, Depends, Request
from fastapi.responses import FileResponse
from pydantic import BaseModel, ConfigDict, Field

from vla_deploy.dashboard.access import UserRole, require
from vla_deploy.dashboard.api.files import described, handed_out
from vla_deploy.dashboard.errors import ApiError
from vla_deploy.telemetry.errors import RecordingRefused
from vla_deploy.telemetry.recording.folder import RecordingFolder, recordings_dir_of
from vla_deploy.telemetry.recording.recording_file import ALL_CHANNELS
from vla_deploy.telemetry.recording.request import LONGEST_S, STOP, RecordingWish, checked

router = APIRouter(tags=["recordings"])

_STATUS_AGE_S: Final = 3.0
_Viewer: Final = Depends(require(UserRole.VIEWER))
_Operator: Final = Depends(require(UserRole.OPERATOR))
_Pattern = Annotated[str, Field(min_length=1, max_length=60)]


class Wanted(BaseModel):
    """Say what is to be recorded; names with `*`, `?` and `[...]`."""

    model_config = ConfigDict(extra="forbid")

    topics: Annotated[list[_Pattern], Field(min_length=1, max_length=50)] = ["*"]
    without: Annotated[list[_Pattern], Field(max_length=50)] = []
    duration_s: Annotated[float | None, Field(gt=0, le=LONGEST_S)] = None
    label: Annotated[str, Field(pattern=r"^[a-z0-9_]{1,40}$")] = "recording"


class Asked(BaseModel):
    """Say that the recorder was asked; GET /recordings/status tells what it does."""

    asked: bool = True


@router.get("/recordings", dependencies=[_Viewer])
def recordings(request: Request) -> list[dict[str, Any]]:
    """Return the finished recordings, the newest first."""
    return described(reversed(_folder(request).files()))


@router.get("/recordings/status", dependencies=[_Viewer])
def status(request: Request) -> dict[str, Any]:
    """Return what the recorder is doing; state "silent" where it says nothing."""
    told: dict[str, Any] | None = request.app.state.link.document("recording_status", _STATUS_AGE_S)
    return {"state": "silent"} if told is None else told


@router.get("/recordings/{name}", response_class=FileResponse, dependencies=[_Viewer])
def recording(name: str, request: Request) -> FileResponse:
    """Return a recording's MCAP file."""
    return handed_out(name, _folder(request).files(), "see GET /api/v1/recordings")


@router.post("/recordings", dependencies=[_Operator])
def start(request: Request, wanted: Wanted | None = None) -> Asked:
    """Ask the recorder to begin a recording; one that is being made ends."""
    link = request.app.state.link
    asked = wanted or Wanted()
    try:
        wish = checked(
            RecordingWish(
                topics=tuple(asked.topics),
                without=tuple(asked.without),
                duration_s=asked.duration_s,
                label=asked.label,
                source=link.source,
            ),
            [channel.topic for channel in ALL_CHANNELS],
        )
    except RecordingRefused as refusal:
        raise ApiError(
            HTTPStatus.UNPROCESSABLE_ENTITY,
            "no_such_topic",
            str(refusal),
            "names as in vla-deploy record topics",
        ) from refusal
    link.publish("recording_request", wish.document())
    return Asked()


@router.post("/recordings/stop", dependencies=[_Operator])
def stop(request: Request) -> Asked:
    """Ask the recorder to end its recording."""
    link = request.app.state.link
    link.publish("recording_request", {"act": STOP, "source": link.source})
    return Asked()


def _folder(request: Request) -> RecordingFolder:
    return RecordingFolder(recordings_dir_of(request.app.state.link.base))
