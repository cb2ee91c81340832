"""Remember the plans that the executor carries out, for when one of them fails."""

from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final

from vla_deploy.planning.inbox import Command
from vla_deploy.planning.interfaces import Answer
from vla_deploy.planning.plan import Plan
from vla_deploy.planning.recovery import RECOVERY, Carried, read_setback
from vla_deploy.robots.plan_bounds import NOT_BOUNDED

_MOST_REMEMBERED: Final = 16


class UnderWay:
    """Hold command and plan of what is carried out, with all that failed before.

    For one command, `further_plans` are made at most.
    """

    def __init__(self, further_plans: int = NOT_BOUNDED.further_plans) -> None:
        self._further_plans = further_plans
        self._carried: OrderedDict[str, tuple[Command, Carried]] = OrderedDict()

    def carry(
        self, command: Command, plan: Plan, answer: Answer, agreed: frozenset[str] = frozenset()
    ) -> None:
        """Note that the executor has a plan: the first for a command, or one after a failure.

        To what is `agreed` with the first counts for all that follow.
        """
        known = self._carried.pop(command.command_id, None)
        proposal = answer.proposal
        strategy = proposal.origin if proposal is not None and proposal.rung == RECOVERY else ""
        if command.recovers and known is not None:
            carried = known[1].going_on(plan, strategy)
        else:
            carried = Carried(plan=plan, given=command.plan is not None, agreed=agreed)
        self._carried[command.command_id] = replace(command, recovers=True), carried
        while len(self._carried) > _MOST_REMEMBERED:
            self._carried.popitem(last=False)

    def agreed(self, command: Command) -> frozenset[str]:
        """Return what the person need not be asked again for another plan of a command."""
        carried = self.carried(command.command_id) if command.recovers else None
        return frozenset() if carried is None else carried.agreed

    def carried(self, command_id: str) -> Carried | None:
        """Return what is known of a command's plans, None where nothing is."""
        known = self._carried.get(command_id)
        return None if known is None else known[1]

    def set_back(self, command_id: str, told: Mapping[str, Any]) -> Command | str:
        """Note that a plan failed; return the command to plan anew, or why not."""
        known = self._carried.get(command_id)
        setback = None if known is None else read_setback(told, known[1].plan)
        if known is None or setback is None:
            return "the planner was started again meanwhile"
        command, carried = known
        if carried.given:
            return "the plan was given, and is not changed"
        if len(carried.setbacks) >= self._further_plans:
            return _no_more(self._further_plans)
        self._carried[command_id] = command, carried.after(setback)
        return command

    def ended(self, command_id: str) -> None:
        """Forget a command: it has come to its end."""
        self._carried.pop(command_id, None)


def _no_more(further_plans: int) -> str:
    if further_plans == 0:
        return "this robot makes no other plan: [planning] further_plans is 0"
    return f"{further_plans} other plan{'s' if further_plans > 1 else ''} failed, too"
