"""Refuse what agents may not ask of the planner; a stop does not come this way."""

from collections.abc import Callable, Collection, Iterable
from typing import Final

from vla_deploy.client.access.audit_log import AuditEntry, AuditLog, AuditOutcome
from vla_deploy.client.agent_lease import AGENT, LeaseKeeper
from vla_deploy.ipc import Event
from vla_deploy.ipc.payloads.tasks import Utterance
from vla_deploy.planning.dialogue.command import command_id_of
from vla_deploy.planning.patterns.steering import awaiting, resumes
from vla_deploy.plans.agent_rules import AgentRefused, AgentRequest, of_agent, refused_of, text_of

_MOST_REMEMBERED: Final = 256


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
        given, text = event.payload, text_of(event)
        refused = refused_of(
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
        if self._audit is None:
            return
        self._audit.record(
            AuditEntry(
                user=str(event.payload.get("source", ""))[:80],
                role=AGENT,
                way="planner",
                address="local",
                act="command",
                outcome=AuditOutcome.REFUSED,
                code=refused.rule,
                details={"given": command_id_of(event), "text": text_of(event)},
            )
        )
