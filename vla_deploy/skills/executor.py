"""Run one plan: actions in dependency order, each bounded in time, retried where that may help."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from drivers.clock import NS_PER_S
from vla_deploy.ipc import IpcError
from vla_deploy.planning.catalogue import SKILLS
from vla_deploy.planning.graph import execution_order
from vla_deploy.planning.plan import Action, ActionStatus, Plan
from vla_deploy.planning.readiness import refusal_of
from vla_deploy.skills.context import Skill, SkillContext
from vla_deploy.skills.errors import RobotNotReady, SkillFailed, TryAgain
from vla_deploy.skills.table import SKILL_FUNCTIONS

MAX_RETRIES = 1
BACK_OFF_S = 1.0
FINAL = frozenset(ActionStatus) - {ActionStatus.PENDING, ActionStatus.ACTIVE}


@dataclass(slots=True, kw_only=True)
class ActionRecord:
    """Hold how one action went."""

    action: Action
    status: ActionStatus = ActionStatus.PENDING
    started_ns: int = 0
    execution_time_s: float = 0.0
    error: str = ""
    retries: int = 0

    def document(self) -> dict[str, Any]:
        """Return the record as it is told in events and results."""
        return {
            "id": self.action.id,
            "skill": self.action.skill,
            "parameters": self.action.parameters,
            "status": self.status.value,
            "execution_time_s": round(self.execution_time_s, 3),
            "error": self.error or None,
            "retries": self.retries,
        }


class PlanExecution:
    """Advance one plan by one step at a time; `cancel` may be called at any moment."""

    def __init__(
        self, plan: Plan, context: SkillContext, tell: Callable[[ActionRecord], None]
    ) -> None:
        self.plan = plan
        self.records = [ActionRecord(action=action) for action in execution_order(plan.actions)]
        self._context = context
        self._tell = tell
        self._skill: Skill | None = None
        self._resume_ns = 0

    @property
    def finished(self) -> bool:
        """Tell whether every action has its final status."""
        return all(record.status in FINAL for record in self.records)

    @property
    def succeeded(self) -> bool:
        """Tell whether every action succeeded."""
        return all(record.status is ActionStatus.SUCCEEDED for record in self.records)

    @property
    def active(self) -> ActionRecord | None:
        """Return the action under way."""
        return next((one for one in self.records if one.status is ActionStatus.ACTIVE), None)

    def step(self) -> None:
        """Advance the active action, or start the next one."""
        now_ns = self._context.link.clock.now_ns()
        if now_ns < self._resume_ns:
            return
        record = self.active or self._start_next(now_ns)
        if record is None:
            return
        record.execution_time_s = (now_ns - record.started_ns) / NS_PER_S
        try:
            self._advance(record)
        except StopIteration:
            self._end(record, ActionStatus.SUCCEEDED, "")
        except SkillFailed as error:
            self._failed(record, error, now_ns)
        except IpcError as error:
            self._failed(record, TryAgain(str(error)), now_ns)

    def cancel(self, reason: str) -> None:
        """Stop the active action's motion now and cancel the rest."""
        self._drop_skill()
        for record in self.records:
            if record.status not in FINAL:
                self._end(record, ActionStatus.CANCELLED, reason)

    def _start_next(self, now_ns: int) -> ActionRecord | None:
        record = next((one for one in self.records if one.status is ActionStatus.PENDING), None)
        if record is not None:
            record.status = ActionStatus.ACTIVE
            record.started_ns = now_ns
            self._tell(record)
        return record

    def _advance(self, record: ActionRecord) -> None:
        refusal = refusal_of(self._context.link.control_status)
        if refusal:
            raise RobotNotReady(refusal)
        timeout_s = SKILLS[record.action.skill].timeout_s
        if record.execution_time_s > timeout_s:
            raise TryAgain(f"{record.action.skill} took longer than {timeout_s:g} s")
        if self._context.link.is_blind:
            self._context.link.rest_base()
            return
        if self._skill is None:
            function = SKILL_FUNCTIONS[record.action.skill]
            self._skill = function(self._context, record.action.parameters)
        next(self._skill)

    def _failed(self, record: ActionRecord, error: SkillFailed, now_ns: int) -> None:
        self._drop_skill()
        retryable = isinstance(error, TryAgain) and SKILLS[record.action.skill].retryable
        if retryable and record.retries < MAX_RETRIES:
            record.retries += 1
            record.error = f"trying again after: {error}"
            self._tell(record)
            self._resume_ns = now_ns + round(BACK_OFF_S * NS_PER_S)
            return
        self._end(record, ActionStatus.ABORTED, str(error))
        for later in self.records:
            if later.status is ActionStatus.PENDING:
                self._end(later, ActionStatus.CANCELLED, f"{record.action.id} failed")

    def _drop_skill(self) -> None:
        if self._skill is not None:
            self._skill.close()
            self._skill = None
        self._context.link.halt()

    def _end(self, record: ActionRecord, status: ActionStatus, error: str) -> None:
        if status is ActionStatus.SUCCEEDED:
            self._skill = None
        record.status = status
        record.error = error
        self._tell(record)
