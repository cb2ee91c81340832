"""Refuse what agents may not ask of the planner; a stop does not come this way.

The rules are a table: the first one that holds refuses. What passes is planned and judged by the
validator as everybody's commands are.
"""

from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass
from typing import Final

from vla_deploy.client.access.audit_log import AuditEntry, AuditLog, AuditOutcome
from vla_deploy.client.agent_lease import AGENT, LeaseKeeper, LeaseState, is_agent
from vla_deploy.ipc import Event
from vla_deploy.ipc.payloads.tasks import Utterance
from vla_deploy.planning.dialogue.command import command_id_of
from vla_deploy.planning.errors import AgentRefused
from vla_deploy.planning.patterns.steering import awaiting, resumes

LEASE_ENDED: Final = "the lease of the agent that asked for it has ended"
_MOST_REMEMBERED: Final = 256


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


def refusal_of(request: AgentRequest) -> AgentRefused | None:
    """Return what the first rule that holds says, None where none does."""
    for rule in AGENT_RULES:
        if rule.refuses(request):
            name = request.lease.rule.value if rule.name == "lease" else rule.name
            return AgentRefused(name, rule.why(request))
    return None


class AgentGuard:
    """Judge agents' utterances where they enter, and know whose commands a lease's end ends."""

    def __init__(self, leases: LeaseKeeper, audit: AuditLog | None = None) -> None:
        """Begin; refusals are recorded in `audit`."""
        self._leases = leases
        self._audit = audit
        self._given: set[str] = set()

    def remember(self, utterances: Iterable[Event[Utterance]]) -> None:
        """Take the commands that agents gave to an earlier planner of this run."""
        self._given.update(command_id_of(one) for one in utterances if of_agent(one))

    def check(
        self, event: Event[Utterance], waits_for_person: str, are_several: Callable[[str], bool]
    ) -> None:
        """Let an utterance pass; `are_several` tells words of a mission.

        Raises:
            AgentRefused: an agent gave it, and a rule refuses it.
        """
        if not of_agent(event):
            return
        given, text = event.payload, _text_of(event)
        refused = refusal_of(
            AgentRequest(
                lease=self._leases.state(),
                is_answer=bool(given.get("answer")),
                waits_for_person=waits_for_person,
                is_mission="mission" in given or "mission_act" in given or are_several(text),
                resumes=("pause" in given and not given["pause"]) or resumes(text),
                awaits_word=awaiting(text) is not None,
            )
        )
        if refused is not None:
            self._record(event, refused)
            raise refused
        self._given.add(command_id_of(event))

    def take_ended(self, in_work: Callable[[], Collection[str]]) -> tuple[str, ...]:
        """Return the agents' commands in work whose lease has ended, each once."""
        if len(self._given) > _MOST_REMEMBERED:
            self._given.intersection_update(in_work())
        if not self._given or self._leases.state().is_live:
            return ()
        ended = self._given.intersection(in_work())
        self._given.clear()
        return tuple(sorted(ended))

    def close(self) -> None:
        """Write the audit entries that wait."""
        if self._audit is not None:
            self._audit.close()

    def _record(self, event: Event[Utterance], refused: AgentRefused) -> None:
        source = str(event.payload.get("source", ""))
        if self._audit is None:
            return
        self._audit.record(
            AuditEntry(
                user=source[:80],
                role=AGENT,
                way="planner",
                address="local",
                act="command",
                outcome=AuditOutcome.REFUSED,
                code=refused.rule,
                details={"given": command_id_of(event), "text": _text_of(event)},
            )
        )


def of_agent(event: Event[Utterance]) -> bool:
    """Return whether an agent gave an utterance."""
    return is_agent(str(event.payload.get("source", "")))


def _text_of(event: Event[Utterance]) -> str:
    text: object = event.payload.get("text")
    return text if isinstance(text, str) else ""
