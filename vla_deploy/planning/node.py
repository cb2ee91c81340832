"""Run the planner: commands in words or plans in any dialect in, validated plans out."""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from typing import Final

from drivers.clock import NS_PER_S, Clock, MonotonicClock
from platforms import Profile
from vla_deploy.client.access.audit_log import AuditLog
from vla_deploy.client.agent_lease import LeaseKeeper
from vla_deploy.ipc import CellWriter, Event, RingReader, SharedSpace, topics
from vla_deploy.ipc.payloads.tasks import PlanMessage, PlannerStatus, TaskEvent, Utterance
from vla_deploy.memory import MemoryStore
from vla_deploy.memory.episode import unix_s
from vla_deploy.memory.keeper import MemoryKeeper
from vla_deploy.missions.store import MissionStore
from vla_deploy.planning.assembly import planner_for
from vla_deploy.planning.dialogue.active_plans import RESTARTED
from vla_deploy.planning.dialogue.agent_guard import AgentGuard
from vla_deploy.planning.dialogue.battery_watch import BatteryWatch
from vla_deploy.planning.dialogue.command import (
    UserCommand,
    asks_to_stop,
    command_id_of,
    read_command,
)
from vla_deploy.planning.dialogue.command_manager import CommandManager
from vla_deploy.planning.dialogue.event_publisher import PlannerEvents
from vla_deploy.planning.dialogue.mission_manager import MissionManager
from vla_deploy.planning.dialogue.situation import Situation
from vla_deploy.planning.errors import NotReadyToMove
from vla_deploy.planning.planner import Planner
from vla_deploy.planning.prohibitions import Prohibitions
from vla_deploy.plans.agent_rules import LEASE_ENDED, of_agent
from vla_deploy.plans.errors import PlanError
from vla_deploy.robots import RobotDescription
from vla_deploy.runtime.executors import InlineExecutor, low_priority_thread
from vla_deploy.runtime.node import NodeContext
from vla_deploy.world.own_words import OwnWords
from vla_deploy.world.surfaces import furniture_points

UTTERANCE_AGE_S: Final = 5.0
_STATUS_PERIOD_NS: Final = NS_PER_S // 2
AWAY: Final = "the planner was started again while it had this command; give it again"


class PlannerNode:
    """Turn each utterance into a plan for the executor, a question, or a refusal with its reason.

    Slow planning is done in `executor`; a step never waits for it.
    """

    period_s = 0.02

    def __init__(
        self,
        context: NodeContext,
        robot: RobotDescription,
        planner: Planner | None = None,
        executor: Executor | None = None,
        memory: MemoryStore | None = None,
        prohibitions: Prohibitions | None = None,
        missions: MissionStore | None = None,
        wall_s: Callable[[], float] | None = None,
        audit: AuditLog | None = None,
    ) -> None:
        self._space = SharedSpace(context.run_dir / "ipc", context.clock)
        self._clock = context.clock
        self._robot = robot
        self._own_words = OwnWords(robot.words)
        self._run_dir = context.run_dir
        self._planner = planner or Planner(context.clock)
        self._executor = executor or InlineExecutor()
        self._memory = memory
        self._prohibitions = prohibitions
        self._mission_store = missions
        self._wall_s = wall_s or _wall_time_of(context.clock)
        self._agents = AgentGuard(LeaseKeeper(self._space, self._clock), audit)
        self._missions: MissionManager
        self._keeper: MemoryKeeper | None = None
        self._battery: BatteryWatch | None = None
        self._status_due_ns = 0
        self._is_stopped = False
        self._manager: CommandManager
        self._publisher: PlannerEvents
        self._status: CellWriter[PlannerStatus]
        self._utterances: RingReader[Utterance]
        self._events: RingReader[TaskEvent]

    def start(self) -> None:
        """Open the topics; what an earlier planner left is taken up, or refused with the reason."""
        self._utterances = self._space.ring_reader(topics.UTTERANCE, from_start=True)
        self._events = self._space.ring_reader(topics.TASK_EVENT, from_start=True)
        plans = self._space.ring_reader(topics.PLAN, from_start=True)
        told = self._events.drain()
        heard = self._utterances.drain()
        before = _unfinished(heard, told, plans.drain())
        self._agents.remember(heard)
        self._publisher = PlannerEvents(self._space, self._clock)
        if self._memory is not None:
            self._keeper = MemoryKeeper(
                self._memory,
                self._space,
                self._clock,
                low_priority_thread(self._clock),
                run_id=self._run_dir.name,
                places=furniture_points(self._robot.places),
                wall_s=unix_s,
            )
        situation = Situation(self._space, self._clock, self._robot, self._memory)
        self._manager = CommandManager(
            self._planner,
            situation,
            self._publisher,
            self._executor,
            self._clock,
            self._robot.planning.further_plans,
            self._prohibitions,
        )
        if self._robot.battery is not None:
            self._battery = BatteryWatch(
                self._robot.battery, situation, self._manager, self._space, self._clock
            )
        self._status = self._space.cell_writer(topics.PLANNER_STATUS)
        self._missions = MissionManager(
            self._manager,
            situation,
            self._publisher,
            self._space.cell_writer(topics.MISSIONS),
            self._clock,
            self._wall_s,
            (*self._robot.groups, "camera", "speaker"),
            self._mission_store,
            run_id=self._run_dir.name,
        )
        self._manager.ends_missions = partial(self._missions.stop, "cancelled on request")
        self._manager.has_missions = lambda: bool(self._missions.under_way)
        self._missions.take_up(told)
        for command_id in before.in_work:
            self._refuse(command_id, AWAY)
        for command_id in before.set_back:
            self._publisher.gave_up(command_id, RESTARTED)
        for event in before.unheard:
            self._hear(event)

    def step(self) -> None:
        """Take what has come in, go on with what can, publish the status."""
        for said in self._utterances.drain():
            self._hear(said)
        for event in self._events.drain():
            self._note(event)
        self._end_unleased()
        self._manager.advance()
        self._missions.advance()
        if self._battery is not None:
            self._battery.step()
        if self._keeper is not None:
            self._keeper.step()
        now_ns = self._clock.now_ns()
        if now_ns >= self._status_due_ns:
            self._status_due_ns = now_ns + _STATUS_PERIOD_NS
            memory = self._keeper.document() if self._keeper is not None else None
            document = self._manager.document(memory)
            document["commands"] += self._missions.under_way
            self._status.put_document(document)

    def stop(self) -> None:
        """Close the topics; what is planned in the executor is given up."""
        self._is_stopped = True
        self._executor.shutdown(wait=False, cancel_futures=True)
        if self._keeper is not None:
            self._keeper.close()
        self._agents.close()
        self._space.close()

    def prepare(self, profile: Profile, model_tier: int) -> Planner:
        """Build the planner that a profile asks for."""
        base = self._run_dir.parent
        return planner_for(
            self._robot, profile, self._clock, base, model_tier, run_dir=self._run_dir
        )

    def commit(self, prepared: Planner) -> Planner:
        """Plan by the new planner from the next command on."""
        before, self._manager.planner = self._manager.planner, prepared
        return before

    def discard(self, prepared: Planner) -> None:
        """Release the models of a planner, once what it plans in the executor is done.

        A server holds no connection between two calls.
        """
        if self._is_stopped:
            return  # the process ends, and its memory with it
        self._executor.submit(prepared.close)

    def _hear(self, event: Event[Utterance]) -> None:
        self._manager.metrics.heard += 1
        if self._stops_all(event):
            self._manager.stop_all(command_id_of(event))
            return
        try:
            self._check_age(event)
            waiting = self._manager.dialogue.waits_for_person
            self._agents.check(event, waiting, self._missions.are_several)
            if "pause" in event.payload:
                command = UserCommand(command_id=command_id_of(event), told_ns=event.stamp_ns)
                self._manager.pause(command, pause=bool(event.payload["pause"]))
                return
            if "mission_act" in event.payload:
                self._act_on_mission(command_id_of(event), event.payload["mission_act"])
                return
            self._take(event)
        except PlanError as error:
            self._manager.metrics.refused += 1
            self._refuse(command_id_of(event), str(error))

    def _take(self, event: Event[Utterance]) -> None:
        mission = event.payload.get("mission")
        if mission is not None:
            command = UserCommand(
                command_id=command_id_of(event),
                told_ns=event.stamp_ns,
                source=str(event.payload.get("source", "")),
            )
            self._missions.takes(command, mission)
            return
        command = read_command(event, self._own_words.read)
        if self._manager.dialogue.pending is not None or not self._missions.takes(command):
            self._manager.take(command)

    def _act_on_mission(self, command_id: str, act: object) -> None:
        mission_id = str(act.get("cancel", "")) if isinstance(act, Mapping) else ""
        error = ""
        if not self._missions.cancel(mission_id, "cancelled on request"):
            error = f'no mission "{mission_id}" that has not ended; see: vla-deploy mission list'
        self._publisher.done(command_id, error)

    def _refuse(self, command_id: str, reason: str) -> None:
        self._publisher.refused(UserCommand(command_id=command_id, told_ns=0), reason)

    def _stops_all(self, event: Event[Utterance]) -> bool:
        """Return whether all is to end; "never mind" to a question ends the question alone."""
        if event.payload.get("cancel"):
            return True
        declines = self._manager.dialogue.declines(event.payload.get("text"))
        return asks_to_stop(event) and (not declines or of_agent(event))

    def _end_unleased(self) -> None:
        """End what agents asked for, once they may ask for nothing more."""
        manager = self._manager
        for command_id in self._agents.take_ended(lambda: manager.in_work | manager.carried_out):
            is_carried_out = command_id in manager.carried_out
            manager.drop(command_id)
            if not is_carried_out:
                self._refuse(command_id, LEASE_ENDED)

    def _note(self, event: Event[TaskEvent]) -> None:
        """Note what the executor publishes of a command."""
        payload, command_id = event.payload, command_id_of(event)
        self._missions.note(event)
        if payload["event"] == "setback":
            self._manager.set_back(command_id, payload)
        elif payload["event"] == "rejected":
            self._manager.turned_away(command_id, payload.get("reason") or "")
        elif payload["event"] == "finished":
            error = payload.get("error") or ""
            self._manager.has_ended(command_id, bool(payload.get("success")), error)

    def _check_age(self, event: Event[Utterance]) -> None:
        """Refuse what the person has given up by now: the robot must not move by surprise."""
        age_s = (self._clock.now_ns() - event.stamp_ns) / NS_PER_S
        if age_s > UTTERANCE_AGE_S:
            raise NotReadyToMove(
                f"the command is {age_s:.0f} s old, the planner was away; give it again"
            )


def _wall_time_of(clock: Clock) -> Callable[[], float]:
    """Return a function of Unix seconds: on a robot the wall clock, else one by the run's time."""
    if isinstance(clock, MonotonicClock):
        return unix_s
    offset_s = unix_s() - clock.now_ns() / NS_PER_S
    return lambda: offset_s + clock.now_ns() / NS_PER_S


# --- what an earlier planner of this run left behind ---------------------------------------------

# What the planner says of a command that only it knows of.
_IN_WORK: Final = frozenset({"queued", "planning", "asked"})


@dataclass(frozen=True, slots=True, kw_only=True)
class _Unfinished:
    """Hold utterances without an answer, and ids of commands that were being planned.

    For those that are `set_back` the executor waits for another plan.
    """

    unheard: tuple[Event[Utterance], ...]
    in_work: tuple[str, ...]
    set_back: tuple[str, ...]


def _unfinished(
    utterances: Sequence[Event[Utterance]],
    events: Sequence[Event[TaskEvent]],
    plans: Sequence[Event[PlanMessage]],
) -> _Unfinished:
    """Return what the topics hold of the time before; nothing in a run that has just begun."""
    last = {command_id_of(event): str(event.payload.get("event", "")) for event in events}
    answered = last.keys() | {command_id_of(event) for event in plans}
    return _Unfinished(
        unheard=tuple(one for one in utterances if command_id_of(one) not in answered),
        in_work=tuple(name for name, event in last.items() if event in _IN_WORK),
        set_back=tuple(name for name, event in last.items() if event == "setback"),
    )
