"""Find where named places and things are, in the map's frame."""

from collections.abc import Mapping, Sequence
from typing import Any, Final

from vla_deploy.client.link import RobotLink
from vla_deploy.ipc import topics
from vla_deploy.robots import RobotDescription
from vla_deploy.world import (
    SceneUnreadable,
    Snapshot,
    UnknownWord,
    find,
    parse_query,
    read_snapshot,
)

SCENE_AGE_S: Final = 2.0
NEAR_M: Final = 1.5
"""How near a named place must be to say that the robot is there."""


class Locator:
    """Look things up in the scene, and places in the robot file."""

    def __init__(self, link: RobotLink, robot: RobotDescription) -> None:
        self._link = link
        self._places = {
            name.lower().replace("_", " "): place
            for place in robot.home.places.values()
            for name in (place.name, *place.aliases)
        }

    def where(self, name: str) -> Sequence[float] | None:
        """Return x, y, z of a place or of the best known thing of that name, else None."""
        place = self._places.get(name.lower().replace("_", " "))
        if place is not None:
            return (place.pose.x_m, place.pose.y_m, 0.0)
        snapshot = self.snapshot()
        if snapshot is None or not name:
            return None
        try:
            found = find(parse_query(name), snapshot)
        except UnknownWord:
            return None  # words that the scene has no thing for: their place is not known
        return found[0].position_m if found else None

    def snapshot(self) -> Snapshot | None:
        """Return the scene, None where perception is silent or tells something else."""
        document = self.scene()
        try:
            return None if document is None else read_snapshot(document)
        except SceneUnreadable:
            return None

    def scene(self) -> Mapping[str, Any] | None:
        """Return the scene's document, None where perception is silent."""
        return self._link.document(topics.SCENE, SCENE_AGE_S)

    def place_at(self, x_m: float, y_m: float) -> str:
        """Return the named place that is nearest, "" where none is near."""
        distances = {
            place.name: ((place.pose.x_m - x_m) ** 2 + (place.pose.y_m - y_m) ** 2) ** 0.5
            for place in self._places.values()
        }
        nearest = min(distances, key=lambda name: distances[name], default="")
        return nearest if nearest and distances[nearest] <= NEAR_M else ""

    def places(self) -> dict[str, list[float]]:
        """Return every place by its name: x, y in m, yaw in rad."""
        return {
            place.name: [place.pose.x_m, place.pose.y_m, place.pose.yaw_rad]
            for place in self._places.values()
        }
