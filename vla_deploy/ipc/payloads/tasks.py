"""Type what commands, plans and their execution pass on.

`plan` is a plan as `vla_deploy/plans/plan.py` writes it; that model reads and checks it.
"""

from collections.abc import Mapping
from typing import Any, Literal, NotRequired, TypedDict, final

PlanDocument = dict[str, Any]
ActionStatusName = Literal[
    "pending", "active", "succeeded", "cancelled", "aborted", "rejected", "lost"
]


class OtherWords(TypedDict):
    """Hold what may have been said instead, and how likely next to what was understood."""

    text: str
    odds: float


class HeardDoubt(TypedDict, total=False):
    """Say that words may be wrong; `ask_again` permits the planner to ask for them."""

    doubted: bool
    ask_again: bool


class HeardEvidence(HeardDoubt):
    """Say how sure words are, 0 to 1."""

    confidence: float
    others: list[OtherWords]


class MissionAct(TypedDict):
    """Cancel a mission, one that waits for its time among them."""

    cancel: str


class UtteranceContent(TypedDict, total=False):
    """Give a command in words or as a plan, cancel or pause all, or answer what was asked alone.

    `mission` is one as a document, or an act about one that was given.

    `heard` comes with the source "voice".
    """

    text: str
    plan: PlanDocument
    cancel: bool
    pause: bool
    mission: dict[str, Any] | list[Any]
    mission_act: MissionAct
    answer: bool
    heard: HeardEvidence


class AgentLease(TypedDict):
    """Permit agents to give commands from `granted_ns` until `until_ns` of the run's clock.

    `granted_by` and `revoked_by` are persons; while nobody has taken it back, the latter is "".
    """

    granted_ns: int
    until_ns: int
    granted_by: str
    revoked_by: str


class Utterance(UtteranceContent):
    """Say also who speaks; answers carry the id."""

    command_id: str
    source: str


@final
class PlanOrder(TypedDict):
    """Give the executor a plan."""

    command_id: str
    plan: PlanDocument


@final
class PlanCancel(TypedDict):
    """End what the executor does, or with `of` one of its commands."""

    command_id: str
    cancel: Literal[True]
    of: NotRequired[str]


@final
class PlanGivenUp(TypedDict):
    """End a command after a setback: there is no other plan, and why."""

    command_id: str
    give_up: str


@final
class PlanPause(TypedDict):
    """Have all that the executor does come to rest, or go on."""

    command_id: str
    pause: bool


PlanMessage = PlanOrder | PlanCancel | PlanGivenUp | PlanPause


class AttemptDocument(TypedDict):
    """Say what one back end of the planner made of a command."""

    rung: str
    outcome: Literal["planned", "asked", "invalid", "refused", "declined", "late"]
    took_s: float
    reason: NotRequired[str]


class ActionOutcome(TypedDict):
    """Say how an action goes; `note` is what its result says beside the status, `data` has numbers.

    `data` has of navigate_to, move, turn: x_m, y_m, yaw_rad of the base; of pick_up, hand_over,
    place: arm and class of the thing; of find_object: thing_id, position_m; of others nothing.
    """

    skill: str
    parameters: Mapping[str, Any]
    status: ActionStatusName
    execution_time_s: float
    error: str | None
    retries: int
    note: str | None
    data: Mapping[str, Any]


class ActionResult(ActionOutcome):
    """Say how an action went."""

    id: str


class QueuedEvent(TypedDict):
    """Others are planned first."""

    command_id: str
    event: Literal["queued"]
    place: int


class PlanningEvent(TypedDict):
    """A plan takes time; `rungs` are the back ends that are asked."""

    command_id: str
    event: Literal["planning"]
    rungs: list[str]


class AskedEvent(TypedDict):
    """A person is asked; `plan` is what a yes, or one of the choices, lets run."""

    command_id: str
    event: Literal["asked"]
    question: str
    choices: list[str]
    answer_within_s: float
    plan: PlanDocument | None


class AnsweredEvent(TypedDict):
    """The utterance answers what command `of` asked."""

    command_id: str
    event: Literal["answered"]
    of: str


class AcceptedEvent(TypedDict):
    """The command has a plan, for the first time."""

    command_id: str
    event: Literal["accepted"]


class RejectedEvent(TypedDict):
    """Nothing is done, and why."""

    command_id: str
    event: Literal["rejected"]
    reason: str
    attempts: NotRequired[list[AttemptDocument]]


class PlanEvent(TypedDict):
    """A plan goes to the executor; `origin` is its strategy, after a failure."""

    command_id: str
    event: Literal["plan"]
    plan: PlanDocument
    rung: NotRequired[str]
    confidence: NotRequired[float]
    origin: NotRequired[str]
    attempts: NotRequired[list[AttemptDocument]]


class ActionEvent(ActionOutcome):
    """An action begins, goes on or has ended."""

    command_id: str
    event: Literal["action"]
    action_id: str


class SetbackEvent(TypedDict):
    """A plan failed, another is looked for.

    `left` has for each `move` or `turn` that had begun the parameters of its rest, none where
    nobody knows it.
    """

    command_id: str
    event: Literal["setback"]
    action_id: str
    skill: str
    error: str
    cause: str
    done: list[str]
    left: dict[str, Mapping[str, float]]


class SaidEvent(TypedDict):
    """The robot says something to whom gave the command."""

    command_id: str
    event: Literal["said"]
    text: str


class CommandSummary(TypedDict):
    """Count the actions of a command, those of plans that failed among them."""

    total_actions: int
    successful_actions: int
    failed_actions: int
    success_rate: float


class ObjectiveEvent(TypedDict):
    """An objective of a mission, or one of its subtasks, stands otherwise than before."""

    command_id: str
    event: Literal["objective"]
    part: str
    words: str
    state: str
    error: str | None
    note: str | None


class FinishedEvent(TypedDict):
    """The command has ended; `actions` are those of all its plans.

    `success` of a plan with `continue_on_error` is that any of its actions succeeded.
    """

    command_id: str
    event: Literal["finished"]
    success: bool
    error: str | None
    summary: CommandSummary
    actions: list[ActionResult]


TaskEvent = (
    QueuedEvent
    | PlanningEvent
    | AskedEvent
    | AnsweredEvent
    | AcceptedEvent
    | RejectedEvent
    | PlanEvent
    | ActionEvent
    | SetbackEvent
    | SaidEvent
    | ObjectiveEvent
    | FinishedEvent
)


class GripDocument(TypedDict):
    """Say how a hand holds a thing, as `vla_deploy/skills/context.py` has it."""

    kind: str
    colour: str
    width_m: float
    below_grip_m: float
    tilt_rad: float


class ExecutorStatus(TypedDict):
    """Hold what the executor does; `way_m` is the base's path, `holding` the class in each hand.

    `commands` are all that are carried out, `command_id`, `action_id` and `skill` of the first.
    """

    state: Literal["idle", "executing", "recovering", "paused"]
    commands: list[str]
    command_id: str | None
    action_id: str | None
    skill: str | None
    way_m: list[list[float]]
    holding: dict[str, str | None]
    grips: dict[str, GripDocument]


class MemoryStatus(TypedDict):
    """Say how remembering goes; `waiting` are entries not yet written."""

    file: str
    waiting: int
    trouble: str


class PlannerCounts(TypedDict):
    """Count what came of commands, and of each back end by its name."""

    heard: int
    planned: int
    refused: int
    asked: int
    failed: int
    by_rung: Mapping[str, Mapping[str, int]]


class BackEndsStatus(TypedDict):
    """Name the back ends; `servers` are counts of the server module, `away` why one is not used."""

    rungs: list[str]
    servers: list[dict[str, Any]]
    away: Mapping[str, str]


class PlannerStatus(PlannerCounts, BackEndsStatus):
    """Hold which commands are in work, what was asked, what is forbidden, how remembering goes."""

    commands: list[str]
    question: str | None
    prohibitions: list[str]
    memory: MemoryStatus | None


class MissionsDocument(TypedDict):
    """Hold the newest missions, the newest first, as `vla_deploy/missions/progress.py` has them.

    Those that have not ended come first, as far as there is room. `now_unix_s` is when that was
    so, `trouble` says why missions are not kept over a restart, "" where they are.
    """

    missions: list[dict[str, Any]]
    now_unix_s: float
    trouble: str
