"""Hold what an analyser is asked, and say what an analyser is."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final, Protocol

from drivers.clock import Clock
from vla_deploy.analysis.document import SceneAnalysis
from vla_deploy.client.place_state import PlaceState
from vla_deploy.feasibility.question import FloorPlanBystander, Image, SceneQuestion
from vla_deploy.world import Viewpoint, read_snapshot
from vla_deploy.world.resting import rest_of

FRESH_S: Final = 5.0
"""How old a scene may be that is analysed."""
_POSE_AGE_S: Final = 1.0


class Analyser(Protocol):
    """Make an analysis of a question; it always gives one, and notes what it lacked."""

    def analyse(self, question: SceneQuestion) -> SceneAnalysis:
        """Return the analysis."""
        ...


class RobotTopics(Protocol):
    """Read the topics of a running robot."""

    clock: Clock

    def document(self, topic: str, age_limit_s: float | None = None) -> dict[str, Any] | None:
        """Return the newest JSON document of a topic, None where there is none that young."""
        ...

    def fresh(self, topic: str, age_limit_s: float | None = None) -> Any:
        """Return the newest sample of a topic, None where there is none that young."""
        ...


def question_of(
    scene: Mapping[str, Any],
    *,
    now_ns: int,
    robot: Viewpoint | None = None,
    holding: Mapping[str, str | None] | None = None,
    image: Image | None = None,
    goal: str = "",
) -> SceneQuestion:
    """Return the question about a scene topic's document; `robot` is where it stands.

    Raises:
        SceneUnreadable: the document is no scene.
    """
    read = read_snapshot(scene, now_ns)
    world = replace(read, robot=robot or read.robot)
    rested = [
        thing if thing.rests is not None or thing.held_by
        else replace(thing, rests=rest_of(thing, world.things, world.surfaces))
        for thing in world.things
    ]  # fmt: skip
    return SceneQuestion(
        world=replace(world, things=tuple(rested)),
        bystanders=tuple(_bystander(one) for one in scene.get("bystanders", ())),
        holding=holding or {},
        image=image,
        goal=goal.strip(),
    )


def question_about(
    topics: RobotTopics, scene: Mapping[str, Any], goal: str, image: Image | None = None
) -> SceneQuestion:
    """Return a question about a scene, with where the robot is and what it holds now.

    Raises:
        SceneUnreadable: the document is no scene.
    """
    executor = topics.document("executor_status", age_limit_s=FRESH_S) or {}
    return question_of(
        scene,
        now_ns=topics.clock.now_ns(),
        robot=_pose(topics),
        holding=executor.get("holding", {}),
        image=image,
        goal=goal,
    )


def _pose(topics: RobotTopics) -> Viewpoint | None:
    """Return where the robot is; one that is lost is nowhere."""
    sample = topics.fresh("pose", age_limit_s=_POSE_AGE_S)
    if sample is None or PlaceState(int(sample.data["state"])) is PlaceState.LOST:
        return None
    x_m, y_m, yaw_rad = (float(sample.data[name]) for name in ("x_m", "y_m", "yaw_rad"))
    return Viewpoint(x_m=x_m, y_m=y_m, yaw_rad=yaw_rad)


def _bystander(entry: Mapping[str, Any]) -> FloorPlanBystander:
    x_m, y_m = (float(value) for value in entry["position_m"][:2])
    return FloorPlanBystander(
        kind=str(entry["class"]), x_m=x_m, y_m=y_m, width_m=float(entry["width_m"])
    )
