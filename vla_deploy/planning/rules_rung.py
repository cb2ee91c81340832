"""Plan by rules, as the first rung of the ladder: at once, and the same every time."""

from typing import Final

from vla_deploy.model_servers.deadline import Deadline
from vla_deploy.planning.asking import Proposal, Request
from vla_deploy.planning.rules import draft_plan


class RulesRung:
    """Plan what the table of rules covers."""

    name: Final = "rules"

    def propose(self, request: Request, deadline: Deadline) -> Proposal:
        """Return the plan; a rule fits or it does not, so there is no doubt about it."""
        del deadline  # rules take no time
        return Proposal(plan=draft_plan(request), rung=self.name, confidence=1.0)
