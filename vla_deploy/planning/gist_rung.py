"""Plan what is left of a command without what seems to be said beside it, if somebody agrees.

The last rung of the ladder: it is asked where nobody else has understood the whole.
"""

from dataclasses import replace
from typing import Final

from vla_deploy.model_servers.deadline import Deadline
from vla_deploy.planning.asking import Proposal, Request
from vla_deploy.planning.errors import Declined
from vla_deploy.planning.rules import draft_plan
from vla_deploy.planning.rules.gist import gist_of

CONFIDENCE: Final = 0.5
"""What is left may be half of what was meant: so little is read back before anything moves."""


class GistRung:
    """Plan by rules what a command comes down to, unsure of it."""

    name: Final = "gist"

    def propose(self, request: Request, deadline: Deadline) -> Proposal:
        """Return the plan, of which each step may not be meant.

        Raises:
            Declined: nothing can be left out, or it is a plan that failed.
            PlanningError: no rule covers what is left.
        """
        del deadline  # rules take no time
        said = "" if request.failed else gist_of(request)
        if not said:
            raise Declined("there is nothing to leave out")
        plan = draft_plan(replace(request, text=said))
        unsure = {"feasibility_score": CONFIDENCE}
        actions = tuple(action.model_copy(update=unsure) for action in plan.actions)
        doubted = plan.model_copy(update={"actions": actions})
        return Proposal(plan=doubted, rung=self.name, confidence=CONFIDENCE)
