"""Name where a point of the map is: in which room, or near which place."""

import cv2
import numpy as np

from vla_deploy.robots.floor_pose import Pose2D
from vla_deploy.skills.context import SkillContext, spoken


def room_at(context: SkillContext, x_m: float, y_m: float) -> str:
    """Return the place whose floor holds a point of the map, "" where none does."""
    for name, place in context.robot.places.items():
        floor = np.array(place.floor_m, dtype=np.float32)
        if len(floor) and cv2.pointPolygonTest(floor, (x_m, y_m), measureDist=False) >= 0.0:
            return name
    return ""


def where_words(context: SkillContext, x_m: float, y_m: float) -> str:
    """Return where a point of the map is, as it is said; "" where the robot knows no place."""
    room, places, here = room_at(context, x_m, y_m), context.robot.places, Pose2D(x_m, y_m, 0.0)
    if room:
        return f"in the {spoken(room)}"
    nearest = min(places, key=lambda name: places[name].pose.distance_m(here), default="")
    return f"near the {spoken(nearest)}" if nearest else ""
