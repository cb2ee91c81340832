"""Analyse the scene and judge goals by measurement: no model is asked, nothing moves.

The robot's kinematics are loaded with the first request, to save memory.
"""

from http import HTTPStatus
from threading import Lock
from typing import Annotated, Any, Final

from fastapi import APIRouter, Depends, Query, Request

from vla_deploy.analysis.document import SceneAnalysis
from vla_deploy.analysis.question import FRESH_S, Analyser, question_about
from vla_deploy.client.link import RobotLink
from vla_deploy.dashboard.access import UserRole, require
from vla_deploy.dashboard.access.rates import TokenBuckets
from vla_deploy.dashboard.errors import ApiError
from vla_deploy.ipc import topics
from vla_deploy.robots import load_robot
from vla_deploy.robots.errors import MapInvalid
from vla_deploy.world import SceneUnreadable

# Threads that wait for their turn are missing for other answers.
_TURN_WITHIN_S: Final = 2.0
# A full room takes half a second of a core; the dashboard's budget is a fifth of one.
_RATE_HZ: Final = 0.25
_BURST: Final = 5
router = APIRouter(tags=["state"])
_LONGEST_GOAL: Final = 500


class Analyst:
    """Analyse the scene, one request at a time; for routes that run in threads."""

    def __init__(self, link: RobotLink) -> None:
        self._link = link
        self._turn = Lock()
        self._asked = TokenBuckets(_RATE_HZ, _BURST, link.clock)
        self._analyser: Analyser | None = None

    def analyse(self, goal: str) -> SceneAnalysis:
        """Return the geometric analysis of the scene, with a verdict on a goal in words.

        Raises:
            ApiError: there is no scene, the robot's map cannot be used, or there are too many
                requests.
        """
        scene = self._link.document(topics.SCENE, age_limit_s=FRESH_S)
        if scene is None:
            raise _unavailable("no_scene", "perception tells no scene")
        if self._asked.take("") > 0.0:
            raise ApiError(
                HTTPStatus.TOO_MANY_REQUESTS,
                "too_often",
                "analyses are asked for too often",
                f"ask again in {1.0 / _RATE_HZ:.0f} s",
            )
        if not self._turn.acquire(timeout=_TURN_WITHIN_S):
            raise _unavailable("busy", "others are asking just now", "ask again in a moment")
        try:
            # Before the analyser is loaded, which may take longer than a pose is fresh.
            question = question_about(self._link, scene, goal)
            analyser = self._analyser = self._analyser or _geometric_analyser(self._link.robot)
            return analyser.analyse(question)
        except SceneUnreadable as error:
            raise _unavailable("no_scene", str(error)) from error
        except MapInvalid as error:
            raise _unavailable("no_map", str(error), "vla-deploy map check") from error
        finally:
            self._turn.release()


def _geometric_analyser(robot: str) -> Analyser:
    from vla_deploy.analysis.geometric import GeometricAnalyser
    from vla_deploy.feasibility.abilities import Abilities  # takes pinocchio with it

    return GeometricAnalyser(Abilities.of(load_robot(robot)))


def _unavailable(code: str, what: str, hint: str = "vla-deploy status") -> ApiError:
    return ApiError(HTTPStatus.SERVICE_UNAVAILABLE, code, what, hint)


@router.get("/analysis", dependencies=[Depends(require(UserRole.VIEWER))])
def get_analysis(
    request: Request,
    goal: Annotated[
        str, Query(max_length=_LONGEST_GOAL, description="a command in words, to be judged only")
    ] = "",
) -> SceneAnalysis:
    """Return the analysis by measurement, with a verdict where a goal is given.

    No model and no server is asked, and nothing moves.
    """
    analyst: Any = request.app.state.analyst
    analysis: SceneAnalysis = analyst.analyse(goal)
    return analysis
