"""Sit at the other end of the planner's topics: say commands, tell the world, take its answers."""

import itertools
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

from benchmarks.planner_flat import ROBOT
from benchmarks.planner_told import executor_document, scene_document
from benchmarks.planner_world import FlatWorld
from drivers.clock import NS_PER_S, MonotonicClock
from platforms import load_profile
from vla_deploy.inference.roles import ModelShelf
from vla_deploy.ipc import CellWriter, Event, IpcError, RingWriter, SharedSpace, topics
from vla_deploy.ipc.payloads.tasks import PlanMessage
from vla_deploy.planning.assembly import open_local_models, open_planner
from vla_deploy.planning.interfaces import BackEnd
from vla_deploy.planning.node import PlannerNode
from vla_deploy.robots import RobotDescription, load_robot
from vla_deploy.runtime.executors import worker_thread
from vla_deploy.runtime.node import NodeContext

ANSWER_LIMIT_S: Final = 20.0
# No state of a user: what ships is measured.
NOWHERE: Final = Path("/nonexistent/vla-deploy")
_LOOK_NS: Final = NS_PER_S // 2000
PROFILE: Final = "desktop"
# Of a planner that names no rung: there was one only.
FIRST_RUNG: Final = "patterns"


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannerAnswer:
    """Hold what the planner made of one utterance.

    `outcome` is "plan", "ask", "refuse", "stop"; "silence" where nothing came in time, "crash"
    where the planner's step failed. `plan` is what the executor got; of a question, what a yes
    would let run. `busy_s` is the time from the utterance to the outcome, `cpu_s` this process'.
    """

    outcome: str
    plan: Mapping[str, Any] | None
    text: str
    rung: str
    said: tuple[str, ...]
    busy_s: float = 0.0
    cpu_s: float = 0.0

    @property
    def reads_back(self) -> bool:
        """Return whether a yes lets a plan run."""
        return self.outcome == "ask" and self.plan is not None


@contextmanager
def fresh_session() -> Iterator["PlannerSession"]:
    """Give a planner to whom nobody has spoken yet."""
    memory = Path("/dev/shm")
    with TemporaryDirectory(prefix="vla-", dir=memory if memory.is_dir() else None) as folder:
        session = PlannerSession(Path(folder) / "base" / "run")
        try:
            yield session
        finally:
            session.close()


@cache
def _robot() -> RobotDescription:
    return load_robot(ROBOT)


@cache
def opened(profile: str) -> tuple[tuple[BackEnd, ...], dict[str, str]]:
    """Open the shipped models that a profile names, once for all sessions: that takes longest."""
    shelf = ModelShelf.of_base(NOWHERE, MonotonicClock())
    return open_local_models(_robot(), load_profile(profile), shelf)


class PlannerSession:
    """Run one planner on a time of its own; `say` returns its answer."""

    def __init__(self, folder: Path, profile: str = PROFILE) -> None:
        self._clock = MonotonicClock()
        self._space = SharedSpace(folder / "ipc", self._clock)
        self._context = NodeContext(
            run_dir=folder, robot=ROBOT, profile=profile, devices_dir=None, clock=self._clock
        )
        self.node = self._built()
        self._numbers = itertools.count(1)
        self._under_way = ""
        # What is published may have any form, for a planner has to bear that.
        self._utterances: RingWriter[Any] = self._space.ring_writer(topics.UTTERANCE)
        self._told: RingWriter[Any] = self._space.ring_writer(topics.TASK_EVENT)
        self._events = self._space.ring_reader(topics.TASK_EVENT, from_start=False)
        self._plans = self._space.ring_reader(topics.PLAN, from_start=False)
        self._cells: dict[str, CellWriter[Any]] = {
            name: self._space.cell_writer(name)
            for name in ("control_status", "scene", "executor_status", "pose")
        }
        self.node.start()

    def close(self) -> None:
        """Stop the planner."""
        self.node.stop()
        self._space.close()

    def tell(self, world: FlatWorld) -> None:
        """Publish how the robot is, where it is, and what it knows."""
        now_ns = self._clock.now_ns()
        x_m, y_m, yaw_rad = world.pose
        self._cells["control_status"].put_document({"state": "armed", "cause": "", "detail": ""})
        self._cells["scene"].put_document(scene_document(world, now_ns))
        self._cells["executor_status"].put_document(executor_document(world))
        self._cells["pose"].put(
            x_m=x_m, y_m=y_m, yaw_rad=yaw_rad, match_ratio=0.9, covariance=[1e-4] * 9, state=0,
            doubt=0,
        )  # fmt: skip

    def show(self, topic: str, document: Mapping[str, Any]) -> None:
        """Publish a document of any form as one of the topics that the planner reads."""
        self._cells[topic].put_document(document)

    def say(self, text: str) -> tuple[str, PlannerAnswer]:
        """Give a command in words; return its id and what came of it."""
        return self.give(text=text)

    def hand_in(self, plan: object) -> tuple[str, PlannerAnswer]:
        """Give a whole plan; return its id and what came of it."""
        return self.give(plan=plan)

    def give(self, **utterance: object) -> tuple[str, PlannerAnswer]:
        """Publish an utterance of any form; return its id and what came of it."""
        command_id = f"judge-{next(self._numbers)}"
        if self._under_way:  # the robot is done with what it was told before
            self._tell_finished(self._under_way)
        self._events.drain()
        self._plans.drain()
        try:
            message = {"command_id": command_id, "source": "judge", **utterance}
            self._utterances.publish(message)
        except IpcError as error:
            return command_id, _answer("refuse", text=f"it cannot be said: {error}")
        answer = self._await(command_id)
        self._under_way = command_id if answer.outcome == "plan" else ""
        return command_id, answer

    def carried_out(self, command_id: str, plan: Mapping[str, Any], error: str) -> None:
        """Publish what the executor would: each action, and the end."""
        status = "aborted" if error else "succeeded"
        ended = [
            {"id": one["id"], "skill": one["skill"], "parameters": one["parameters"],
             "status": status, "execution_time_s": 1.0, "error": error or None, "retries": 0,
             "note": None, "data": {}}
            for one in plan["actions"]
        ]  # fmt: skip
        for one in ended:
            named = {"action_id" if key == "id" else key: value for key, value in one.items()}
            self._told.publish({"command_id": command_id, "event": "action"} | named)
        self._tell_finished(command_id, error, ended)
        self.node.step()

    def _tell_finished(
        self, command_id: str, error: str = "", ended: Sequence[Mapping[str, Any]] = ()
    ) -> None:
        self._under_way = ""
        self._told.publish({
            "command_id": command_id, "event": "finished", "success": not error,
            "error": error or None, "actions": [*ended],
        })  # fmt: skip

    def status(self) -> Mapping[str, Any]:
        """Return what the planner tells of itself."""
        sample = self._space.cell_reader(topics.PLANNER_STATUS).latest()
        return {} if sample is None else sample.document()

    def _built(self) -> PlannerNode:
        """Build the node as its process does, with models that are open already."""
        robot, profile = _robot(), load_profile(self._context.profile)
        base = self._context.run_dir.parent
        local, away = opened(self._context.profile)
        planner = open_planner(robot, profile.planning, self._clock, base, local, away)
        return PlannerNode(
            self._context, robot, planner, worker_thread("plan", self._context.clock, 0.2)
        )

    def _start_anew(self) -> None:
        self.node.stop()
        self.node = self._built()
        self.node.start()

    def _await(self, command_id: str) -> PlannerAnswer:
        began_ns, began_cpu_ns = time.perf_counter_ns(), time.process_time_ns()
        told: list[Mapping[str, Any]] = []
        while time.perf_counter_ns() - began_ns < ANSWER_LIMIT_S * NS_PER_S:
            try:
                self.node.step()
            except Exception as error:  # whatever ends the planner's process ends it here
                self._start_anew()
                return _answer("crash", text=repr(error))
            busy_ns = time.perf_counter_ns() - began_ns
            cpu_ns = time.process_time_ns() - began_cpu_ns
            told += [event.payload for event in self._events.drain()]
            answer = _outcome(self._plans.drain(), told)
            if answer is not None:
                return replace(answer, busy_s=busy_ns / NS_PER_S, cpu_s=cpu_ns / NS_PER_S)
            self._clock.sleep_until(self._clock.now_ns() + _LOOK_NS)
        return _answer("silence", text=f"nothing came of {command_id}")


def _outcome(
    plans: list[Event[PlanMessage]], told: list[Mapping[str, Any]]
) -> PlannerAnswer | None:
    said = tuple(str(one["text"]) for one in told if one["event"] == "said")
    rung = next((str(one["rung"]) for one in told if "rung" in one), FIRST_RUNG)
    for event in plans:
        if "plan" in event.payload:
            return _answer("plan", plan=event.payload["plan"], rung=rung, said=said)
        if "cancel" in event.payload:
            return _answer("stop", rung=rung, said=said)
    for one in told:
        if one["event"] == "rejected":
            return _answer("refuse", text=str(one["reason"]), said=said)
        if one["event"] == "asked":
            return _answer("ask", plan=one.get("plan"), text=str(one["question"]), said=said)
    return None


def _answer(
    outcome: str, *, plan: Mapping[str, Any] | None = None, text: str = "", rung: str = "",
    said: tuple[str, ...] = (),
) -> PlannerAnswer:  # fmt: skip
    return PlannerAnswer(outcome=outcome, plan=plan, text=text, rung=rung, said=said)
