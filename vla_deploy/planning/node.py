"""Run the planner: commands in words or plans in any dialect in, validated plans out."""

import json
from collections.abc import Mapping
from typing import Any

from drivers.clock import NS_PER_S
from vla_deploy.ipc import CellReader, CellWriter, Event, RingReader, RingWriter, SharedSpace
from vla_deploy.node import NodeContext
from vla_deploy.planning.dialects import parse_plan
from vla_deploy.planning.errors import NotReady, PlanningError
from vla_deploy.planning.knowledge import world_of
from vla_deploy.planning.plan import Plan
from vla_deploy.planning.readiness import refusal_of
from vla_deploy.planning.rules import is_stop, plan_command
from vla_deploy.planning.validator import check_plan
from vla_deploy.robots import RobotDescription

STATUS_AGE_S = 2.0
UTTERANCE_AGE_S = 5.0
_STATUS_PERIOD_NS = NS_PER_S // 2


class PlannerNode:
    """Turn each utterance into a plan for the executor, or into a refusal with its reason."""

    period_s = 0.05

    def __init__(self, context: NodeContext, robot: RobotDescription) -> None:
        self._space = SharedSpace(context.run_dir / "ipc", context.clock)
        self._clock = context.clock
        self._robot = robot
        self._counts = {"heard": 0, "planned": 0, "refused": 0}
        self._status_due_ns = 0
        self._status: CellWriter
        self._table: CellReader
        self._utterances: RingReader
        self._plans: RingWriter
        self._events: RingWriter
        self._pose: CellReader
        self._executor: CellReader
        self._control: CellReader

    def start(self) -> None:
        """Open the topics; commands given before this moment are not replayed."""
        self._utterances = self._space.ring_reader("utterance", from_start=False)
        self._plans = self._space.ring_writer("plan")
        self._events = self._space.ring_writer("task_event")
        self._pose = self._space.cell_reader("pose")
        self._executor = self._space.cell_reader("executor_status")
        self._control = self._space.cell_reader("control_status")
        self._table = self._space.cell_reader("process_table")
        self._status = self._space.cell_writer("planner_status")

    def step(self) -> None:
        """Answer every command that has come in."""
        for event in self._utterances.drain():
            self._answer(event)
        now_ns = self._clock.now_ns()
        if now_ns >= self._status_due_ns:
            self._status_due_ns = now_ns + _STATUS_PERIOD_NS
            self._status.put_document(self._counts)

    def stop(self) -> None:
        """Close the topics."""
        self._space.close()

    def _answer(self, event: Event) -> None:
        self._counts["heard"] += 1
        utterance = event.payload
        command_id = str(utterance.get("command_id", ""))
        text = str(utterance.get("text", ""))
        if utterance.get("cancel") or is_stop(text):
            self._plans.publish({"command_id": command_id, "cancel": True})
            return
        try:
            self._check_age(event)
            plan = self._plan(utterance, text)
            self._check_ready()
        except PlanningError as error:
            refusal = {"command_id": command_id, "event": "rejected", "reason": str(error)}
            self._events.publish(refusal)
            self._counts["refused"] += 1
            return
        self._counts["planned"] += 1
        document = plan.model_dump(mode="json")
        self._events.publish({"command_id": command_id, "event": "accepted"})
        self._events.publish({"command_id": command_id, "event": "plan", "plan": document})
        self._plans.publish({"command_id": command_id, "plan": document})

    def _plan(self, utterance: Mapping[str, Any], text: str) -> Plan:
        world = world_of(self._robot, self._holding())
        if "plan" in utterance:
            given = utterance["plan"]
            plan = parse_plan(given if isinstance(given, dict | list) else json.dumps(given))
        else:
            plan = plan_command(text, world, here=self._here())
        check_plan(plan, world)
        return plan

    def _check_age(self, event: Event) -> None:
        """Refuse what whoever gave it has given up by now: the robot must not move by surprise."""
        age_s = (self._clock.now_ns() - event.stamp_ns) / NS_PER_S
        if age_s > UTTERANCE_AGE_S:
            raise NotReady(f"the command is {age_s:.0f} s old, the planner was away; give it again")

    def _check_ready(self) -> None:
        table = self._table.latest()
        if table is not None and table.document().get("refusal"):
            raise NotReady(str(table.document()["refusal"]))
        sample = self._control.latest()
        fresh = sample is not None and sample.age_s(self._clock.now_ns()) < STATUS_AGE_S
        refusal = refusal_of(sample.document() if sample is not None and fresh else None)
        if refusal:
            raise NotReady(refusal)

    def _holding(self) -> Mapping[str, str | None]:
        sample = self._executor.latest()
        if sample is None or sample.age_s(self._clock.now_ns()) > STATUS_AGE_S:
            return {}
        holding: Mapping[str, str | None] = sample.document().get("holding", {})
        return holding

    def _here(self) -> tuple[float, float, float] | None:
        sample = self._pose.latest()
        if sample is None or self._clock.now_ns() - sample.stamp_ns > NS_PER_S:
            return None
        return tuple(float(sample.data[name]) for name in ("x_m", "y_m", "yaw_rad"))  # type: ignore[return-value]
