"""Give the robot missions, show how far they are, cancel one."""

from http import HTTPStatus
from typing import Annotated, Any, Final

from fastapi import APIRouter, Body, Depends, Path, Request

from vla_deploy.client.link import RobotLink
from vla_deploy.dashboard.access import UserRole, note, require
from vla_deploy.dashboard.api.commands import CommandAccepted
from vla_deploy.dashboard.errors import ApiError
from vla_deploy.ipc import topics
from vla_deploy.ipc.payloads.tasks import MissionsDocument
from vla_deploy.missions.errors import MissionInvalid
from vla_deploy.missions.mission import read_mission
from vla_deploy.missions.progress import MissionRun

router = APIRouter(prefix="/missions", tags=["missions"])

_Viewer: Final = Depends(require(UserRole.VIEWER))
_Operator: Final = Depends(require(UserRole.OPERATOR))
_MissionId = Annotated[str, Path(max_length=128)]
_EXAMPLE: Final = {"goal": "tidy up", "objectives": ["go to the kitchen", "find the red cup"]}
_Mission = Annotated[dict[str, Any] | list[Any], Body(examples=[_EXAMPLE])]


@router.get("", dependencies=[_Viewer])
async def newest(request: Request) -> dict[str, Any]:
    """Return the newest missions, the newest first, and why they would not outlive a restart.

    Raises:
        ApiError: the planner does not answer.
    """
    return dict(_shown(request))


@router.post("", status_code=HTTPStatus.ACCEPTED, dependencies=[_Operator])
async def give(mission: _Mission, request: Request) -> CommandAccepted:
    """Give a mission; its events, a refusal by the planner included, carry its id.

    Raises:
        ApiError: it is no mission; all its faults are named.
    """
    try:
        goal = read_mission(mission).goal
    except MissionInvalid as error:
        raise ApiError(
            HTTPStatus.UNPROCESSABLE_ENTITY,
            "mission_invalid",
            str(error),
            "see docs/missions.md, or try: vla-deploy mission run FILE",
        ) from error
    link: RobotLink = request.app.state.link
    command_id = link.utter(mission=mission)
    note(request, given=command_id, text=goal)
    return CommandAccepted(command_id=command_id)


@router.post("/{mission_id}/cancel", status_code=HTTPStatus.ACCEPTED, dependencies=[_Operator])
async def cancel(mission_id: _MissionId, request: Request) -> CommandAccepted:
    """End one mission, or one that waits for its time; what it moves comes to rest.

    Raises:
        ApiError: there is no such mission, or it has ended.
    """
    shown = _shown(request)["missions"]
    found = next((one for one in shown if one["mission_id"] == mission_id), None)
    if found is None:
        raise ApiError(
            HTTPStatus.NOT_FOUND,
            "no_such_mission",
            f"no mission {mission_id!r} among the newest {len(shown)}",
            "see GET /api/v1/missions",
        )
    run = MissionRun.model_validate(found)
    if run.state.is_final and not run.repeats():
        raise ApiError(
            HTTPStatus.CONFLICT,
            "ended",
            f"mission {mission_id} has already ended: {run.state}",
            "nothing is left to cancel; to stop the robot, press stop",
        )
    link: RobotLink = request.app.state.link
    command_id = link.utter(mission_act={"cancel": mission_id})
    note(request, given=command_id, mission=mission_id)
    return CommandAccepted(command_id=command_id)


def _shown(request: Request) -> MissionsDocument:
    link: RobotLink = request.app.state.link
    document = link.document(topics.MISSIONS)
    if document is None:
        raise ApiError(
            HTTPStatus.SERVICE_UNAVAILABLE,
            "planner_silent",
            "no planner of this run has shown its missions",
            "see the processes: vla-deploy status",
        )
    return document
