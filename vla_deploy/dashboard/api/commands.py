"""Give the robot commands, and tell what became of them."""

from http import HTTPStatus
from typing import Annotated, Any, Final

from fastapi import APIRouter, Depends, Path, Query, Request
from pydantic import BaseModel, ConfigDict, Field, model_validator

from vla_deploy.client.command_history import MOST_COMMANDS, CommandHistory
from vla_deploy.client.command_record import CommandRecord
from vla_deploy.dashboard.access import UserRole, note, require
from vla_deploy.dashboard.errors import ApiError
from vla_deploy.planning.bounds import MOST_CHARACTERS

router = APIRouter(prefix="/commands", tags=["commands"])

_Viewer: Final = Depends(require(UserRole.VIEWER))
_Operator: Final = Depends(require(UserRole.OPERATOR))
CommandId = Annotated[str, Path(max_length=128)]
_Words = Annotated[str, Field(min_length=1, max_length=MOST_CHARACTERS)]


class Command(BaseModel):
    """Hold words, or a plan in any of the known dialects; the planner's validator judges both."""

    model_config = ConfigDict(extra="forbid", json_schema_extra={"examples": [{"text": "stop"}]})

    text: _Words | None = None
    plan: dict[str, Any] | None = None

    @model_validator(mode="after")
    def _is_one(self) -> "Command":
        if (self.text is None) == (self.plan is None):
            raise ValueError("expected either text or plan")
        return self


class Answer(BaseModel):
    """Hold the words that answer what the robot has asked."""

    model_config = ConfigDict(extra="forbid")

    text: _Words


class Given(BaseModel):
    """Name what was given: its events carry this id."""

    command_id: str


@router.post("", status_code=HTTPStatus.ACCEPTED, dependencies=[_Operator])
async def give(command: Command, request: Request) -> Given:
    """Give a command; what becomes of it, also a refusal, is told under its id."""
    return _uttered(request, **command.model_dump(exclude_none=True))


@router.post("/answer", status_code=HTTPStatus.ACCEPTED, dependencies=[_Operator])
async def answer(given: Answer, request: Request) -> Given:
    """Answer what the robot has asked; where nothing was asked, nothing is done."""
    return _uttered(request, text=given.text, answer=True)


@router.get("", dependencies=[_Viewer])
async def history(
    request: Request, limit: Annotated[int, Query(ge=1, le=MOST_COMMANDS)] = 50
) -> list[dict[str, Any]]:
    """Return the newest commands of every source, the newest first."""
    return [record.document() for record in _history(request).newest(limit)]


@router.get("/{command_id}", dependencies=[_Viewer])
async def one(command_id: CommandId, request: Request) -> dict[str, Any]:
    """Return one command and what became of it."""
    return _found(request, command_id).document()


@router.post("/{command_id}/cancel", status_code=HTTPStatus.ACCEPTED, dependencies=[_Operator])
async def cancel(command_id: CommandId, request: Request) -> Given:
    """Cancel a command that has not ended: the robot comes to rest, and drops all that waits."""
    standing = _found(request, command_id).standing
    if standing.is_final:
        raise ApiError(
            HTTPStatus.CONFLICT,
            "ended",
            f"command {command_id} has already ended: {standing}",
            "nothing is left to cancel; to stop the robot, press stop",
        )
    return _uttered(request, cancel=True)


def _uttered(request: Request, **utterance: Any) -> Given:
    command_id = request.app.state.link.utter(**utterance)
    note(request, given=command_id, text=utterance.get("text", ""))
    return Given(command_id=command_id)


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
