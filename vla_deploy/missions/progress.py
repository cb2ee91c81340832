"""Keep how far missions are: which subtasks may begin, which have ended, and what that means."""

from collections.abc import Iterator, Sequence
from enum import StrEnum
from typing import Final

from pydantic import BaseModel, Field

from vla_deploy.missions.mission import Mission, Objective, Subtask

MOST_SPANS: Final = 120
"""Of one mission: what its actions did when, for the time line; the newest are kept."""
MOST_TRIES: Final = 2
"""A subtask that an executor or a planner took with it when it ended is tried once more."""


class MissionState(StrEnum):
    """Name how a mission stands; the last three are final."""

    PLANNING = "planning"
    EXECUTING = "executing"
    PAUSED = "paused"
    COMPLETED = "completed"
    FAILED = "failed"
    CANCELLED = "cancelled"

    @property
    def is_final(self) -> bool:
        """Return whether nothing more comes."""
        return self in (MissionState.COMPLETED, MissionState.FAILED, MissionState.CANCELLED)


class PartState(StrEnum):
    """Name how a subtask or an objective stands."""

    PENDING = "pending"
    EXECUTING = "executing"
    CHECKING = "checking"
    COMPLETED = "completed"
    FAILED = "failed"
    CANCELLED = "cancelled"

    @property
    def is_final(self) -> bool:
        """Return whether nothing more comes."""
        return self in (PartState.COMPLETED, PartState.FAILED, PartState.CANCELLED)


class ActionSpan(BaseModel):
    """Say which parts of the robot one action used, and when (Unix seconds)."""

    subtask: str
    action_id: str
    skill: str
    parts: tuple[str, ...] = ()
    begin_s: float
    end_s: float | None = None
    status: str = "active"


class PartRun(BaseModel):
    """Hold how far a subtask or an objective is; times are Unix seconds.

    `given_ns`, by the clock of the run, is when its command was given.
    """

    state: PartState = PartState.PENDING
    tries: int = 0
    error: str = ""
    note: str = ""
    begin_s: float | None = None
    end_s: float | None = None
    given_ns: int = 0


class MissionRun(BaseModel):
    """Hold one mission and how far it is; `due_unix_s` is when it begins, again or at all."""

    mission_id: str
    run_id: str = ""
    mission: Mission
    source: str = ""
    heard_confidence: float | None = None
    given_unix_s: float
    state: MissionState = MissionState.PLANNING
    due_unix_s: float | None = None
    cycles: int = 0
    error: str = ""
    subtasks: dict[str, PartRun] = Field(default_factory=dict)
    objectives: dict[str, PartRun] = Field(default_factory=dict)
    spans: list[ActionSpan] = Field(default_factory=list)

    # --- beginning ------------------------------------------------------------------------------

    def begin(self, now_s: float) -> None:
        """Begin, with nothing done yet."""
        self.state, self.error, self.spans = MissionState.EXECUTING, "", []
        self.objectives = {one.id: PartRun() for one in self.mission.objectives}
        self.subtasks = {name: PartRun() for name, _, _ in self.all_subtasks()}
        every_s = self.mission.schedule.every_s
        self.due_unix_s = None if every_s is None else now_s + every_s
        self.cycles += 1

    def all_subtasks(self) -> Iterator[tuple[str, Objective, Subtask]]:
        """Yield every subtask with its name in the mission, and its objective."""
        for objective in self.mission.objectives:
            for subtask in objective.subtasks:
                yield f"{objective.id}.{subtask.id}", objective, subtask

    def ready(self) -> list[tuple[str, Subtask]]:
        """Return the subtasks that may begin: dependencies first, then priority, then order."""
        found = []
        for name, objective, subtask in self.all_subtasks():
            done = all(
                self.objectives[one].state is PartState.COMPLETED for one in objective.depends_on
            ) and all(
                self.subtasks[f"{objective.id}.{one}"].state is PartState.COMPLETED
                for one in subtask.depends_on
            )
            if done and self.subtasks[name].state is PartState.PENDING:
                found.append((objective.priority, subtask.priority, name, subtask))
        found.sort(key=lambda one: one[:2])
        return [(name, subtask) for _, _, name, subtask in found]

    # --- what comes of it -----------------------------------------------------------------------

    def start(self, name: str, now_s: float) -> None:
        """Note that a subtask is given to be done."""
        run = self.subtasks[name]
        run.state, run.begin_s, run.tries = PartState.EXECUTING, now_s, run.tries + 1
        objective = self.objectives[name.partition(".")[0]]
        if objective.begin_s is None:
            objective.state, objective.begin_s = PartState.EXECUTING, now_s

    def end(self, name: str, now_s: float, error: str = "", *, is_lost: bool = False) -> None:
        """Note that a subtask has ended; one that was lost is tried once more."""
        run = self.subtasks[name]
        if is_lost and run.tries < MOST_TRIES:
            run.state, run.note = PartState.PENDING, f"begun again: {error}"
            return
        if error:
            self._fail(name, error, now_s)
        else:
            run.state = PartState.CHECKING

    def checking(self) -> list[tuple[str, PartRun, Sequence[str]]]:
        """Return the subtasks, then the objectives, whose criteria are to be judged."""
        found: list[tuple[str, PartRun, Sequence[str]]] = [
            (name, self.subtasks[name], subtask.success_criteria)
            for name, _, subtask in self.all_subtasks()
            if self.subtasks[name].state is PartState.CHECKING
        ]
        for one in self.mission.objectives:
            run = self.objectives[one.id]
            parts = [self.subtasks[f"{one.id}.{sub.id}"].state for sub in one.subtasks]
            if not run.state.is_final and all(part is PartState.COMPLETED for part in parts):
                found.append((one.id, run, one.success_criteria))
        return found

    def conclude(self, name: str, now_s: float, error: str = "", note: str = "") -> None:
        """Note what the criteria of a subtask or an objective came to."""
        run = self.subtasks.get(name) or self.objectives[name]
        run.note = "; ".join(one for one in (run.note, note) if one)
        if error:
            self._fail(name, error, now_s)
        else:
            run.state, run.end_s = PartState.COMPLETED, now_s

    def _fail(self, name: str, error: str, now_s: float) -> None:
        """End a part without success, and with it what depends on it."""
        objective = name.partition(".")[0]
        for part in {name, objective}:
            run = self.subtasks.get(part) or self.objectives[part]
            run.state, run.end_s = PartState.FAILED, now_s
            run.error = run.error or error
        for other, one, _ in self.all_subtasks():
            if one.id == objective and self.subtasks[other].state is PartState.PENDING:
                self._cancel(other, f"{name} failed", now_s)
        self._cancel_after(objective, f"{objective} failed", now_s)

    def _cancel_after(self, objective: str, why: str, now_s: float) -> None:
        """End all objectives that depend on one, directly or not."""
        for later in self.mission.objectives:
            if objective in later.depends_on and not self.objectives[later.id].state.is_final:
                for name in (later.id, *(f"{later.id}.{one.id}" for one in later.subtasks)):
                    self._cancel(name, why, now_s)
                self._cancel_after(later.id, why, now_s)

    def _cancel(self, name: str, why: str, now_s: float) -> None:
        run = self.subtasks.get(name) or self.objectives[name]
        if not run.state.is_final:
            run.state, run.error, run.end_s = PartState.CANCELLED, why, now_s

    def cancel(self, why: str, now_s: float) -> None:
        """End the mission with all that has not ended."""
        for name in (*self.subtasks, *self.objectives):
            self._cancel(name, why, now_s)
        self.state, self.error, self.due_unix_s = MissionState.CANCELLED, why, None
        for span in self.spans:
            if span.end_s is None:
                span.end_s, span.status = now_s, "cancelled"

    def settle(self) -> bool:
        """End the mission where all its objectives have; return whether it has ended now."""
        parts = (*self.objectives.values(), *self.subtasks.values())
        if self.state.is_final or not parts or not all(one.state.is_final for one in parts):
            return False
        is_done = all(one.state is PartState.COMPLETED for one in self.objectives.values())
        self.state = MissionState.COMPLETED if is_done else MissionState.FAILED
        self.error = "" if is_done else self.report()
        return True

    def repeats(self) -> bool:
        """Return whether it begins once more."""
        times = self.mission.schedule.times
        return self.due_unix_s is not None and (times is None or self.cycles < times)

    # --- words ----------------------------------------------------------------------------------

    def spoken_report(self) -> str:
        """Say in short sentences what is done so far, and what is not, at most 500 characters."""
        done = [words for words, _ in self._told(PartState.COMPLETED)]
        told = [f"Done: {'; '.join(done)}." if done else "Nothing is done yet."]
        told += [
            f"Not done: {words}, because {one.error.rstrip('.')}."
            for words, one in self._told(PartState.FAILED)
        ]
        return " ".join(told)[:500]

    def report(self) -> str:
        """Say which objectives are done, and why the others are not."""
        done = [words for words, _ in self._told(PartState.COMPLETED)]
        told = [
            f"{len(done)} of {len(self.objectives)} objectives done"
            + (f": {', '.join(done)}" if done else "")
        ]
        told += [
            f"{words}: {one.state}: {one.error}"
            for words, one in self._told(PartState.FAILED, PartState.CANCELLED)
        ]
        return "; ".join(told)

    def _told(self, *states: PartState) -> Iterator[tuple[str, PartRun]]:
        """Yield the objectives that stand so, each in its words."""
        for one in self.mission.objectives:
            run = self.objectives[one.id]
            if run.state in states:
                yield one.words or one.id, run
