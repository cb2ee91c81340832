"""Say what agents may not ask of the planner: a table, of which the first rule that holds refuses.

What passes is planned and judged by the validator as everybody's commands are.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from vla_deploy.client.agent_lease import LeaseState, is_agent
from vla_deploy.ipc import Event
from vla_deploy.ipc.payloads.tasks import Utterance
from vla_deploy.plans.errors import PlanError

LEASE_ENDED: Final = "the lease of the agent that asked for it has ended"
_RULE: Final = re.compile(r"agents may not: .* \(rule (?P<rule>\w+)\)", re.DOTALL)


class AgentRefused(PlanError):
    """Say which rule keeps an agent from what it asked for, and what a person can do."""

    def __init__(self, rule: str, why: str) -> None:
        self.rule = rule
        super().__init__(f"agents may not: {why} (rule {rule})")

    @staticmethod
    def rule_of(reason: str) -> str:
        """Return the rule that a refusal's reason names, "" where it names none."""
        found = _RULE.fullmatch(reason)
        return found["rule"] if found else ""


@dataclass(frozen=True, slots=True, kw_only=True)
class AgentRequest:
    """Hold what the rules ask of an agent's utterance.

    `waits_for_person` is the question or the held plan that waits for a person's word, "" for none.
    """

    lease: LeaseState
    is_answer: bool = False
    waits_for_person: str = ""
    is_mission: bool = False
    resumes: bool = False
    awaits_word: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class AgentRule:
    """Hold a row of the table: when it refuses, and in which words."""

    name: str
    refuses: Callable[[AgentRequest], object]
    why: Callable[[AgentRequest], str]


AGENT_RULES: Final[tuple[AgentRule, ...]] = (
    AgentRule(
        name="lease", refuses=lambda one: one.lease.refusal, why=lambda one: one.lease.refusal
    ),
    AgentRule(
        name="person_answers",
        refuses=lambda one: one.is_answer or one.waits_for_person,
        why=lambda one: (
            f"a person answers first, at the page, by voice or by vla-deploy say --answer: "
            f"{one.waits_for_person or 'nothing is asked'}"
        ),
    ),
    AgentRule(
        name="one_command",
        refuses=lambda one: one.is_mission,
        why=lambda _: "missions outlive a lease; give one command at a time",
    ),
    AgentRule(
        name="person_resumes",
        refuses=lambda one: one.resumes,
        why=lambda _: "what was paused goes on by a person: vla-deploy resume",
    ),
    AgentRule(
        name="no_held_plans",
        refuses=lambda one: one.awaits_word,
        why=lambda _: "a plan is not held for an agent; give the command when it is to be done",
    ),
)
"""What an agent's utterance must pass, in this order."""
NO_ORDERS: Final = AgentRefused(
    "person_forbids", "what is forbidden and permitted for good is said by a person"
)


def refused_of(request: AgentRequest) -> AgentRefused | None:
    """Return what the first rule that holds says, None where none does."""
    for rule in AGENT_RULES:
        if rule.refuses(request):
            name = request.lease.rule.value if rule.name == "lease" else rule.name
            return AgentRefused(name, rule.why(request))
    return None


def of_agent(event: Event[Utterance]) -> bool:
    """Return whether an agent gave an utterance."""
    return is_agent(str(event.payload.get("source", "")))


def text_of(event: Event[Utterance]) -> str:
    """Return the words of an utterance, "" where it has none."""
    text: object = event.payload.get("text")
    return text if isinstance(text, str) else ""
