"""List and serve flights and recordings; control the recorder and the replay."""

import contextlib
from collections.abc import Iterable
from http import HTTPStatus
from pathlib import Path
from typing import Annotated, Any, Final, Literal

from fastapi import APIRouter, Depends, Request
from fastapi.responses import FileResponse
from pydantic import BaseModel, ConfigDict, Field

from vla_deploy.client.link import RobotLink
from vla_deploy.dashboard.access import UserRole, require
from vla_deploy.dashboard.errors import ApiError
from vla_deploy.ipc import topics
from vla_deploy.telemetry.errors import RecordingRefused
from vla_deploy.telemetry.folder import FlightFolder, folder_of
from vla_deploy.telemetry.recording.folder import RecordingFolder, recordings_dir_of
from vla_deploy.telemetry.recording.recording_file import ALL_CHANNELS
from vla_deploy.telemetry.recording.request import LONGEST_S, STOP, RecordingRequest, checked

router = APIRouter(tags=["recordings"])
replay_router = APIRouter(tags=["replay"])

MCAP: Final = "application/octet-stream"
_STATUS_AGE_S: Final = 3.0
_LATEST_MOMENT_S: Final = 1e9
_Viewer: Final = Depends(require(UserRole.VIEWER))
_Operator: Final = Depends(require(UserRole.OPERATOR))
_Pattern = Annotated[str, Field(min_length=1, max_length=60)]


class RecordingBody(BaseModel):
    """Choose what is recorded: topics by name, with `*`, `?` and `[...]`."""

    model_config = ConfigDict(extra="forbid")

    topics: Annotated[list[_Pattern], Field(min_length=1, max_length=50)] = ["*"]
    without: Annotated[list[_Pattern], Field(max_length=50)] = []
    duration_s: Annotated[float | None, Field(gt=0, le=LONGEST_S)] = None
    label: Annotated[str, Field(pattern=r"^[a-z0-9_]{1,40}$")] = "recording"


class ReplayBody(BaseModel):
    """Control the replay; `value` is a moment in seconds for seek, a factor for speed."""

    model_config = ConfigDict(extra="forbid")

    act: Literal["pause", "resume", "seek", "speed"]
    value: Annotated[float, Field(ge=0, le=_LATEST_MOMENT_S)] = 0.0


class RequestPublished(BaseModel):
    """Confirm that the request was published; the status topic shows what comes of it."""

    asked: bool = True


@router.get("/flights", dependencies=[_Viewer])
def flights(request: Request) -> list[dict[str, Any]]:
    """Return the saved flights, the newest first."""
    return file_entries(reversed(_flights(request)))


@router.get("/flights/{name}", response_class=FileResponse, dependencies=[_Viewer])
def flight(name: str, request: Request) -> FileResponse:
    """Return a flight's MCAP file."""
    return file_response(name, _flights(request), "see GET /api/v1/flights")


def file_entries(paths: Iterable[Path]) -> list[dict[str, Any]]:
    """Return the entries of a list of files; `saved_s` is in Unix seconds.

    A file that is deleted meanwhile is left out.
    """
    entries = []
    for path in paths:
        with contextlib.suppress(FileNotFoundError):
            found = path.stat()
            saved_s = round(found.st_mtime, 3)
            entries.append({"name": path.name, "bytes": found.st_size, "saved_s": saved_s})
    return entries


def file_response(name: str, known: Iterable[Path], where: str) -> FileResponse:
    """Return the file of that name among the known ones: a name is compared, never followed.

    Raises:
        ApiError: there is none.
    """
    for path in known:
        if path.name == name and path.is_file() and not path.is_symlink():
            return FileResponse(path, filename=path.name, media_type=MCAP)
    raise ApiError(HTTPStatus.NOT_FOUND, "no_such_file", f"no file {name!r:.120}", where)


def _flights(request: Request) -> list[Path]:
    return FlightFolder(folder_of(request.app.state.link.base)).files()


@router.get("/recordings", dependencies=[_Viewer])
def recordings(request: Request) -> list[dict[str, Any]]:
    """Return the finished recordings, the newest first."""
    return file_entries(reversed(_folder(request).files()))


@router.get("/recordings/status", dependencies=[_Viewer])
def status(request: Request) -> dict[str, Any]:
    """Return the recorder's status; state "silent" where it publishes none."""
    link = request.app.state.link
    document: dict[str, Any] | None = link.document(topics.RECORDING_STATUS, _STATUS_AGE_S)
    return {"state": "silent"} if document is None else document


@router.get("/recordings/{name}", response_class=FileResponse, dependencies=[_Viewer])
def recording(name: str, request: Request) -> FileResponse:
    """Return a recording's MCAP file."""
    return file_response(name, _folder(request).files(), "see GET /api/v1/recordings")


@router.post("/recordings", dependencies=[_Operator])
def start(request: Request, body: RecordingBody | None = None) -> RequestPublished:
    """Ask the recorder to start a recording; the current one ends."""
    link = request.app.state.link
    wanted = body or RecordingBody()
    try:
        recording = checked(
            RecordingRequest(
                topics=tuple(wanted.topics),
                without=tuple(wanted.without),
                duration_s=wanted.duration_s,
                label=wanted.label,
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
    link.writer(topics.RECORDING_REQUEST).publish(recording.document())
    return RequestPublished()


@router.post("/recordings/stop", dependencies=[_Operator])
def stop(request: Request) -> RequestPublished:
    """Ask the recorder to end its recording."""
    link = request.app.state.link
    link.writer(topics.RECORDING_REQUEST).publish({"act": STOP, "source": link.source})
    return RequestPublished()


def _folder(request: Request) -> RecordingFolder:
    return RecordingFolder(recordings_dir_of(request.app.state.link.base))


@replay_router.post("/replay", dependencies=[_Operator])
def replay(request: Request, body: ReplayBody) -> RequestPublished:
    """Ask the replay; 409 where a robot runs."""
    link: RobotLink = request.app.state.link
    if link.document(topics.REPLAY_STATUS, _STATUS_AGE_S) is None:
        raise ApiError(
            HTTPStatus.CONFLICT,
            "no_replay",
            "nothing is replayed here",
            "begin one: vla-deploy replay FILE",
        )
    link.writer(topics.REPLAY_REQUEST).publish({"act": body.act, "value": body.value})
    return RequestPublished()
