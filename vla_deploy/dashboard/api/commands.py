"""Give the robot commands, and answer how they ended."""

from http import HTTPStatus
from typing import Annotated, Any, Final, Unpack

from fastapi import APIRouter, Depends, Path, Query, Request
from pydantic import BaseModel, ConfigDict, Field, model_validator

from vla_deploy.client.command_history import MOST_COMMANDS, CommandHistory
from vla_deploy.client.command_record import MOST_CHARACTERS, CommandRecord
from vla_deploy.client.link import RobotLink
from vla_deploy.dashboard.access import UserRole, note, require
from vla_deploy.dashboard.errors import ApiError
from vla_deploy.ipc.payloads.tasks import UtteranceContent

router = APIRouter(prefix="/commands", tags=["commands"])

_Viewer: Final = Depends(require(UserRole.VIEWER))
_Operator: Final = Depends(require(UserRole.OPERATOR))
CommandId = Annotated[str, Path(max_length=128)]
_Words = Annotated[str, Field(min_length=1, max_length=MOST_CHARACTERS)]


class CommandBody(BaseModel):
    """Hold words, or a plan in any of the known dialects; the planner's validator checks both."""

    model_config = ConfigDict(extra="forbid", json_schema_extra={"examples": [{"text": "stop"}]})

    text: _Words | None = None
    plan: dict[str, Any] | None = None

    @model_validator(mode="after")
    def _is_one(self) -> "CommandBody":
        if (self.text is None) == (self.plan is None):
            raise ValueError("expected either text or plan")
        return self


class AnswerBody(BaseModel):
    """Hold the words that answer the robot's question."""

    model_config = ConfigDict(extra="forbid")

    text: _Words


class CommandAccepted(BaseModel):
    """Hold the id that the events of the command carry."""

    command_id: str


@router.post("", status_code=HTTPStatus.ACCEPTED, dependencies=[_Operator])
async def give(command: CommandBody, request: Request) -> CommandAccepted:
    """Give a command; its events, a refusal included, carry its id."""
    return _uttered(request, **command.model_dump(exclude_none=True))


@router.post("/answer", status_code=HTTPStatus.ACCEPTED, dependencies=[_Operator])
async def answer(body: AnswerBody, request: Request) -> CommandAccepted:
    """Answer the robot's question; without a question nothing is done."""
    return _uttered(request, text=body.text, answer=True)


@router.post("/pause", status_code=HTTPStatus.ACCEPTED, dependencies=[_Operator])
async def pause(request: Request) -> CommandAccepted:
    """Have what goes on come to rest where it is, holding what it holds."""
    return _uttered(request, pause=True)


@router.post("/resume", status_code=HTTPStatus.ACCEPTED, dependencies=[_Operator])
async def resume(request: Request) -> CommandAccepted:
    """Have what was paused go on from there."""
    return _uttered(request, pause=False)


@router.get("", dependencies=[_Viewer])
async def history(
    request: Request, limit: Annotated[int, Query(ge=1, le=MOST_COMMANDS)] = 50
) -> list[dict[str, Any]]:
    """Return the newest commands of every source, the newest first."""
    return [record.document() for record in _history(request).newest(limit)]


@router.get("/{command_id:path}", dependencies=[_Viewer])
async def one(command_id: CommandId, request: Request) -> dict[str, Any]:
    """Return one command with its events; one of a mission has "/" in its id."""
    return _found(request, command_id).document()


@router.post("/{command_id}/cancel", status_code=HTTPStatus.ACCEPTED, dependencies=[_Operator])
async def cancel(command_id: CommandId, request: Request) -> CommandAccepted:
    """Cancel a command that has not ended: the robot comes to rest and drops waiting commands."""
    standing = _found(request, command_id).standing
    if standing.is_final:
        raise ApiError(
            HTTPStatus.CONFLICT,
            "ended",
            f"command {command_id} has already ended: {standing}",
            "nothing is left to cancel; to stop the robot, press stop",
        )
    return _uttered(request, cancel=True)


def _uttered(request: Request, **utterance: Unpack[UtteranceContent]) -> CommandAccepted:
    link: RobotLink = request.app.state.link
    command_id = link.utter(**utterance)
    note(request, given=command_id, text=utterance.get("text", ""))
    return CommandAccepted(command_id=command_id)


def _history(request: Request) -> CommandHistory:
    history: CommandHistory = request.app.state.commands
    return history


def _found(request: Request, command_id: str) -> CommandRecord:
    record = _history(request).find(command_id)
    if record is None:
        raise ApiError(
            HTTPStatus.NOT_FOUND,
            "no_such_command",
            f"no command {command_id!r} among the newest {MOST_COMMANDS}",
            "see GET /api/v1/commands",
        )
    return record
