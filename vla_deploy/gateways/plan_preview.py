"""Plan a command as the planner's process would, and do nothing by it."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from vla_deploy.client.link import RobotLink
from vla_deploy.planning.dialogue.command import UserCommand
from vla_deploy.planning.dialogue.confirmation import confirmation_of
from vla_deploy.planning.dialogue.situation import Situation
from vla_deploy.planning.errors import Ambiguous
from vla_deploy.planning.interfaces import PlanningResult, PlanRequest
from vla_deploy.planning.planner import Planner
from vla_deploy.planning.understanding import Conversation
from vla_deploy.plans.knowledge import world_of
from vla_deploy.robots import RobotDescription
from vla_deploy.world.own_words import OwnWords


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanPreview:
    """Hold what was planned; `read_back` is the confirmation that the robot would ask for.

    `away` has the back ends that are not available, with the reason.
    """

    result: PlanningResult
    read_back: str
    away: Mapping[str, str]

    @property
    def is_asked(self) -> bool:
        """Return whether the robot would ask what is meant, and plan nothing before."""
        return isinstance(self.result.error, Ambiguous)

    @property
    def question(self) -> str:
        """Return what the robot would ask, "" for nothing."""
        return str(self.result.error) if self.is_asked else self.read_back

    def document(self) -> dict[str, Any]:
        """Return it as JSON."""
        result, proposal = self.result, self.result.proposal
        is_refused = result.error is not None and not self.is_asked
        return {
            "plan": None if result.plan is None else result.plan.model_dump(mode="json"),
            "rung": None if proposal is None else proposal.back_end,
            "confidence": None if proposal is None else round(proposal.confidence, 3),
            "read_back": self.read_back or None,
            "question": str(result.error) if self.is_asked else None,
            "refused": str(result.error) if is_refused else None,
            "attempts": [one.document() for one in result.attempts],
            "away": dict(self.away),
        }


def preview_request(text: str, robot: RobotDescription, link: RobotLink | None) -> PlanRequest:
    """Return the request that a command makes in the robot's situation; without one in none."""
    text = OwnWords(robot.words).read(text)
    if link is None:
        return PlanRequest(command_id="plan", text=text, world=world_of(robot, {}))
    situation = Situation(link.space, link.clock, robot)
    command = UserCommand(command_id="plan", told_ns=0, text=text)
    return situation.request(command, Conversation())


def preview(planner: Planner, request: PlanRequest) -> PlanPreview:
    """Plan a request."""
    result = planner.plan(request)
    asks = confirmation_of(result.plan, request, result.proposal) if result.plan else ""
    return PlanPreview(result=result, read_back=asks, away=planner.away)
