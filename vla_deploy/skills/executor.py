"""Run one plan: actions as their dependencies allow, each bounded in time, some tried twice."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

from drivers.clock import NS_PER_S
from vla_deploy.client.action_status import FINAL, ActionStatus
from vla_deploy.client.readiness import refusal_of
from vla_deploy.ipc import Book, ClaimRefused, IpcError
from vla_deploy.ipc.claims import obstacles
from vla_deploy.plans.catalogue import SKILLS
from vla_deploy.plans.plan import Action, FailureCause, Plan, execution_order
from vla_deploy.plans.symbolic.state import SymbolicState
from vla_deploy.skills.context import Rest, Skill, SkillContext
from vla_deploy.skills.errors import (
    EffectMissing,
    NotPossible,
    PreconditionUnmet,
    RefusedAtStart,
    RobotNotReady,
    SkillFailed,
    TryAgain,
)
from vla_deploy.skills.records import ActionRecord, has_succeeded
from vla_deploy.skills.resources import WAIT_LIMIT_S, body_of, needs_of
from vla_deploy.skills.table import SKILL_FUNCTIONS
from vla_deploy.skills.world_check import WorldCheck

BACK_OFF_S = 1.0
"""Before the first retry; twice as long before each further one, up to the longest."""
LONGEST_BACK_OFF_S = 8.0
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


@dataclass(slots=True, kw_only=True)
class _Branch:
    """Hold one action under way; `skill` is None before its first step and between two tries.

    `done_ns` is when the skill came to its end; its effect is looked for from then on. Of the time
    since `started_ns` pauses do not count.
    """

    record: ActionRecord
    started_ns: int
    skill: Skill | None = None
    resume_ns: int = 0
    done_ns: int = 0
    unmet_ns: int = 0
    before: SymbolicState = field(default_factory=SymbolicState)

    @property
    def has_not_begun(self) -> bool:
        """Return whether its skill has not made a step yet."""
        return self.skill is None and not self.done_ns and not self.record.retries


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
        self._tell = tell
        self._only_speaks = all(one.skill == "speak" for one in plan.actions)
        self._command_id = command_id
        self._world = WorldCheck(context)
        self._branches: dict[str, _Branch] = {}
        self._leaving: dict[str, tuple[ActionStatus, str]] = {}
        """How actions end as soon as servers beyond the robot have ended their goals."""
        self._asked: dict[str, int] = {}
        """Since when each action has asked for parts of the robot, by the time that works."""

    @property
    def finished(self) -> bool:
        """Return whether every action has its final status."""
        return all(record.status in FINAL for record in self.records)

    @property
    def succeeded(self) -> bool:
        """Return whether it succeeded, by its own options."""
        goes_on = self.plan.options.continue_on_error
        return has_succeeded(self.records, continue_on_error=goes_on)

    @property
    def setback(self) -> ActionRecord | None:
        """Return the action that failed in a way that another plan may mend, or None.

        A plan that goes on where actions fail needs no other.
        """
        if self.plan.options.continue_on_error:
            return None
        return next((one for one in self.records if one.cause is not None), None)

    @property
    def active(self) -> ActionRecord | None:
        """Return the action that has been under way for longest, or still has to end."""
        under_way = (branch.record for branch in self._branches.values())
        return next(under_way, None) or next(map(self._record, self._leaving), None)

    def step(self) -> None:
        """Start what may start, and advance every action under way; in a pause it only speaks."""
        now_ns = self._context.link.clock.now_ns()
        self._end_left()
        is_paused = self._context.link.is_paused and not self._only_speaks
        refusal = refusal_of(self._context.link.control_status)
        if not is_paused:
            self._start_ready()
        if refusal and (is_paused or not self._branches):
            self.cancel(refusal)  # a stop ends what is paused, and what waits for its turn, too
        for name, branch in list(self._branches.items()):
            is_open = branch.record.status not in FINAL and name not in self._leaving
            is_due = refusal or now_ns >= branch.resume_ns
            if is_open and is_due and not is_paused:
                self._step_branch(branch, now_ns)

    def cancel(self, reason: str) -> None:
        """Stop every motion of the plan now and cancel what has not ended.

        What servers beyond the robot do ends when they have answered, in one of the next steps.
        """
        for branch in self._branches.values():
            _drop(branch)
            self._context.link.halt_actor(self._actor(branch.record.action))
        for record in self.records:
            if record.status not in FINAL and record.action.id not in self._leaving:
                self._leave(record, ActionStatus.CANCELLED, reason)

    def abandon(self) -> None:
        """End what is left without the word of servers that have not answered yet."""
        for action_id, (status, error) in list(self._leaving.items()):
            record = self._record(action_id)
            actor = self._actor(record.action)
            self._context.notes[actor] = "not waited for its server to end its goal"
            self._end(record, status, error)

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
        return ros is not None and ros.is_ending(self._actor(action))

    def _record(self, action_id: str) -> ActionRecord:
        return next(one for one in self.records if one.action.id == action_id)

    def _start_ready(self) -> None:
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
                self._start_if_granted(record, book)

    def _ask_once(self, record: ActionRecord) -> None:
        if record.action.id not in self._asked and record.status not in FINAL:
            self._asked[record.action.id] = self._context.link.working_ns()
            self._ask(record)

    def _ask(self, record: ActionRecord) -> None:
        action, robot = record.action, self._context.robot
        needs = needs_of(action, robot)
        if missing := sorted(needs.keys() - body_of(robot).keys()):
            self._give_up(record, f"{robot.name} has no {' and no '.join(missing)}")
            return
        try:
            self._context.claims.ask(
                self._holder(action),
                needs,
                priority=-action.priority,  # claims know the greatest as the first
                timeout_s=WAIT_LIMIT_S,
            )
        except ClaimRefused as error:
            self._give_up(record, str(error))

    def _start_if_granted(self, record: ActionRecord, book: Book) -> None:
        holder = self._holder(record.action)
        working_ns = self._context.link.working_ns()
        waited_s = (working_ns - self._asked[record.action.id]) / NS_PER_S
        if book.holds(holder):
            self._branches[record.action.id] = _Branch(record=record, started_ns=working_ns)
            self._context.needs[holder] = needs_of(record.action, self._context.robot)
            record.status = ActionStatus.ACTIVE
            self._tell(record)
        elif book.waits(holder):
            return
        elif waited_s < WAIT_LIMIT_S:  # the claim ran out in a pause
            self._ask(record)
        else:
            needs = needs_of(record.action, self._context.robot)
            why = obstacles(book, needs) or "others came first"
            self._give_up(record, f"waited {WAIT_LIMIT_S:g} s: {why}")

    def _step_branch(self, branch: _Branch, now_ns: int) -> None:
        record = branch.record
        worked_ns = self._context.link.working_ns() - branch.started_ns
        record.execution_time_s = worked_ns / NS_PER_S
        self._context.link.acting = self._actor(record.action)
        self._context.holder = self._holder(record.action)
        self._context.keeps_out = frozenset(self.plan.keeps_out)
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
            raise RefusedAtStart(refusal) if branch.has_not_begun else RobotNotReady(refusal)
        timeout_s = self._timeout_s(action)
        if branch.record.execution_time_s > timeout_s:
            raise TryAgain(f"{action.skill} took longer than {timeout_s:g} s")
        if self._context.link.is_blind or self._context.link.in_protective_stop:
            self._context.link.rest_base()
            return
        if branch.done_ns:
            self._look_for_effect(branch, self._context.link.clock.now_ns())
            return
        if branch.skill is None and self._is_ending(action):
            return  # a server has still to end what was tried before
        if branch.record.retries and branch.skill is None and not self._context.has_all():
            return  # others use what a phase of the first try has left to them
        if branch.skill is None:
            if self._lacks_need(branch, self._context.link.clock.now_ns()):
                return
            branch.before = self._world.state(action)
            branch.skill = SKILL_FUNCTIONS[action.skill](self._context, action.parameters)
        next(branch.skill)

    def _timeout_s(self, action: Action) -> float:
        spec = SKILLS[action.skill]
        if action.skill == _WAITING:
            return spec.timeout_s
        own_s = self.plan.options.timeouts_s.get(spec.kind, spec.timeout_s)
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
        self._context.link.halt_actor(self._actor(record.action))
        retryable = isinstance(error, TryAgain) and SKILLS[record.action.skill].retryable
        if retryable and record.retries < self.plan.options.max_retries:
            back_off_s = min(BACK_OFF_S * 2**record.retries, LONGEST_BACK_OFF_S)
            record.retries += 1
            record.error = f"trying again after: {error}"
            self._tell(record)
            branch.resume_ns = now_ns + round(back_off_s * NS_PER_S)
            return
        record.cause = next((cause for kind, cause in CAUSES if isinstance(error, kind)), None)
        self._give_up(record, str(error), error.status, ends_all=isinstance(error, RobotNotReady))

    def _give_up(
        self,
        record: ActionRecord,
        error: str,
        status: ActionStatus = ActionStatus.ABORTED,
        *,
        ends_all: bool = False,
    ) -> None:
        """End an action without success, and with it what the plan's options do not let go on."""
        self._leave(record, status, error)
        if ends_all or not self.plan.options.continue_on_error:
            self.cancel(f"{record.action.id} failed")
            return
        gone = {record.action.id}
        for other in self.records:  # in the order of execution
            if other.status is ActionStatus.PENDING and gone.intersection(other.action.depends_on):
                gone.add(other.action.id)
                self._leave(other, ActionStatus.CANCELLED, f"{record.action.id} failed")

    def _end(self, record: ActionRecord, status: ActionStatus, error: str) -> None:
        self._branches.pop(record.action.id, None)
        self._leaving.pop(record.action.id, None)
        if record.action.id in self._asked:
            self._context.needs.pop(self._holder(record.action), None)
            self._context.claims.release(self._holder(record.action))
        record.status = status
        record.error = error
        record.note = self._note_of(record.action)
        record.data = self._context.data.pop(self._actor(record.action), {})
        rest = self._context.rests.pop(self._actor(record.action), None)
        if rest is not None and status is not ActionStatus.SUCCEEDED:
            record.left = _told(rest)
        self._tell(record)

    def _note_of(self, action: Action) -> str:
        """Return what the result says beside its status: of its skill, and of servers' cancels."""
        actor = self._actor(action)
        note = self._context.notes.pop(actor, "")
        said = "" if self._context.ros is None else self._context.ros.words_of(actor)
        return "; ".join(one for one in (note, said) if one)

    def _actor(self, action: Action) -> str:
        return f"{self._command_id}/{action.id}"

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
