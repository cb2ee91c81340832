"""Answer the robot's links and zones, its map, and the newest camera image."""

from dataclasses import asdict
from functools import cached_property
from http import HTTPStatus
from typing import Any, Final

import cv2
from fastapi import APIRouter, Depends, Request, Response
from fastapi.encoders import jsonable_encoder
from fastapi.responses import JSONResponse

from vla_deploy.dashboard.access import UserRole, require
from vla_deploy.dashboard.errors import ApiError
from vla_deploy.dashboard.live.camera import CameraFeed
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.errors import MapInvalid
from vla_deploy.robots.kinematics.kinematic_tree import KinematicTree
from vla_deploy.robots.kinematics.tree_reader import read_tree
from vla_deploy.robots.maps.map_file import MapFile, read_map_file

_DIGITS: Final = 6
router = APIRouter(tags=["robot"], dependencies=[Depends(require(UserRole.VIEWER))])
_UNCHANGED_S: Final = 60
_KEPT: Final = {"cache-control": f"private, max-age={_UNCHANGED_S}"}
_PICTURES: Final[dict[int | str, dict[str, Any]]] = {
    200: {"content": {"image/png": {}, "image/jpeg": {}}},
    404: {"description": "there is none"},
}


class StaticModel:
    """Hold a robot's description and map in the forms that a page draws; made on first use."""

    def __init__(self, robot: RobotDescription) -> None:
        self.robot = robot

    @cached_property
    def tree(self) -> KinematicTree:
        """Return the robot's links."""
        return read_tree(self.robot.mjcf_path)

    @cached_property
    def model(self) -> dict[str, Any]:
        """Return links and safety zones, all in the base frame.

        Wheels have no entry in the joint arrays: they are drawn at zero.
        """
        robot, base = self.robot, self.robot.parts.base
        return {
            "name": robot.name,
            "joint_names": robot.joint_names,
            "footprint_m": base.footprint_radius_m if base else 0.0,
            "links": [_rounded(asdict(link)) for link in self.tree.links],
            "zones": [
                {"name": zone.name, "kind": zone.kind, "polygon_m": zone.polygon_m}
                for zone in robot.protection.zones
            ],
        }

    @cached_property
    def map(self) -> dict[str, Any]:
        """Return the position of the map's image, and its places and zones.

        Raises:
            MapInvalid: the robot's map cannot be used.
            PartMissing: the robot has no home.
        """
        home, (height, width) = self.robot.home, self._map_file.shades.shape
        return {
            "resolution_m": self._map_file.resolution_m,
            "origin": self._map_file.origin_m,
            "width": width,
            "height": height,
            "places": [
                {"name": one.name, "aliases": one.aliases, **asdict(one.pose)}
                for one in home.places.values()
            ],
            "keep_out": [asdict(zone) for zone in home.zones],
        }

    @cached_property
    def model_json(self) -> bytes:
        """Return the model as it is sent, written once."""
        return _as_json(self.model)

    @cached_property
    def map_json(self) -> bytes:
        """Return the map as it is sent, written once.

        Raises:
            MapInvalid: the robot's map cannot be used.
            PartMissing: the robot has no home.
        """
        return _as_json(self.map)

    @cached_property
    def map_png(self) -> bytes:
        """Return the map's shades; the first row is the northernmost.

        Raises:
            MapInvalid: the robot's map cannot be used.
        """
        _, png = cv2.imencode(".png", self._map_file.shades)
        return png.tobytes()

    @cached_property
    def _map_file(self) -> MapFile:
        return read_map_file(self.robot.home.map_path)


def _rounded(value: Any) -> Any:
    """Return a document with all numbers rounded."""
    if isinstance(value, dict):
        return {key: _rounded(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_rounded(one) for one in value]
    return round(value, _DIGITS) if isinstance(value, float) else value


@router.get("/robot/model", response_model=dict[str, Any])
def model(request: Request) -> Response:
    """Return the robot's links, joints and shapes, and its safety zones, in the base frame."""
    return _written(_model(request).model_json)


@router.get("/map", response_model=dict[str, Any])
def floor(request: Request) -> Response:
    """Return the lower left corner of the map's image, places and keep-out zones."""
    try:
        return _written(_model(request).map_json)
    except MapInvalid as error:
        raise _no_map(error) from error


@router.get("/map.png", response_class=Response, responses=_PICTURES)
def floor_picture(request: Request) -> Response:
    """Return the map's image: black is blocked, white is free, grey is unknown."""
    try:
        return Response(_model(request).map_png, media_type="image/png", headers=_KEPT)
    except MapInvalid as error:
        raise _no_map(error) from error


@router.get("/camera.jpg", response_class=Response, responses=_PICTURES)
async def camera(request: Request) -> Response:
    """Return the newest image of the head's camera."""
    feed: CameraFeed = request.app.state.camera
    picture = feed.newest()
    if picture is None:
        what = "the camera has given no picture yet"
        raise ApiError(HTTPStatus.NOT_FOUND, "no_picture", what, "vla-deploy status")
    headers = {"cache-control": "no-store"}
    return Response(picture.jpeg, media_type="image/jpeg", headers=headers)


def _as_json(document: dict[str, Any]) -> bytes:
    return bytes(JSONResponse(jsonable_encoder(document)).body)


def _written(document: bytes) -> Response:
    return Response(document, media_type="application/json")


def _model(request: Request) -> StaticModel:
    model: StaticModel = request.app.state.static_model
    return model


def _no_map(error: MapInvalid) -> ApiError:
    return ApiError(HTTPStatus.NOT_FOUND, "no_map", str(error), "vla-deploy map check")
