"""Carry missions out: give their subtasks to be planned, check criteria, begin at their times."""

import json
import logging
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from datetime import UTC, datetime
from typing import Any, Final

from drivers.clock import NS_PER_S, Clock
from vla_deploy.client.action_status import summary_of
from vla_deploy.client.command_record import MOST_CHARACTERS, part_of
from vla_deploy.client.following import is_lost
from vla_deploy.ipc import CellWriter, Event
from vla_deploy.ipc.payloads.tasks import MissionsDocument, SaidEvent, TaskEvent
from vla_deploy.missions.criteria import Facts, judge, read_criterion
from vla_deploy.missions.errors import MissionInvalid, MissionsUnusable
from vla_deploy.missions.mission import (
    Mission,
    Subtask,
    check_mission,
    mission_from_words,
    read_mission,
)
from vla_deploy.missions.progress import MOST_SPANS, ActionSpan, MissionRun, MissionState, PartState
from vla_deploy.missions.store import MissionStore, newest
from vla_deploy.planning.dialogue.active_plans import LOST_NS
from vla_deploy.planning.dialogue.command import UserCommand
from vla_deploy.planning.dialogue.command_manager import CommandManager
from vla_deploy.planning.dialogue.event_publisher import PlannerEvents
from vla_deploy.planning.dialogue.situation import Situation
from vla_deploy.planning.errors import CommandUnreadable
from vla_deploy.plans.plan import Action
from vla_deploy.plans.symbolic.simulation import parts_of

CHECK_WAIT_S: Final = 4.0
"""So long the world may take to show that a criterion is met."""
MOST_OPEN: Final = 10
"""Missions that have not ended."""
MOST_SHOWN: Final = 8
MOST_SHOWN_BYTES: Final = 250_000
MOST_TOLD_CHARACTERS: Final = 2000
_PERIOD_NS: Final = NS_PER_S // 5
MOST_AT_ONCE: Final = 6
"""Subtasks that are planned or carried out: the executor takes eight commands."""
_REPORTS: Final = re.compile(
    r"(?:give (?:me )?a )?report(?: back)?(?: to me)?|(?:tell me|say) (?:how it went|what you did)",
    re.IGNORECASE,
)

_log = logging.getLogger(__name__)


class MissionManager:
    """Hold the missions of a robot; `wall_s` returns Unix seconds."""

    def __init__(
        self,
        manager: CommandManager,
        situation: Situation,
        publisher: PlannerEvents,
        shown: CellWriter[MissionsDocument],
        clock: Clock,
        wall_s: Callable[[], float],
        parts: Sequence[str],
        store: MissionStore | None = None,
        run_id: str = "",
    ) -> None:
        self._manager = manager
        self._situation = situation
        self._publisher = publisher
        self._shown = shown
        self._clock = clock
        self._wall_s = wall_s
        self._parts = parts
        self._store = store or MissionStore()
        self._run_id = run_id
        self._runs: dict[str, MissionRun] = {}
        self._outcomes: dict[str, list[str]] = {}
        self._missed_ns: dict[str, int] = {}
        self._checked_ns: dict[tuple[str, str], int] = {}
        self._trouble = ""
        self._is_changed = False
        self._due_ns = 0
        self._load()

    # --- what comes in --------------------------------------------------------------------------

    def takes(self, command: UserCommand, mission: Any = None) -> bool:
        """Take an utterance that is a mission; return False for a plain command.

        Raises:
            CommandUnreadable: it is a mission with faults; all are named.
        """
        try:
            found = self._of_words(command) if mission is None else read_mission(mission)
            if found is None:
                return False
            check_mission(found, self._situation.facts().world, self._parts, self._wall_s())
        except MissionInvalid as error:
            raise CommandUnreadable(str(error)) from error
        known = self._runs.get(command.command_id)
        if known is not None and not known.state.is_final:
            raise CommandUnreadable(f'a mission "{known.mission_id}" is open already')
        if sum(not one.state.is_final for one in self._runs.values()) >= MOST_OPEN:
            raise CommandUnreadable(f"{MOST_OPEN} missions are open already; cancel one first")
        self._accept(command, found)
        return True

    def are_several(self, text: str) -> bool:
        """Return whether words are a mission, or faulty ones of one."""
        if not text or len(text) > MOST_CHARACTERS:
            return False
        try:
            return self._of_words(UserCommand(command_id="", told_ns=0, text=text)) is not None
        except MissionInvalid:
            return True

    def _of_words(self, command: UserCommand) -> Mission | None:
        if command.plan is not None or command.is_answer:
            return None
        if command.is_doubted or command.is_unsure or command.awaits_word:
            return None  # such words are read back or held as a whole
        now = datetime.fromtimestamp(self._wall_s(), UTC).astimezone()
        found = mission_from_words(command.text, now)
        if found is not None and found.schedule.when:
            try:
                read_criterion(found.schedule.when, self._situation.facts().world)
            except MissionInvalid:  # a condition that only a person can judge is for the dialogue
                return None
        return found

    def _accept(self, command: UserCommand, mission: Mission) -> None:
        run = MissionRun(
            mission_id=command.command_id,
            run_id=self._run_id,
            mission=mission,
            source=command.source,
            heard_confidence=command.heard_confidence,
            given_unix_s=self._wall_s(),
            due_unix_s=mission.schedule.at_unix_s,
        )
        self._runs[run.mission_id] = run
        self._publisher.publish({"command_id": run.mission_id, "event": "accepted"})
        if mission.schedule.is_at_once:
            self._begin(run)
        else:
            self._tell_said(run, _appointment(run, self._wall_s()))
            self._tell_finished(run)
        self._keep()

    def cancel(self, mission_id: str, why: str) -> bool:
        """End a mission; return False where there is none that has not ended."""
        run = self._runs.get(mission_id)
        if run is None or (run.state.is_final and not run.repeats()):
            return False
        under_way = [
            name for name, part in run.subtasks.items() if part.state is PartState.EXECUTING
        ]
        was_executing = run.state in (MissionState.EXECUTING, MissionState.PAUSED)
        run.cancel(why, self._wall_s())
        for name in under_way:
            self._manager.drop(_command_id(run, name))
        if was_executing:
            self._tell_finished(run)
        self._keep()
        return True

    def stop(self, why: str) -> None:
        """End the missions that are carried out; those that wait for their time wait on."""
        for run in list(self._runs.values()):
            if run.state in (MissionState.EXECUTING, MissionState.PAUSED):
                self.cancel(run.mission_id, why)

    @property
    def under_way(self) -> list[str]:
        """Return the missions that are carried out."""
        is_open = (MissionState.EXECUTING, MissionState.PAUSED)
        return [name for name, run in self._runs.items() if run.state in is_open]

    def note(self, told: Event[TaskEvent]) -> None:
        """Note what becomes of a subtask."""
        event, age_s = told.payload, (self._clock.now_ns() - told.stamp_ns) / NS_PER_S
        stamp_s = self._wall_s() - age_s
        run, name = self._part_of(event["command_id"])
        if run is None or run.subtasks[name].state is not PartState.EXECUTING:
            return
        if told.stamp_ns < run.subtasks[name].given_ns:
            return  # of the cycle before
        if event["event"] == "action":
            _note_span(run, name, event, stamp_s)
            self._is_changed = True
        elif event["event"] == "said":
            said: SaidEvent = {"command_id": run.mission_id, "event": "said", "text": event["text"]}
            self._publisher.publish(said)
        elif event["event"] == "rejected":
            self._ended(run, name, event["reason"])
        elif event["event"] == "finished":
            statuses = [one["status"] for one in event["actions"]]
            self._outcomes.setdefault(run.mission_id, []).extend(statuses)
            error = "" if event["success"] else event["error"] or "it failed"
            self._ended(run, name, error, is_lost=is_lost(event))

    def _ended(self, run: MissionRun, name: str, error: str, *, is_lost: bool = False) -> None:
        states = {one: part.state for one, part in run.objectives.items()}
        run.end(name, self._wall_s(), error, is_lost=is_lost)
        self._tell_part(run, name)
        self._tell_others(run, states, name)
        self._is_changed = True

    # --- what goes on ---------------------------------------------------------------------------

    def advance(self) -> None:
        """Begin what is due, give what is ready, check what has ended."""
        now_ns = self._clock.now_ns()
        if now_ns < self._due_ns:
            return
        self._due_ns = now_ns + _PERIOD_NS
        for run in list(self._runs.values()):
            self._advance(run)
        if self._is_changed:
            self._keep()

    def _advance(self, run: MissionRun) -> None:
        if self._is_due(run):
            self._begin(run)
            self._is_changed = True
        if run.state not in (MissionState.EXECUTING, MissionState.PAUSED):
            return
        if why := self._situation.why_not_ready():  # a stop ends it for good
            self.cancel(run.mission_id, why)
            return
        self._note_pause(run)
        self._end_forgotten(run)
        if run.state is not MissionState.EXECUTING:
            return
        self._check(run)
        if run.settle():
            self._tell_finished(run)
            if run.repeats():
                run.state = MissionState.PLANNING
            self._is_changed = True
            return
        for name, subtask in run.ready():
            if self._in_work >= MOST_AT_ONCE:
                return
            self._give(run, name, subtask)

    @property
    def _in_work(self) -> int:
        return sum(
            part.state is PartState.EXECUTING
            for run in self._runs.values()
            for part in run.subtasks.values()
        )

    def _end_forgotten(self, run: MissionRun) -> None:
        """End what is given, but neither planned nor carried out by anybody any more."""
        now_ns = self._clock.now_ns()
        known = self._manager.in_work | (self._situation.executing or frozenset())
        for name, part in run.subtasks.items():
            command_id = _command_id(run, name)
            if part.state is not PartState.EXECUTING or command_id in known:
                self._missed_ns.pop(command_id, None)
            elif now_ns - self._missed_ns.setdefault(command_id, now_ns) > LOST_NS:
                self._ended(run, name, "nobody carries it out any more", is_lost=True)

    def _is_due(self, run: MissionRun) -> bool:
        if run.state is not MissionState.PLANNING:
            return False
        if run.due_unix_s is not None and self._wall_s() < run.due_unix_s:
            return False
        condition = run.mission.schedule.when
        if not condition:
            return True
        try:
            return judge(condition, self._situation.facts()) == ""
        except MissionInvalid:
            return False

    def _note_pause(self, run: MissionRun) -> None:
        is_paused = self._manager.is_paused or self._situation.is_paused
        state = MissionState.PAUSED if is_paused else MissionState.EXECUTING
        if run.state is not state:
            run.state = state
            self._is_changed = True

    def _begin(self, run: MissionRun) -> None:
        self._outcomes[run.mission_id] = []
        run.begin(self._wall_s())

    def _give(self, run: MissionRun, name: str, subtask: Subtask) -> None:
        run.start(name, self._wall_s())
        run.subtasks[name].given_ns = self._clock.now_ns()
        plan: dict[str, Any] | None = None
        if _REPORTS.fullmatch(subtask.words.strip()):
            said = {"id": "a1", "skill": "speak", "parameters": {"text": run.spoken_report()}}
            plan = {"goal": subtask.words, "actions": [said]}
        elif subtask.actions:
            actions = [one.model_dump(mode="json") for one in subtask.actions]
            plan = {"goal": subtask.words or run.mission.goal, "actions": actions}
        self._manager.take_part(
            UserCommand(
                command_id=_command_id(run, name),
                told_ns=self._clock.now_ns(),
                source=run.source,
                heard_confidence=run.heard_confidence,
                text=subtask.words,
                plan=plan,
                mission=run.mission_id,
            )
        )
        self._tell_part(run, name)
        self._is_changed = True

    def _check(self, run: MissionRun) -> None:
        """Judge the criteria of what has ended; the world has a moment to show them met."""
        facts = None
        for name, _, criteria in run.checking():
            now_s, now_ns = self._wall_s(), self._clock.now_ns()
            since_ns = self._checked_ns.setdefault((run.mission_id, name), now_ns)
            facts = facts or (self._situation.facts() if criteria else None)
            verdicts = [(text, _judged(text, facts)) for text in criteria if facts is not None]
            unmet = [f'"{text}" is not met: {why}' for text, why in verdicts if why]
            unknown = [f'"{text}" could not be checked' for text, why in verdicts if why is None]
            is_over = now_ns - since_ns >= CHECK_WAIT_S * NS_PER_S
            if (unmet or unknown) and not is_over:
                continue
            del self._checked_ns[run.mission_id, name]
            states = {one: run_of.state for one, run_of in run.objectives.items()}
            run.conclude(name, now_s, "; ".join(unmet), "; ".join(unknown))
            self._tell_part(run, name)
            self._tell_others(run, states, name)
            self._is_changed = True

    # --- what is told ---------------------------------------------------------------------------

    def _part_of(self, command_id: str) -> tuple[MissionRun | None, str]:
        mission_id, name = part_of(command_id)
        run = self._runs.get(mission_id)
        is_it = run is not None and name in run.subtasks and _command_id(run, name) == command_id
        return (run, name) if is_it else (None, "")

    def _tell_part(self, run: MissionRun, name: str) -> None:
        """Publish how a part stands; of an objective with one subtask the objective alone."""
        part = run.subtasks.get(name) or run.objectives[name]
        objective, is_only = name.partition(".")[0], _is_only(run, name)
        if part.state is PartState.CHECKING or (is_only and part.state is PartState.COMPLETED):
            return
        name = objective if is_only else name
        self._publisher.publish(
            {
                "command_id": run.mission_id,
                "event": "objective",
                "part": name,
                "words": _words_of(run, name),
                "state": part.state.value,
                "error": _bounded(part.error) or None,
                "note": _bounded(part.note) or None,
            }
        )

    def _tell_others(self, run: MissionRun, states: Mapping[str, PartState], told: str) -> None:
        """Publish which objectives ended with a part, because they depend on it or have it."""
        for name, part in run.objectives.items():
            is_told = name == told or (_is_only(run, told) and told.startswith(f"{name}."))
            if part.state is not states[name] and part.state.is_final and not is_told:
                self._tell_part(run, name)

    def _say(self, run: MissionRun, text: str) -> None:
        command = UserCommand(command_id=run.mission_id, told_ns=0, source=run.source)
        self._publisher.say(command, text)

    def _tell_said(self, run: MissionRun, text: str) -> None:
        self._publisher.publish({"command_id": run.mission_id, "event": "said", "text": text})
        self._say(run, text)

    def _tell_finished(self, run: MissionRun) -> None:
        is_success = run.state in (MissionState.COMPLETED, MissionState.PLANNING)
        self._publisher.publish(
            {
                "command_id": run.mission_id,
                "event": "finished",
                "success": is_success,
                "error": None if is_success else _bounded(run.error or run.report()),
                "summary": summary_of(self._outcomes.pop(run.mission_id, ())),
                "actions": [],
            }
        )
        if run.state in (MissionState.COMPLETED, MissionState.FAILED):
            self._say(run, run.report())

    def _keep(self) -> None:
        """Keep and show how the missions stand."""
        self._is_changed = False
        self._runs = {one.mission_id: one for one in newest(list(self._runs.values()))}
        try:
            self._store.save(list(self._runs.values()))
            self._trouble = ""
        except MissionsUnusable as error:
            if not self._trouble:
                _log.warning("%s", error)
            self._trouble = str(error)
        missions, room = [], MOST_SHOWN_BYTES
        for one in self._newest_first():
            document = one.model_dump(mode="json")
            room -= len(json.dumps(document))
            missions += [document] if room >= 0 else []
        self._shown.put_document(
            {"missions": missions, "now_unix_s": self._wall_s(), "trouble": self._trouble}
        )

    def _newest_first(self) -> list[MissionRun]:
        """Return all that have not ended, then the newest of the others."""
        runs = list(reversed(self._runs.values()))
        is_open = [one for one in runs if not one.state.is_final]
        return [*is_open, *[one for one in runs if one.state.is_final][:MOST_SHOWN]]

    def _load(self) -> None:
        """Take up what another planner of this run left; what another run left does not move."""
        try:
            runs = self._store.load()
        except MissionsUnusable as error:
            _log.warning("%s", error)
            self._store.keep_unreadable()
            runs = []
        for run in runs:
            self._runs[run.mission_id] = run
            is_open = run.state in (MissionState.EXECUTING, MissionState.PAUSED)
            if is_open and run.run_id != self._run_id:
                run.cancel("the robot was shut down meanwhile", self._wall_s())
            elif is_open:
                run.state = MissionState.EXECUTING
        self._keep()

    def take_up(self, events: Iterable[Event[TaskEvent]]) -> None:
        """Go on with what another planner of this run began; `events` came in the meantime."""
        for event in events:
            self.note(event)
        executing = self._situation.executing or frozenset()
        for run in self._runs.values():
            for name, part in run.subtasks.items():
                if part.state is PartState.EXECUTING and _command_id(run, name) not in executing:
                    why = "the planner was started again"
                    run.end(name, self._wall_s(), why, is_lost=True)
        self._keep()


def _command_id(run: MissionRun, name: str) -> str:
    """Return the id of a subtask's command: another one for each try."""
    tries = run.subtasks[name].tries
    return f"{run.mission_id}/{name}" + (f"+{tries}" if tries > 1 else "")


def _bounded(text: str) -> str:
    return text if len(text) <= MOST_TOLD_CHARACTERS else f"{text[:MOST_TOLD_CHARACTERS]} ..."


def _is_only(run: MissionRun, name: str) -> bool:
    """Return whether a subtask is the only one of its objective."""
    objective = name.partition(".")[0]
    beside = [one for one in run.subtasks if one.startswith(f"{objective}.")]
    return name != objective and len(beside) == 1


def _words_of(run: MissionRun, name: str) -> str:
    for objective in run.mission.objectives:
        if objective.id == name:
            return objective.words
        for subtask in objective.subtasks:
            if f"{objective.id}.{subtask.id}" == name:
                return subtask.words or ", ".join(one.skill for one in subtask.actions)
    return ""


def _judged(text: str, facts: Facts) -> str | None:
    try:
        return judge(text, facts)
    except MissionInvalid as error:
        return str(error)


def _appointment(run: MissionRun, now_s: float) -> str:
    schedule = run.mission.schedule
    if schedule.when:
        return f"I do that as soon as {schedule.when}."
    if schedule.every_s is not None:
        return f"I do that every {_span_words(schedule.every_s)}, from now on."
    at = datetime.fromtimestamp(run.due_unix_s or now_s, UTC).astimezone()
    return f"I do that at {at:%H:%M}."


def _span_words(duration_s: float) -> str:
    for unit, size_s in (("hour", 3600.0), ("minute", 60.0), ("second", 1.0)):
        if duration_s >= size_s and duration_s % size_s == 0:
            count = round(duration_s / size_s)
            return unit if count == 1 else f"{count} {unit}s"
    return f"{duration_s:g} seconds"


def _note_span(run: MissionRun, name: str, event: Mapping[str, Any], stamp_s: float) -> None:
    """Note which parts of the robot an action uses, from its beginning to its end."""
    open_one = next(
        (
            one
            for one in run.spans
            if one.subtask == name and one.action_id == event["action_id"] and one.end_s is None
        ),
        None,
    )
    if open_one is None and event["status"] == "active":
        parameters = dict(event["parameters"])
        action = Action(id="a", skill=event["skill"], parameters=parameters)
        run.spans.append(
            ActionSpan(
                subtask=name,
                action_id=event["action_id"],
                skill=event["skill"],
                parts=tuple(sorted(parts_of(action))),
                begin_s=stamp_s,
            )
        )
        del run.spans[:-MOST_SPANS]
    elif open_one is not None and event["status"] != "active":
        open_one.end_s, open_one.status = stamp_s, event["status"]
