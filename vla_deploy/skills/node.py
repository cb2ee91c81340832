"""Run the executor: plans in, motions out, and a word about every action."""

from collections.abc import Mapping
from typing import Any

from drivers.clock import NS_PER_S
from platforms import Profile
from vla_deploy.ipc import Announcer, CellWriter, ClaimBook, RingReader, RingWriter, SharedSpace
from vla_deploy.manipulation.kinematics import ArmKinematics
from vla_deploy.navigation.base_paths import base_planner
from vla_deploy.node import NodeContext
from vla_deploy.planning.plan import Plan
from vla_deploy.planning.readiness import refusal_of
from vla_deploy.robots import RobotDescription
from vla_deploy.skills.arms import believe_fingers, recall_hands
from vla_deploy.skills.context import SkillContext
from vla_deploy.skills.executor import ActionRecord, PlanExecution
from vla_deploy.skills.link import RobotLink
from vla_deploy.skills.resources import body_of

STATUS_PERIOD_NS = NS_PER_S // 10
_SHOWN_POINTS = 200


class ExecutorNode:
    """Execute one plan at a time; a new plan is refused while one runs, a cancel ends it."""

    def __init__(self, context: NodeContext, robot: RobotDescription, rate_hz: float) -> None:
        self.period_s = 1.0 / rate_hz
        self._clock = context.clock
        self._robot = robot
        self._space = SharedSpace(context.run_dir / "ipc", context.clock)
        self._skills: SkillContext
        self._plans: RingReader
        self._events: RingWriter
        self._status: CellWriter
        self._execution: PlanExecution | None = None
        self._command_id = ""
        self._status_ns = 0
        self._knows_hands = False

    def start(self) -> None:
        """Load the map, build the kinematics, open the topics."""
        self._skills = SkillContext(
            robot=self._robot,
            link=RobotLink(self._space, self._clock, self._robot),
            planner=base_planner(self._robot),
            arms={name: ArmKinematics(self._robot, name) for name in self._robot.hands},
            say=self._say,
            voice=Announcer(self._space, "speak", self._clock),
            claims=ClaimBook(self._space, self._clock),
        )
        self._skills.claims.declare(body_of(self._robot))
        self._plans = self._space.ring_reader("plan", from_start=False)
        self._events = self._space.ring_writer("task_event")
        self._status = self._space.cell_writer("executor_status")

    def step(self) -> None:
        """Take new plans, advance the running one, tell the status."""
        self._skills.link.refresh()
        if not self._knows_hands:
            self._knows_hands = recall_hands(self._skills)
        for event in self._plans.drain():
            self._take(event.payload)
        if self._execution is not None:
            self._execution.step()
            self._conclude()
        elif self._knows_hands:
            believe_fingers(
                self._skills
            )  # while an action is under way, its skill feels for itself
        self._tell_status()

    def stop(self) -> None:
        """Cancel what runs, so that nothing moves without its executor."""
        if self._execution is not None:
            self._execution.cancel("the executor was stopped")
            self._conclude()
        self._space.close()

    def prepare(self, profile: Profile, model_tier: int) -> float:
        """Return the period that a profile asks for; the executor has no model."""
        return 1.0 / profile.executor_rate_hz

    def commit(self, prepared: float) -> float:
        """Change the period; skills reckon with the clock."""
        before, self.period_s = self.period_s, prepared
        return before

    def discard(self, prepared: float) -> None:
        """Release nothing: a period is a number."""

    def _take(self, message: Mapping[str, Any]) -> None:
        command_id = str(message["command_id"])
        if message.get("cancel"):
            if self._execution is not None:
                self._execution.cancel("cancelled on request")
                self._conclude()
            self._skills.link.halt()
            self._tell(command_id, "finished", success=True, error=None, actions=[])
            return
        refusal = refusal_of(self._skills.link.control_status)
        if refusal is None and self._execution is not None:
            refusal = "the robot is busy with another command; wait, or: vla-deploy stop"
        if refusal is not None:
            self._tell(command_id, "rejected", reason=refusal)
            return
        self._command_id = command_id
        plan = Plan.model_validate(message["plan"])
        self._execution = PlanExecution(plan, self._skills, self._tell_action, command_id)

    def _conclude(self) -> None:
        execution = self._execution
        if execution is None or not execution.finished:
            return
        errors = [record.error for record in execution.records if record.error]
        self._tell(
            self._command_id,
            "finished",
            success=execution.succeeded,
            error=errors[0] if errors else None,
            actions=[record.document() for record in execution.records],
        )
        self._execution = None

    def _tell_action(self, record: ActionRecord) -> None:
        document = record.document()
        document["action_id"] = document.pop("id")
        self._tell(self._command_id, "action", **document)

    def _say(self, text: str) -> None:
        self._tell(self._command_id, "said", text=text)

    def _tell(self, command_id: str, event: str, **details: Any) -> None:
        self._events.publish({"command_id": command_id, "event": event} | details)

    def _tell_status(self) -> None:
        now_ns = self._clock.now_ns()
        if now_ns - self._status_ns < STATUS_PERIOD_NS:
            return
        self._status_ns = now_ns
        execution = self._execution
        active = execution.active if execution else None
        self._status.put_document(
            {
                "state": "executing" if execution else "idle",
                "command_id": self._command_id if execution else None,
                "action_id": active.action.id if active else None,
                "skill": active.action.skill if active else None,
                "way_m": self._skills.way_m[:_SHOWN_POINTS].round(3).tolist(),
                "holding": {
                    hand: held.kind if held else None for hand, held in self._skills.hands.items()
                },
            }
        )
