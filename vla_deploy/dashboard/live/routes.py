"""Answer what the robot is made of, where it lives, and what it sees at this moment."""

from http import HTTPStatus
from typing import Any, Final

from fastapi import APIRouter, Depends, Request, Response

from vla_deploy.dashboard.access import UserRole, require
from vla_deploy.dashboard.errors import ApiError
from vla_deploy.dashboard.live.camera import CameraFeed
from vla_deploy.dashboard.live.still import Still
from vla_deploy.navigation.errors import MapInvalid

router = APIRouter(tags=["robot"], dependencies=[Depends(require(UserRole.VIEWER))])

_UNCHANGED_S: Final = 60
_KEPT: Final = {"cache-control": f"private, max-age={_UNCHANGED_S}"}
_PICTURES: Final[dict[int | str, dict[str, Any]]] = {
    200: {"content": {"image/png": {}, "image/jpeg": {}}},
    404: {"description": "there is none"},
}


@router.get("/robot/model")
def model(request: Request) -> dict[str, Any]:
    """Return the robot's links, joints and shapes, and its safety zones, in the base frame."""
    return _still(request).model


@router.get("/map")
def floor(request: Request) -> dict[str, Any]:
    """Return where the map's picture lies (its lower left corner), places and keep-out zones."""
    try:
        return _still(request).map
    except MapInvalid as error:
        raise _no_map(error) from error


@router.get("/map.png", response_class=Response, responses=_PICTURES)
def floor_picture(request: Request) -> Response:
    """Return the map's picture: black is blocked, white is free, grey is unknown."""
    try:
        return Response(_still(request).map_png, media_type="image/png", headers=_KEPT)
    except MapInvalid as error:
        raise _no_map(error) from error


@router.get("/camera.jpg", response_class=Response, responses=_PICTURES)
async def camera(request: Request) -> Response:
    """Return the newest picture of the head's camera."""
    feed: CameraFeed = request.app.state.camera
    picture = feed.newest()
    if picture is None:
        what = "the camera has given no picture yet"
        raise ApiError(HTTPStatus.NOT_FOUND, "no_picture", what, "vla-deploy status")
    headers = {"cache-control": "no-store"}
    return Response(picture.jpeg, media_type="image/jpeg", headers=headers)


def _still(request: Request) -> Still:
    still: Still = request.app.state.still
    return still


def _no_map(error: MapInvalid) -> ApiError:
    return ApiError(HTTPStatus.NOT_FOUND, "no_map", str(error), "vla-deploy map check")
