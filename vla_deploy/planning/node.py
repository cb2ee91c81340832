"""Run the planner: commands in words or plans in any dialect in, validated plans out."""

from concurrent.futures import Executor
from typing import Final

from drivers.clock import NS_PER_S
from platforms import Profile
from vla_deploy.aside import AtOnce, background
from vla_deploy.ipc import CellWriter, Event, RingReader, SharedSpace
from vla_deploy.memory import MemoryStore
from vla_deploy.memory.episode import unix_s
from vla_deploy.memory.keeper import MemoryKeeper
from vla_deploy.node import NodeContext
from vla_deploy.planning.assembly import planner_for
from vla_deploy.planning.desk import Desk
from vla_deploy.planning.errors import NotReady, PlanningError
from vla_deploy.planning.inbox import Command, asks_to_stop, command_id_of, read_command
from vla_deploy.planning.left_over import LeftOver, left_over
from vla_deploy.planning.planner import Planner
from vla_deploy.planning.prohibitions import Prohibitions
from vla_deploy.planning.situation import Situation
from vla_deploy.planning.telling import Telling
from vla_deploy.robots import RobotDescription
from vla_deploy.world.surfaces import furniture_points

UTTERANCE_AGE_S: Final = 5.0
_STATUS_PERIOD_NS: Final = NS_PER_S // 2
AWAY: Final = "the planner was started again while it had this command; give it again"


class PlannerNode:
    """Turn each utterance into a plan for the executor, a question, or a refusal with its reason.

    What takes time is done in `aside`; a step never waits for it.
    """

    period_s = 0.02

    def __init__(
        self,
        context: NodeContext,
        robot: RobotDescription,
        planner: Planner | None = None,
        aside: Executor | None = None,
        memory: MemoryStore | None = None,
        prohibitions: Prohibitions | None = None,
    ) -> None:
        self._space = SharedSpace(context.run_dir / "ipc", context.clock)
        self._clock = context.clock
        self._robot = robot
        self._base, self._run_dir = context.run_dir.parent, context.run_dir
        self._planner = planner or Planner(context.clock)
        self._aside = aside or AtOnce()
        self._memory = memory
        self._prohibitions = prohibitions
        self._run_id = context.run_dir.name
        self._keeper: MemoryKeeper | None = None
        self._status_due_ns = 0
        self._is_stopped = False
        self._desk: Desk
        self._telling: Telling
        self._status: CellWriter
        self._utterances: RingReader
        self._events: RingReader

    def start(self) -> None:
        """Open the topics; what an earlier planner left is taken up, or told to be lost."""
        self._utterances = self._space.ring_reader("utterance", from_start=True)
        self._events = self._space.ring_reader("task_event", from_start=True)
        plans = self._space.ring_reader("plan", from_start=True)
        before = left_over(self._utterances.drain(), self._events.drain(), plans.drain())
        self._telling = Telling(self._space, self._clock)
        situation = Situation(self._space, self._clock, self._robot, self._memory)
        if self._memory is not None:
            self._keeper = self._new_keeper(self._memory)
        self._desk = Desk(
            self._planner,
            situation,
            self._telling,
            self._aside,
            self._clock,
            self._robot.planning.further_plans,
            self._prohibitions,
        )
        self._status = self._space.cell_writer("planner_status")
        self._take_up(before)

    def step(self) -> None:
        """Take what has come in, go on with what can, tell the status."""
        for event in self._utterances.drain():
            self._hear(event)
        for event in self._events.drain():
            self._note(event)
        self._desk.advance()
        if self._keeper is not None:
            self._keeper.step()
        now_ns = self._clock.now_ns()
        if now_ns >= self._status_due_ns:
            self._status_due_ns = now_ns + _STATUS_PERIOD_NS
            memory = self._keeper.document() if self._keeper is not None else None
            self._status.put_document({**self._desk.document(), "memory": memory})

    def stop(self) -> None:
        """Close the topics; what is planned beside the steps is given up."""
        self._is_stopped = True
        self._aside.shutdown(wait=False, cancel_futures=True)
        if self._keeper is not None:
            self._keeper.close()
        self._space.close()

    def prepare(self, profile: Profile, model_tier: int) -> Planner:
        """Build the planner that a profile asks for."""
        return planner_for(
            self._robot, profile, self._clock, self._base, model_tier, run_dir=self._run_dir
        )

    def commit(self, prepared: Planner) -> Planner:
        """Plan by the new planner from the next command on."""
        before, self._desk.planner = self._desk.planner, prepared
        return before

    def discard(self, prepared: Planner) -> None:
        """Release the models of a planner, once what is planned beside the steps is done by them.

        A server holds no connection between two calls.
        """
        if self._is_stopped:
            return  # the process ends, and its memory with it
        self._aside.submit(prepared.close)

    def _new_keeper(self, memory: MemoryStore) -> MemoryKeeper:
        return MemoryKeeper(
            memory,
            self._space,
            self._clock,
            background(self._clock),
            run_id=self._run_id,
            places=furniture_points(self._robot.places),
            wall_s=unix_s,
        )

    def _take_up(self, before: LeftOver) -> None:
        for command_id in before.in_work:
            self._telling.refused(Command(command_id=command_id, told_ns=0), AWAY)
        for command_id in before.set_back:
            self._telling.gave_up(command_id, "the planner was started again meanwhile")
        for event in before.unheard:
            self._hear(event)

    def _hear(self, event: Event) -> None:
        self._desk.accounts.heard += 1
        command_id = command_id_of(event)
        if self._stops_all(event):
            self._desk.stop_all(command_id)
            return
        try:
            self._check_age(event)
            self._desk.take(read_command(event))
        except PlanningError as error:
            self._desk.accounts.refused += 1
            self._telling.refused(Command(command_id=command_id, told_ns=0), str(error))

    def _stops_all(self, event: Event) -> bool:
        """Tell whether all is to end; "never mind" to a question ends the question alone."""
        if event.payload.get("cancel"):
            return True
        return asks_to_stop(event) and not self._desk.dialogue.declines(event.payload.get("text"))

    def _note(self, event: Event) -> None:
        told = event.payload
        if told.get("event") == "setback":
            self._desk.set_back(command_id_of(event), told)
        if told.get("event") == "rejected":
            self._desk.turned_away(command_id_of(event), str(told.get("reason") or ""))
        if told.get("event") == "finished":
            self._desk.has_ended(
                command_id_of(event), bool(told.get("success")), str(told.get("error") or "")
            )

    def _check_age(self, event: Event) -> None:
        """Refuse what whoever gave it has given up by now: the robot must not move by surprise."""
        age_s = (self._clock.now_ns() - event.stamp_ns) / NS_PER_S
        if age_s > UTTERANCE_AGE_S:
            raise NotReady(f"the command is {age_s:.0f} s old, the planner was away; give it again")
