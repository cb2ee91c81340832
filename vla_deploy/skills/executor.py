"""Run one plan: actions as their dependencies allow, each bounded in time, some tried twice."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Final

from drivers.clock import NS_PER_S
from vla_deploy.client.action_status import ActionStatus
from vla_deploy.client.readiness import refusal_of
from vla_deploy.ipc import Book, ClaimRefused, IpcError
from vla_deploy.ipc.claims import obstacles
from vla_deploy.ipc.payloads.tasks import ActionOutcome
from vla_deploy.plans.catalogue import SKILLS
from vla_deploy.plans.plan import Action, FailureCause, Plan, execution_order
from vla_deploy.plans.symbolic.state import SymbolicState
from vla_deploy.skills.context import Rest, Skill, SkillContext
from vla_deploy.skills.errors import (
    EffectMissing,
    NotPossible,
    PreconditionUnmet,
    RobotNotReady,
    SkillFailed,
    TryAgain,
)
from vla_deploy.skills.resources import WAIT_LIMIT_S, needs_of
from vla_deploy.skills.table import SKILL_FUNCTIONS
from vla_deploy.skills.world_check import WorldCheck

MAX_RETRIES = 1
BACK_OFF_S = 1.0
# How long needs and effects are looked for, and how often: two images of the camera.
WORLD_WAIT_S = 0.6
WORLD_LOOK_S = 0.1
CAUSES = (
    (PreconditionUnmet, FailureCause.PRECONDITION),
    (EffectMissing, FailureCause.EFFECT),
    (TryAgain, FailureCause.SKILL),
    (NotPossible, FailureCause.SKILL),
)
_WAITING: Final = "wait"  # lasts as long as it was asked for
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
    note: str = ""
    cause: FailureCause | None = None
    """By what it failed, where another plan may do better; None otherwise."""
    left: Mapping[str, float] | None = None
    """What is left of a relative motion that ended early; empty where nobody knows, else None."""

    @property
    def outcome(self) -> ActionOutcome:
        """Return the record as events and results have it."""
        return {
            "skill": self.action.skill,
            "parameters": self.action.parameters,
            "status": self.status.value,
            "execution_time_s": round(self.execution_time_s, 3),
            "error": self.error or None,
            "retries": self.retries,
            "note": self.note or None,
        }


@dataclass(slots=True, kw_only=True)
class _Branch:
    """Hold one action under way; `skill` is None before its first step and between two tries.

    `done_ns` is when the skill came to its end; its effect is looked for from then on.
    """

    record: ActionRecord
    skill: Skill | None = None
    resume_ns: int = 0
    done_ns: int = 0
    unmet_ns: int = 0
    before: SymbolicState = field(default_factory=SymbolicState)


class PlanExecution:
    """Advance one plan by one step at a time; `cancel` may be called at any moment.

    Actions that need neither each other nor the same parts of the robot go on side by side. Every
    action holds all it needs from its start to its end, or waits for it.
    """

    def __init__(
        self,
        plan: Plan,
        context: SkillContext,
        tell: Callable[[ActionRecord], None],
        command_id: str = "",
    ) -> None:
        self.plan = plan
        self.records = [ActionRecord(action=action) for action in execution_order(plan.actions)]
        self._context = context
        context.keeps_out = frozenset(plan.keeps_out)
        self._tell = tell
        self._command_id = command_id
        self._world = WorldCheck(context)
        self._branches: dict[str, _Branch] = {}
        self._leaving: dict[str, tuple[ActionStatus, str]] = {}
        """How actions end as soon as servers beyond the robot have ended their goals."""
        self._asked: set[str] = set()

    @property
    def finished(self) -> bool:
        """Return whether every action has its final status."""
        return all(record.status in FINAL for record in self.records)

    @property
    def succeeded(self) -> bool:
        """Return whether every action succeeded."""
        return all(record.status is ActionStatus.SUCCEEDED for record in self.records)

    @property
    def setback(self) -> ActionRecord | None:
        """Return the action that failed in a way that another plan may mend, or None."""
        return next((one for one in self.records if one.cause is not None), None)

    @property
    def active(self) -> ActionRecord | None:
        """Return the action that has been under way for longest, or still has to end."""
        under_way = (branch.record for branch in self._branches.values())
        return next(under_way, None) or next(map(self._record, self._leaving), None)

    def step(self) -> None:
        """Start what may start, and advance every action under way."""
        now_ns = self._context.link.clock.now_ns()
        self._end_left()
        self._start_ready(now_ns)
        for name, branch in list(self._branches.items()):
            is_open = branch.record.status not in FINAL and name not in self._leaving
            if is_open and now_ns >= branch.resume_ns:
                self._step_branch(branch, now_ns)

    def cancel(self, reason: str) -> None:
        """Stop every motion now and cancel what has not ended.

        What servers beyond the robot do ends when they have answered, in one of the next steps.
        """
        for branch in self._branches.values():
            _drop(branch)
        self._context.link.halt()
        for record in self.records:
            if record.status not in FINAL and record.action.id not in self._leaving:
                self._leave(record, ActionStatus.CANCELLED, reason)

    def abandon(self) -> None:
        """End what is left without the word of servers that have not answered yet."""
        for action_id, (status, error) in list(self._leaving.items()):
            self._context.notes[action_id] = "not waited for its server to end its goal"
            self._end(self._record(action_id), status, error)

    def _leave(self, record: ActionRecord, status: ActionStatus, error: str) -> None:
        """End an action, at once or as soon as no server has a goal of it any more."""
        if not self._is_ending(record.action):
            self._end(record, status, error)
            return
        self._branches.pop(record.action.id, None)
        self._leaving[record.action.id] = status, error

    def _end_left(self) -> None:
        for action_id, (status, error) in list(self._leaving.items()):
            record = self._record(action_id)
            if not self._is_ending(record.action):
                self._end(record, status, error)

    def _is_ending(self, action: Action) -> bool:
        ros = self._context.ros
        return ros is not None and ros.is_ending(action.id)

    def _record(self, action_id: str) -> ActionRecord:
        return next(one for one in self.records if one.action.id == action_id)

    def _start_ready(self, now_ns: int) -> None:
        done = {one.action.id for one in self.records if one.status is ActionStatus.SUCCEEDED}
        ended = {one.action.id for one in self.records if one.status in FINAL}
        ready = [
            one
            for one in self.records
            if one.status is ActionStatus.PENDING
            and done.issuperset(one.action.depends_on)
            and ended.issuperset(one.action.after)
        ]
        for record in ready:
            self._ask_once(record)
        book = self._context.claims.look() if ready else None
        for record in ready:
            if book is not None and record.status is ActionStatus.PENDING:
                self._start_if_granted(record, book, now_ns)

    def _ask_once(self, record: ActionRecord) -> None:
        action = record.action
        if action.id in self._asked or record.status in FINAL:
            return
        self._asked.add(action.id)
        try:
            self._context.claims.ask(
                self._holder(action),
                needs_of(action, self._context.robot),
                priority=-action.priority,  # claims know the greatest as the first
                timeout_s=WAIT_LIMIT_S,
            )
        except ClaimRefused as error:
            self._give_up(record, str(error))

    def _start_if_granted(self, record: ActionRecord, book: Book, now_ns: int) -> None:
        holder = self._holder(record.action)
        if book.holds(holder):
            self._branches[record.action.id] = _Branch(record=record)
            record.status = ActionStatus.ACTIVE
            record.started_ns = now_ns
            self._tell(record)
        elif not book.waits(holder):
            needs = needs_of(record.action, self._context.robot)
            why = obstacles(book, needs) or "others came first"
            self._give_up(record, f"waited {WAIT_LIMIT_S:g} s: {why}")

    def _step_branch(self, branch: _Branch, now_ns: int) -> None:
        record = branch.record
        record.execution_time_s = (now_ns - record.started_ns) / NS_PER_S
        self._context.link.acting = record.action.id
        self._context.holder = self._holder(record.action)
        try:
            self._advance(branch)
        except StopIteration:
            branch.skill, branch.done_ns = None, now_ns
            self._look_for_effect(branch, now_ns)
        except SkillFailed as error:
            self._failed(branch, error, now_ns)
        except IpcError as error:
            self._failed(branch, TryAgain(str(error)), now_ns)

    def _advance(self, branch: _Branch) -> None:
        action = branch.record.action
        refusal = refusal_of(self._context.link.control_status)
        if refusal:
            raise RobotNotReady(refusal)
        timeout_s = self._timeout_s(action)
        if branch.record.execution_time_s > timeout_s:
            raise TryAgain(f"{action.skill} took longer than {timeout_s:g} s")
        if self._context.link.is_blind or self._context.link.is_paused:
            self._context.link.rest_base()
            return
        if branch.done_ns:
            self._look_for_effect(branch, self._context.link.clock.now_ns())
            return
        if branch.skill is None and self._is_ending(action):
            return  # a server has still to end what was tried before
        if branch.skill is None:
            if self._lacks_need(branch, self._context.link.clock.now_ns()):
                return
            branch.before = self._world.state(action)
            branch.skill = SKILL_FUNCTIONS[action.skill](self._context, action.parameters)
        next(branch.skill)

    def _timeout_s(self, action: Action) -> float:
        own_s = SKILLS[action.skill].timeout_s
        if action.skill == _WAITING:
            return own_s
        return min(own_s, self._context.robot.planning.action_timeout_s)

    def _lacks_need(self, branch: _Branch, now_ns: int) -> bool:
        """Return whether to wait for what the world denies at first: one image may miss a thing.

        Raises:
            PreconditionUnmet: the world still denies it.
        """
        unmet = self._world.unmet(branch.record.action)
        if not unmet:
            return False
        branch.unmet_ns = branch.unmet_ns or now_ns
        if now_ns - branch.unmet_ns >= WORLD_WAIT_S * NS_PER_S:
            raise PreconditionUnmet(unmet)
        branch.resume_ns = now_ns + round(WORLD_LOOK_S * NS_PER_S)
        return True

    def _look_for_effect(self, branch: _Branch, now_ns: int) -> None:
        """End an action as the world shows it; where that shows nothing in time, as its skill did.

        Raises:
            EffectMissing: the world shows that it has not come about.
        """
        if now_ns < branch.resume_ns:
            return
        why = self._world.missing_effect(branch.record.action, branch.before, branch.done_ns)
        if why:
            branch.done_ns = 0
            raise EffectMissing(why)
        if why is None and now_ns - branch.done_ns < WORLD_WAIT_S * NS_PER_S:
            branch.resume_ns = now_ns + round(WORLD_LOOK_S * NS_PER_S)
            return
        self._end(branch.record, ActionStatus.SUCCEEDED, "")

    def _failed(self, branch: _Branch, error: SkillFailed, now_ns: int) -> None:
        record = branch.record
        _drop(branch)
        self._context.link.halt_actor(record.action.id)
        retryable = isinstance(error, TryAgain) and SKILLS[record.action.skill].retryable
        if retryable and record.retries < MAX_RETRIES:
            record.retries += 1
            record.error = f"trying again after: {error}"
            self._tell(record)
            branch.resume_ns = now_ns + round(BACK_OFF_S * NS_PER_S)
            return
        record.cause = next((cause for kind, cause in CAUSES if isinstance(error, kind)), None)
        self._give_up(record, str(error), error.status)

    def _give_up(
        self, record: ActionRecord, error: str, status: ActionStatus = ActionStatus.ABORTED
    ) -> None:
        """End an action without success, and with it the rest of the plan."""
        self._leave(record, status, error)
        self.cancel(f"{record.action.id} failed")

    def _end(self, record: ActionRecord, status: ActionStatus, error: str) -> None:
        self._branches.pop(record.action.id, None)
        self._leaving.pop(record.action.id, None)
        if record.action.id in self._asked:
            self._context.claims.release(self._holder(record.action))
        record.status = status
        record.error = error
        record.note = self._note_of(record.action.id)
        rest = self._context.rests.pop(record.action.id, None)
        if rest is not None and status is not ActionStatus.SUCCEEDED:
            record.left = _told(rest)
        self._tell(record)

    def _note_of(self, action_id: str) -> str:
        """Return what the result says beside its status: of its skill, and of servers' cancels."""
        note = self._context.notes.pop(action_id, "")
        said = "" if self._context.ros is None else self._context.ros.words_of(action_id)
        return "; ".join(one for one in (note, said) if one)

    def _holder(self, action: Action) -> str:
        return f"{action.skill} ({self._command_id or 'a plan'}, {action.id})"


def _told(rest: Rest) -> dict[str, float]:
    """Return what is left, to the millimetre; empty where nobody knows where the robot is."""
    try:
        return {name: round(value, 3) for name, value in rest().items()}
    except TryAgain:
        return {}


def _drop(branch: _Branch) -> None:
    if branch.skill is not None:
        branch.skill.close()
        branch.skill = None
