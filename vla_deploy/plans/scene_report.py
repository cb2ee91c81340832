"""Report on the things around a robot: all of them, or those that some words mean."""

from typing import Any

from vla_deploy.ipc.payloads.scene import SceneDocument
from vla_deploy.navigation.path_planning import base_planner
from vla_deploy.plans.knowledge import spoken_places
from vla_deploy.robots import RobotDescription
from vla_deploy.world import Body, Viewpoint, parse_query, read_snapshot
from vla_deploy.world.document import report
from vla_deploy.world.surfaces import furniture_points


def scene_report(
    document: SceneDocument,
    robot: RobotDescription,
    now_ns: int,
    words: str = "",
    view: Viewpoint | None = None,
) -> dict[str, Any]:
    """Return what is known of things; `words` choose, such as "small cup on the coffee table".

    Raises:
        UnknownWord: the words have one that means nothing.
    """
    snapshot = read_snapshot(document, now_ns)
    query = parse_query(words, spoken_places(robot.places))
    body = Body.of(robot, base_planner(robot).is_free)
    return report(snapshot, query, body, furniture_points(robot.places), view)
