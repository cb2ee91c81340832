"""Write what becomes of commands as the feedback that planning nodes publish.

Feedback has `status`: success, failure, timeout, error or question; `stage`: planning, objective or
execution; the `command`, its `command_id` and `source`. A mission's execution ends once: how its
parts end are objectives.
"""

from collections.abc import Callable, Mapping
from typing import Any, Final

from vla_deploy.client.action_status import summary_of
from vla_deploy.client.command_record import Kind
from vla_deploy.client.following import LAST_EVENTS
from vla_deploy.gateways.ros.commands import CommandNews

_GIVEN: Final = frozenset({Kind.COMMAND, Kind.ANSWER})
"""What somebody wants done; that a cancel or a pause is done is no feedback on a command."""
_ENDS: Final = {"completed": "success", "failed": "failure", "cancelled": "failure"}
_LATE: Final = "late"
_UNANSWERED: Final = "lost: no answer"


def feedback_of(news: CommandNews) -> dict[str, Any] | None:
    """Return what feedback an event is worth, None for most."""
    record, name = news.record, str(news.event.get("event"))
    is_told_by_mission = bool(record.mission) and name in LAST_EVENTS
    write = _WRITERS.get(name)
    if write is None or is_told_by_mission or record.kind not in _GIVEN:
        return None
    told = write(news)
    if told is None:
        return None
    goal = str(record.plan.get("goal", "")) if isinstance(record.plan, dict) else ""
    head = {
        "command": record.text or goal,
        "command_id": record.command_id,
        "source": record.source,
    }
    return {**told, **head}


def _planned(news: CommandNews) -> dict[str, Any]:
    return {
        "status": "success",
        "stage": "planning",
        "actions_planned": len(news.event["plan"]["actions"]),
        "processing_time": _took_s(news),
        "planned_by": str(news.event.get("rung", "")),
    }


def _took_s(news: CommandNews) -> float:
    return float(round(max(news.event["at_s"] - news.record.given_s, 0.0), 3))


def _asked(news: CommandNews) -> dict[str, Any]:
    return {
        "status": "question",
        "stage": "planning",
        "question": str(news.event.get("question", "")),
        "choices": list(news.event.get("choices") or ()),
        "answer_within_s": news.event.get("answer_within_s"),
    }


def _rejected(news: CommandNews) -> dict[str, Any]:
    attempts = list(news.event.get("attempts") or ())
    late = bool(attempts) and attempts[-1].get("outcome") == _LATE
    return {
        "status": "timeout" if late else "failure",
        "stage": "planning",
        "error": str(news.event.get("reason") or "rejected"),
        "processing_time": _took_s(news),
    }


def _objective(news: CommandNews) -> dict[str, Any] | None:
    """Return how a part of a mission ended, None while it has not."""
    status = _ENDS.get(str(news.event.get("state")))
    if status is None:
        return None
    error = str(news.event.get("error") or "")
    return {
        "status": status,
        "stage": "objective",
        "part": str(news.event.get("part")),
        "objective": str(news.event.get("words")),
        **({"error": error} if error else {}),
    }


def _finished(news: CommandNews) -> dict[str, Any]:
    error = str(news.event.get("error") or "")
    status = "success" if news.event.get("success") else "failure"
    if error.startswith(_UNANSWERED):
        status = "timeout"
    elif error.startswith("lost"):
        status = "error"
    return {
        "status": status,
        "stage": "execution",
        **({"error": error} if error else {}),
        "summary": news.event.get("summary") or summary_of(()),
    }


_WRITERS: Final[Mapping[str, Callable[[CommandNews], dict[str, Any] | None]]] = {
    "plan": _planned,
    "asked": _asked,
    "rejected": _rejected,
    "objective": _objective,
    "finished": _finished,
}
