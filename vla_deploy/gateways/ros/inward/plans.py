"""Serve ExecutePlan: a command in words, or a plan, carried out as one from anybody else."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from vla_deploy_msgs.action import ExecutePlan

from vla_deploy.client.action_status import summary_of
from vla_deploy.gateways.ros.graph import named
from vla_deploy.gateways.ros.inward.action_server import (
    Feedback,
    GoalEnding,
    GoalOutcome,
    GoalRefused,
    require_armed,
)
from vla_deploy.gateways.ros.inward.orders import (
    ActionPlace,
    CommandOrder,
    CommandOrders,
    OrderProgress,
    error_of,
    words_of,
)
from vla_deploy.gateways.ros.part import Gateway
from vla_deploy.gateways.words import OrderInvalid, is_mission, parsed_plan, shown
from vla_deploy.ipc.payloads.tasks import TaskEvent

Result: Final = ExecutePlan.Result
News: Final = ExecutePlan.Feedback
_BUSY: Final = "the robot is busy"
_CANCELLED: Final = ("cancelled on request", "stopped on request")
_STATES: Final = {
    "queued": News.PLANNING,
    "planning": News.PLANNING,
    "asked": News.ASKED,
    "accepted": News.EXECUTING,
    "plan": News.EXECUTING,
    "action": News.EXECUTING,
    "said": News.EXECUTING,
    "objective": News.EXECUTING,
    "setback": News.RECOVERING,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class _Order:
    text: str
    plan: Any
    source: str


class PlanAction:
    """Judge what is to be carried out, words, a plan or a mission, and hand it to the planner."""

    kind = ExecutePlan

    def __init__(self, gateway: Gateway, orders: CommandOrders) -> None:
        self._gateway = gateway
        self._orders = orders

    def judge(self, goal: Any) -> _Order:
        """Return the command or the plan that a goal holds."""
        if bool(goal.command.strip()) == bool(goal.plan_json.strip()):
            raise GoalRefused(Result.INVALID_PLAN, "fill in one of command and plan_json")
        require_armed(self._gateway, Result.REJECTED, disarmed=Result.NOT_ARMED)
        try:
            plan = parsed_plan(goal.plan_json) if goal.plan_json.strip() else None
        except OrderInvalid as error:
            raise GoalRefused(Result.INVALID_PLAN, str(error)) from error
        source = named([shown(goal.source)] if goal.source else [])
        return _Order(text=goal.command, plan=plan, source=source)

    def begin(self, judged: _Order, feedback: Feedback) -> "Carrying":
        """Give it to the planner."""
        plan, is_one = judged.plan, is_mission(judged.plan)
        given = {"mission": plan} if is_one else {"text": judged.text, "plan": plan}
        try:
            order = self._orders.give(**given, source=judged.source)
        except OrderInvalid as error:
            raise GoalRefused(Result.INVALID_PLAN, str(error)) from error
        return Carrying(order, feedback, of_plan=plan is not None)

    def refused(self, refusal: GoalRefused) -> Any:
        """Return the code and why."""
        return Result(error_code=refusal.code, error=str(refusal))


class Carrying:
    """Pursue one command, and publish each action's news; of a mission those of all its parts."""

    def __init__(self, order: CommandOrder, feedback: Feedback, *, of_plan: bool) -> None:
        self._order = order
        self._feedback = feedback
        self._of_plan = of_plan
        self._cancelled = ""
        self._progress = OrderProgress()

    def step(self, now_ns: int) -> GoalOutcome | None:
        """Publish what is new; return the outcome once the command has ended."""
        while self._order.news:
            event = self._order.news.popleft()
            place = self._progress.note(event)
            state = _STATES.get(event["event"])
            if state is not None:
                self._feedback(_message(state, event, place))
        return None if self._order.last is None else self._finish(self._order.last)

    def cancel(self, reason: str, *, superseded: bool = False) -> GoalOutcome | None:
        """Cancel the command; once the robot has come to rest, `step` returns the outcome."""
        self._cancelled = reason
        self._order.cancel()
        if not superseded:
            return None
        result = Result(error_code=Result.CANCELLED, error=reason)
        return GoalOutcome(ending=GoalEnding.CANCELED, result=result)

    def _finish(self, last: TaskEvent) -> GoalOutcome:
        why = error_of(last)
        summary = last["summary"] if last["event"] == "finished" else summary_of(())
        result = Result(
            success=not why and not self._cancelled,
            error_code=self._code(last, why),
            error=self._cancelled or why,
            **summary,
            results_json=json.dumps(self._progress.results),
        )
        if self._cancelled:
            return GoalOutcome(ending=GoalEnding.CANCELED, result=result)
        return GoalOutcome(
            ending=GoalEnding.ABORTED if why else GoalEnding.SUCCEEDED, result=result
        )

    def _code(self, last: TaskEvent, why: str) -> int:
        if self._cancelled or why.endswith(_CANCELLED):
            return int(Result.CANCELLED)
        if not why:
            return int(Result.OK)
        if last["event"] == "rejected":
            if why.startswith(_BUSY):
                return int(Result.BUSY)
            return int(Result.INVALID_PLAN if self._of_plan else Result.REJECTED)
        return int(Result.LOST if why.startswith("lost") else Result.ABORTED)


def _message(state: str, event: Mapping[str, Any], place: ActionPlace) -> Any:
    return News(
        state=state,
        action_id=place.action_id,
        skill=str(event.get("skill") or ""),
        status=str(event.get("status") or ""),
        index=place.index,
        total=place.total,
        text=words_of(event),
        choices=[str(one) for one in event.get("choices") or ()],
    )
