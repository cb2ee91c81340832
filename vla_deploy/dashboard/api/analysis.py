"""Tell what the scene holds, how things lie, and whether a goal can be reached; nothing moves."""

from typing import Annotated, Any, Final

from fastapi import APIRouter, Depends, Query, Request

from vla_deploy.analysis.document import SceneAnalysis
from vla_deploy.dashboard.access import UserRole, require

router = APIRouter(tags=["state"])

_LONGEST_GOAL: Final = 500


@router.get("/analysis", dependencies=[Depends(require(UserRole.VIEWER))])
def get_analysis(
    request: Request,
    goal: Annotated[
        str, Query(max_length=_LONGEST_GOAL, description="a command in words, to be judged only")
    ] = "",
) -> SceneAnalysis:
    """Return the analysis by measurement, with a verdict where a goal is given.

    No model and no server is asked, and nothing is done.
    """
    analyst: Any = request.app.state.analyst
    analysis: SceneAnalysis = analyst.analyse(goal)
    return analysis
