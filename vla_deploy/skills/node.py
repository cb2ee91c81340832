"""Run the executor: plans in, motions out, and a word about every action."""

import logging
from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass, field
from functools import partial
from typing import Final, Literal

from drivers.clock import NS_PER_S
from platforms import Profile
from vla_deploy.client.action_status import FAILED, ActionStatus, end_without_actions, summary_of
from vla_deploy.client.readiness import refusal_of
from vla_deploy.devices import HomeDevices
from vla_deploy.ipc import (
    Announcer,
    CellReader,
    CellWriter,
    ClaimBook,
    RingReader,
    RingWriter,
    Sample,
    SharedSpace,
    topics,
)
from vla_deploy.ipc.payloads.services import DevicesStatus
from vla_deploy.ipc.payloads.tasks import (
    ExecutorStatus,
    GripDocument,
    PlanMessage,
    PlannerStatus,
    TaskEvent,
)
from vla_deploy.manipulation.kinematics import ArmKinematics
from vla_deploy.navigation.path_planning import base_planner
from vla_deploy.plans.catalogue import MOTIONLESS
from vla_deploy.plans.plan import Plan
from vla_deploy.robots import RobotDescription
from vla_deploy.runtime.node import NodeContext
from vla_deploy.skills.advice import Adviser
from vla_deploy.skills.context import Held, SkillContext
from vla_deploy.skills.executor import PlanExecution
from vla_deploy.skills.link import SkillLink
from vla_deploy.skills.movements.arms import believe_fingers, recall_hands
from vla_deploy.skills.records import ActionRecord
from vla_deploy.skills.recovery import Recovery
from vla_deploy.skills.resources import body_of
from vla_deploy.skills.ros_goals import RosGoals

STATUS_PERIOD_NS = NS_PER_S // 10
DEVICE_PERIOD_NS = NS_PER_S // 2
_SHOWN_POINTS = 200
PLANNER_AGE_S = 2.0
PLAN_WITHIN_S: Final = 20.0
# Another plan is waited for as long as the planner may take, and a moment besides.
_MOMENT_S: Final = 2.0
MOST_COMMANDS: Final = 8
_log = logging.getLogger(__name__)


def _told_hands(before: Sample[ExecutorStatus] | None) -> dict[str, Held]:
    """Return what an executor before this one, in the same run, said that the hands hold."""
    grips = {} if before is None else before.document().get("grips", {})
    return {hand: Held(**grip) for hand, grip in grips.items()}


@dataclass(slots=True, kw_only=True)
class _Job:
    """Hold how one command is carried out; `execution` is None while another plan is awaited."""

    command_id: str
    execution: PlanExecution | None = None
    recovery: Recovery = field(default_factory=Recovery)


class ExecutorNode:
    """Execute plans side by side as far as they need different parts of the robot.

    Where a plan fails, the planner is asked for another way to the same goal, and waited for. In a
    pause all come to rest, and go on from there.
    """

    def __init__(
        self,
        context: NodeContext,
        robot: RobotDescription,
        rate_hz: float,
        plan_within_s: float = PLAN_WITHIN_S,
        devices: HomeDevices | None = None,
    ) -> None:
        """Take the devices of the home, which are closed with the node."""
        self.period_s = 1.0 / rate_hz
        self._plan_within_s = plan_within_s
        self._clock = context.clock
        self._robot = robot
        self._devices = devices
        self._space = SharedSpace(context.run_dir / "ipc", context.clock)
        self._skills: SkillContext
        self._adviser: Adviser
        self._plans: RingReader[PlanMessage]
        self._events: RingWriter[TaskEvent]
        self._status: CellWriter[ExecutorStatus]
        self._device_status: CellWriter[DevicesStatus]
        self._planner: CellReader[PlannerStatus]
        self._jobs: dict[str, _Job] = {}
        self._acting = ""
        self._status_ns = 0
        self._device_status_ns = 0
        self._device_faults: dict[str, str] = {}
        self._knows_hands = False
        self._told_hands: dict[str, Held] = {}

    def start(self) -> None:
        """Load the map, build the kinematics, open the topics."""
        self._skills = SkillContext(
            robot=self._robot,
            link=SkillLink(self._space, self._clock, self._robot),
            planner=base_planner(self._robot),
            arms={name: ArmKinematics(self._robot, name) for name in self._robot.hands},
            say=self._say,
            voice=Announcer(self._space, "speak", self._clock),
            claims=ClaimBook(self._space, self._clock),
            devices=self._devices,
            ros=RosGoals(self._space, self._clock) if self._robot.ros.is_needed else None,
        )
        self._adviser = Adviser(self._skills)
        self._skills.claims.declare(body_of(self._robot))
        self._plans = self._space.ring_reader(topics.PLAN, from_start=False)
        self._events = self._space.ring_writer(topics.TASK_EVENT)
        with closing(self._space.cell_reader(topics.EXECUTOR_STATUS)) as before:
            self._told_hands = _told_hands(before.latest())
        self._status = self._space.cell_writer(topics.EXECUTOR_STATUS)
        self._device_status = self._space.cell_writer(topics.DEVICE_STATUS)
        self._planner = self._space.cell_reader(topics.PLANNER_STATUS)

    def step(self) -> None:
        """Take new plans, advance the running one, tell the status."""
        self._skills.link.refresh()
        if self._skills.ros is not None:
            self._skills.ros.refresh()
        self._refresh_devices()
        if not self._knows_hands:
            self._knows_hands = recall_hands(self._skills, self._told_hands)
        for event in self._plans.drain():
            self._take(event.payload)
        for job in list(self._jobs.values()):
            self._advance(job)
        if not self._jobs and self._knows_hands:
            believe_fingers(self._skills)  # an action under way feels for itself
        self._tell_status()

    def stop(self) -> None:
        """Cancel what runs, so that nothing moves without its executor."""
        for job in list(self._jobs.values()):
            self._call_off(job, "the executor was stopped")
            if job.execution is not None:
                job.execution.abandon()
                self._conclude(job)
        if self._skills.ros is not None:
            self._skills.ros.close()
        if self._devices is not None:
            self._devices.close()
        self._space.close()

    def prepare(self, profile: Profile, model_tier: int) -> tuple[float, float]:
        """Return period and time for a plan as a profile has them; the executor has no model."""
        return 1.0 / profile.executor_rate_hz, profile.planning.within_s

    def commit(self, prepared: tuple[float, float]) -> tuple[float, float]:
        """Change both; skills reckon with the clock."""
        before = self.period_s, self._plan_within_s
        self.period_s, self._plan_within_s = prepared
        return before

    def discard(self, prepared: tuple[float, float]) -> None:
        """Release nothing: these are numbers."""

    def _take(self, message: PlanMessage) -> None:
        command_id = message["command_id"]
        job = self._jobs.get(command_id)
        if "pause" in message:
            self._pause(command_id, pause=message["pause"])
        elif "cancel" in message:
            self._cancel(command_id, message.get("of"))
        elif "give_up" in message:
            if job is not None and job.recovery.is_awaited:
                self._finish(job, message["give_up"])
        else:
            self._begin(command_id, job, Plan.model_validate(message["plan"]))

    def _begin(self, command_id: str, job: _Job | None, plan: Plan) -> None:
        """Carry a plan out: that of a new command, or another one that is awaited."""
        refusal = refusal_of(self._skills.link.control_status)
        if job is not None and job.recovery.is_awaited and refusal is not None:
            self._finish(job, refusal)
            return
        if refusal is None and job is not None and job.execution is not None:
            refusal = f"the robot carries out {command_id} already"
        if refusal is None and job is None and len(self._jobs) >= MOST_COMMANDS:
            refusal = f"the robot carries out {MOST_COMMANDS} commands already; wait for one to end"
        if refusal is not None:
            self._events.publish({"command_id": command_id, "event": "rejected", "reason": refusal})
            return
        job = _Job(command_id=command_id) if job is None else job
        job.recovery = job.recovery.going_on()
        job.execution = PlanExecution(
            plan, self._skills, partial(self._tell_action, command_id), command_id
        )
        self._jobs[command_id] = job

    def _pause(self, command_id: str, *, pause: bool) -> None:
        """Come to rest with all that goes on, or go on with it, and answer."""
        link, ros = self._skills.link, self._skills.ros
        if not pause:
            link.resume()
        elif self._jobs:
            link.pause()
            if ros is not None:
                ros.pause()
        error = "" if self._jobs else "nothing is under way"
        self._events.publish(end_without_actions(command_id, error))

    def _cancel(self, command_id: str, of: str | None) -> None:
        """End one command, or all; what else this executor moves comes to rest with the last."""
        for job in [one for one in self._jobs.values() if of in (None, one.command_id)]:
            self._call_off(job, "cancelled on request")
        if of is None:
            self._skills.link.halt()
            self._skills.link.notify_rest(command_id)
            self._skills.link.resume()
        self._events.publish(end_without_actions(command_id))

    def _advance(self, job: _Job) -> None:
        if job.execution is not None:
            self._acting = job.command_id
            job.execution.step()
            self._conclude(job)
        elif refusal := refusal_of(self._skills.link.control_status):
            self._finish(job, refusal)
        elif job.recovery.is_overdue(self._clock.now_ns()):
            self._finish(job, "the planner has no other plan in time")

    def _call_off(self, job: _Job, reason: str) -> None:
        """End what runs, or what waits for another plan."""
        if job.execution is not None:
            job.execution.cancel(reason)
            self._conclude(job)
        elif job.recovery.is_awaited:
            self._finish(job, reason)

    def _conclude(self, job: _Job) -> None:
        execution = job.execution
        if execution is None or not execution.finished:
            return
        setback, job.execution = execution.setback, None
        job.recovery = job.recovery.after(execution.records)
        may_go_on = job.recovery.may_go_on(self._robot.planning.further_plans)
        if setback is None or not may_go_on or not self._planner_lives():
            self._finish(job, "", success=execution.succeeded)
            return
        wait_ns = round((self._plan_within_s + _MOMENT_S) * NS_PER_S)
        job.recovery = job.recovery.awaiting(self._clock.now_ns() + wait_ns)
        done = [one.action.id for one in execution.records if one.status is ActionStatus.SUCCEEDED]
        left = {one.action.id: one.left for one in execution.records if one.left is not None}
        self._events.publish(
            {
                "command_id": job.command_id,
                "event": "setback",
                "action_id": setback.action.id,
                "skill": setback.action.skill,
                "error": setback.error,
                "cause": str(setback.cause),
                "done": done,
                "left": left,
            }
        )

    def _finish(self, job: _Job, why_no_other: str, success: bool = False) -> None:
        """Publish how the command ended; of plans that failed, all that was done counts.

        Where the world was against it, it is told what to do before, or instead.
        """
        records = job.recovery.records
        self._jobs.pop(job.command_id, None)
        if not self._jobs:
            self._skills.link.resume()
        errors = [one.error for one in reversed(records) if one.status in FAILED]
        errors += [one.error for one in records if one.error]
        advice = "" if success else self._advice(records)
        told = ". ".join(one.rstrip(".?") for one in (*errors[:1], advice) if one)
        error = "; ".join(one for one in (told, why_no_other) if one) or None
        self._events.publish(
            {
                "command_id": job.command_id,
                "event": "finished",
                "success": success,
                "error": None if success else error,
                "summary": summary_of(one.status for one in records),
                "actions": [{"id": one.action.id, **one.outcome} for one in records],
            }
        )

    def _advice(self, records: Sequence[ActionRecord]) -> str:
        """Return what to do about the action that the last plan failed by, "" where nothing."""
        aborted = [one for one in records if one.status in FAILED]
        if not aborted or aborted[-1].cause is None:
            return ""
        return self._adviser.advice_on(aborted[-1].action)

    def _planner_lives(self) -> bool:
        sample = self._planner.latest()
        return sample is not None and sample.age_s(self._clock.now_ns()) < PLANNER_AGE_S

    def _tell_action(self, command_id: str, record: ActionRecord) -> None:
        self._events.publish(
            {
                "command_id": command_id,
                "event": "action",
                "action_id": record.action.id,
                **record.outcome,
            }
        )

    def _say(self, text: str) -> None:
        self._events.publish({"command_id": self._acting, "event": "said", "text": text})

    def _state(self) -> Literal["idle", "executing", "recovering", "paused"]:
        if self._skills.link.is_paused:
            return "paused"
        if any(job.execution is not None for job in self._jobs.values()):
            return "executing"
        return "recovering" if self._jobs else "idle"

    def _refresh_devices(self) -> None:
        """Take in what devices of the home have told, and publish it."""
        if self._devices is None:
            return
        self._devices.refresh()
        now_ns = self._clock.now_ns()
        if now_ns - self._device_status_ns >= DEVICE_PERIOD_NS:
            self._device_status_ns = now_ns
            self._device_status.put_document(self._devices.document())
            self._log_device_faults(self._devices)

    def _log_device_faults(self, devices: HomeDevices) -> None:
        for one in devices:
            name, state = one.device.name, one.state
            if state.was_asked and state.fault != self._device_faults.get(name, ""):
                _log.warning("device %s: %s", name, state.fault or "it answers again")
                self._device_faults[name] = state.fault

    def _tell_status(self) -> None:
        now_ns = self._clock.now_ns()
        if now_ns - self._status_ns < STATUS_PERIOD_NS:
            return
        self._status_ns = now_ns
        jobs = [one for one in self._jobs.values() if one.execution is not None]
        shown = min(jobs, key=_is_motionless, default=None)
        active = shown.execution.active if shown and shown.execution else None
        first = shown or next(iter(self._jobs.values()), None)
        self._status.put_document(
            {
                "state": self._state(),
                "commands": list(self._jobs),
                "command_id": first.command_id if first else None,
                "action_id": active.action.id if active else None,
                "skill": active.action.skill if active else None,
                "way_m": self._skills.way_m[:_SHOWN_POINTS].round(3).tolist(),
                "holding": {
                    hand: held.kind if held else None for hand, held in self._skills.hands.items()
                },
                "grips": {hand: _grip(held) for hand, held in self._skills.hands.items() if held},
            }
        )


def _is_motionless(job: _Job) -> bool:
    """Return whether nothing moves by the action of a job that is shown."""
    active = None if job.execution is None else job.execution.active
    return active is None or active.action.skill in MOTIONLESS


def _grip(held: Held) -> GripDocument:
    return {
        "kind": held.kind,
        "colour": held.colour,
        "width_m": held.width_m,
        "below_grip_m": held.below_grip_m,
        "tilt_rad": held.tilt_rad,
    }
