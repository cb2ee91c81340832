"""Run control: read, judge, plan, limit, write, tell - once per tick, in this order."""

from contextlib import closing
from typing import Any

import numpy as np

from drivers.clock import NS_PER_S
from drivers.errors import DriverError
from drivers.opener import DeviceOpener
from platforms import Profile
from vla_deploy.control.arming import Arming
from vla_deploy.control.axes import Flags
from vla_deploy.control.base_motion import BaseLimits, BaseRamp, permitted
from vla_deploy.control.dispatch import Dispatcher, axis_limits
from vla_deploy.control.estop_button import EstopButton
from vla_deploy.control.gravity import GravityOffset
from vla_deploy.control.limits import SetpointGate
from vla_deploy.control.motions import MotionSet
from vla_deploy.control.operator_desk import Act, OperatorDesk
from vla_deploy.control.payload import Payload
from vla_deploy.control.rest import Rest
from vla_deploy.control.retuning import Tuning, retuned, tuning_of
from vla_deploy.control.servos import ServoLine
from vla_deploy.control.state_machine import Mode, ModeInputs, next_mode, status_name
from vla_deploy.control.stop_plan import StopPlan
from vla_deploy.control.surroundings import SurroundingsWatch
from vla_deploy.control.telemetry import Telemetry, TickClock
from vla_deploy.control.thresholds import safety_limits
from vla_deploy.control.tick_recorder import TickRecorder
from vla_deploy.control.verdict_document import verdict_document
from vla_deploy.control.watch import Watch
from vla_deploy.control.wheels import Wheels
from vla_deploy.ipc import SharedSpace
from vla_deploy.node import NodeContext
from vla_deploy.power_off import power_off_asked
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.description import StopCategory
from vla_deploy.robots.model import RobotModel
from vla_deploy.safety import (
    CLEAR,
    Reaction,
    ResetOutcome,
    SafetyState,
    Verdict,
    evaluate,
)
from vla_deploy.safety.probes import jumped_joints

_RESET_NS = 2 * NS_PER_S
_SHUTDOWN_NS = 3 * NS_PER_S
_INSIST_TICKS = 25
_AT_REST_MODES = (Mode.DISARMED, Mode.STOPPED)
_STANDSTILL_MODES = (Mode.STOPPED, Mode.PAUSED)


class ControlNode:
    """Own the servo and CAN buses, and be the only process that moves anything.

    Joint groups of stop category 2 keep their power through stops, resets and a restart of this
    process, whatever ended it: an arm that is let go falls. `disarm` takes it away, and a `stop`
    when the robot is switched off.
    """

    def __init__(
        self,
        context: NodeContext,
        robot: RobotDescription,
        profile: Profile,
        devices: DeviceOpener,
    ) -> None:
        """Prepare everything that needs no device."""
        clock = context.clock
        self._robot, self._profile = robot, profile
        self._run_dir = context.run_dir
        self._tuning = tuning_of(profile)
        self._clock = clock
        self._servos = ServoLine(robot, profile, devices, clock)
        self._wheels = Wheels(robot, profile, devices, clock)
        self._motions = MotionSet(axis_limits(robot))
        self._gate = SetpointGate(robot.position_min, robot.position_max, robot.velocity_max)
        self._gravity = GravityOffset(robot, RobotModel(robot).gravity)
        self._base_limits = BaseLimits(
            speed_m_s=robot.base.max_speed_m_s,
            turn_rad_s=robot.base.max_turn_rad_s,
            acceleration_m_s2=robot.base.max_acceleration_m_s2,
            turn_acceleration_rad_s2=robot.base.max_turn_acceleration_rad_s2,
        )
        self._base = BaseRamp(self._base_limits)
        self._rest = Rest()
        self._arming = Arming(self._servos, self._wheels, clock)
        self._plan = StopPlan(robot)
        self._dispatcher = Dispatcher(robot, self._motions, self._servos)
        self._limits = safety_limits(robot)
        self._ticks = TickClock(self.period_s)

        space = SharedSpace(context.run_dir / "ipc", clock)
        self._button = EstopButton(robot, devices, clock)
        with closing(space.cell_reader("control_status")) as before:
            self._desk = OperatorDesk(
                space.ring_reader("operator", from_start=True), self._button.source, before.latest()
            )
        self._surroundings = SurroundingsWatch(space, robot)
        self._payload = Payload(robot, space.cell_reader("executor_status"))
        self._commands = space.ring_reader("motion_command", from_start=False)
        self._watch = Watch(space, self._servos, self._wheels, clock)
        self._telemetry = Telemetry(space, len(robot.joint_names))
        self._tick_record = TickRecorder(space)

        self._mode = Mode.DISARMED
        self._safety = SafetyState()
        self._verdict: Verdict = CLEAR
        self._stopping_for = Reaction.NONE
        self._reset_until_ns: int | None = None
        self._act: Act | None = None
        self._notice = ""
        self._judged_tick = 0

    def start(self) -> None:
        """Open buses and button; groups of stop category 2 keep the power they have.

        Raises:
            DriverError: a device is missing, busy, silent or not the one declared.
        """
        self._servos.open()
        self._release()
        try:
            self._wheels.open()
            self._button.open()
        except DriverError:
            self._servos.close()  # before `stop` could let arms fall that hold themselves
            raise
        self._place(np.ones(len(self._plan.every_joint), dtype=np.bool_))

    def step(self) -> None:
        """Do one tick."""
        now_ns = self._clock.now_ns()
        period_s = self._ticks.begin(now_ns)
        self._read()
        self._judge(now_ns)
        self._change_mode()
        self._take_commands()
        self._move_joints(period_s)
        self._move_base(period_s)
        self._tell()

    def stop(self) -> None:
        """Ramp to rest, release what may be released, and close the buses.

        All power goes only when the robot is switched off. Whatever else ends this process, such as
        a crash or the supervisor's death, leaves groups of stop category 2, and hands that hold
        something, to their Bus Watchdog and to the next control.
        """
        self._telemetry.tell_results(self._motions.stop("control is shut down"))
        deadline_ns = self._clock.now_ns() + _SHUTDOWN_NS
        while not self._at_rest() and self._clock.now_ns() < deadline_ns:
            self._servos.read()
            self._move_joints(self.period_s)
            self._ramp_base(0.0, 0.0, self.period_s)
            self._clock.sleep_until(self._clock.now_ns() + round(self.period_s * NS_PER_S))
        if power_off_asked(self._run_dir):
            self._remove_power()
        else:
            self._release()
        self._wheels.cycle(0.0, 0.0)
        self._wheels.close()
        self._servos.close()
        self._button.close()
        for topic in (
            self._telemetry,
            self._tick_record,
            self._watch,
            self._surroundings,
            self._commands,
            self._payload,
        ):
            topic.close()

    # --- another profile ----------------------------------------------------------------------

    @property
    def period_s(self) -> float:
        """Return the time between two ticks."""
        return self._tuning.period_s

    def prepare(self, profile: Profile, model_tier: int) -> Tuning:
        """Check that a profile can be taken over in motion; control has no model.

        Raises:
            ProfileError: the servo bus is too slow for its rate.
            NeedsRestart: servos or drives would have to be set up anew.
        """
        return retuned(self._robot, self._profile, profile)

    def commit(self, prepared: Tuning) -> Tuning:
        """Change the period from the next tick on; motions are laid out in time, and go on."""
        before, self._tuning = self._tuning, prepared
        self._ticks.retune(prepared.period_s)
        return before

    def discard(self, prepared: Tuning) -> None:
        """Release nothing: a tuning is two numbers."""

    # --- read and judge -----------------------------------------------------------------------

    def _read(self) -> None:
        if self._mode in _AT_REST_MODES:
            if self._servos.try_reopen():
                self._release()
            self._wheels.try_reopen()
        self._servos.read()
        self._watch.refresh()
        self._desk.listen()

    def _judge(self, now_ns: int) -> None:
        self._act = self._desk.next_act() if self._reset_until_ns is None else None
        if self._act is Act.RESET:
            self._begin_reset(now_ns)
        state = self._servos.state
        inputs = self._watch.inputs(
            energised=self._mode is not Mode.DISARMED,
            estop_source=self._desk.estop_source,
            reset_requested=self._reset_until_ns is not None,
            setpoint=self._gate.sent,
            base_at_rest=self._base.at_rest,
            standstill=self._mode in _STANDSTILL_MODES,
            surroundings=self._surroundings.refresh(
                now_ns,
                state.position_rad,
                state.velocity_rad_s,
                state.effort_ratio,
                self._gate.sent,
                self._wheels.v_m_s,
                self._wheels.w_rad_s,
                powered=self._mode is not Mode.DISARMED and bool(state.torque_on.all()),
            ),
        )
        before = self._safety
        self._safety, self._verdict = evaluate(before, inputs, self._limits)
        self._judged_tick = self._ticks.tick
        self._tick_record.judged(
            self._ticks.tick, now_ns, before, inputs, self._limits, self._verdict
        )
        self._follow_encoders(jumped_joints(inputs, self._limits))
        self._note_reset(now_ns)

    def _follow_encoders(self, jumped: Flags) -> None:
        """Hold joints whose encoders have jumped where they say they are: else the arm goes there.

        The stop begins in this very tick; nothing may move them before.
        """
        if jumped.any():
            self._place(jumped)
            self._telemetry.tell_results(self._motions.stop(self._verdict.text))

    def _begin_reset(self, now_ns: int) -> None:
        """Remove what a reset may remove, and give the devices time to say that it is gone."""
        if self._mode is Mode.STOPPING:
            self._notice = "reset refused: the stop has not ended yet"
            return
        held_by = self._servos.faulted_but_holding
        if held_by:
            joints = ", ".join(held_by)
            self._notice = (
                f"reset refused: it would reboot {joints}, which still hold torque and would fall; "
                "support the arm, disarm, then reset"
            )
            return
        self._notice = ""
        self._reset_until_ns = now_ns + _RESET_NS
        if self._servos.state.error.any():
            self._servos.reboot_faulted()
        self._wheels.reset_fault()

    def _note_reset(self, now_ns: int) -> None:
        if self._reset_until_ns is None:
            return
        if self._verdict.reset is ResetOutcome.DONE:
            self._reset_until_ns = None
        elif self._desk.estop_source is not None or now_ns >= self._reset_until_ns:
            self._reset_until_ns = None
            self._notice = "reset refused: the cause is still there"

    # --- modes --------------------------------------------------------------------------------

    def _change_mode(self) -> None:
        before, verdict = self._mode, self._verdict
        if self._act in (Act.ARM, Act.DISARM):
            self._notice = ""
        self._mode = next_mode(
            before,
            ModeInputs(
                reaction=verdict.reaction,
                latched=verdict.latched,
                arm=self._act is Act.ARM,
                disarm=self._act is Act.DISARM,
                armed=self._arming.step() if before is Mode.ARMING else None,
                at_rest=self._at_rest(),
            ),
        )
        if self._mode is not before:
            self._enter(before)
        elif self._act is Act.ARM and self._mode is not Mode.ARMED:
            self._notice = f"arm refused: {self._refusal()}"
        elif self._act is Act.DISARM and before in _AT_REST_MODES:
            self._remove_power()
        stopping = self._mode in (Mode.STOPPING, Mode.STOPPED)
        if stopping and verdict.reaction > self._stopping_for:
            self._begin_stop(verdict)
        if self._mode is Mode.STOPPED and self._ticks.tick % _INSIST_TICKS == 0:
            self._insist()

    def _enter(self, before: Mode) -> None:
        match self._mode:
            case Mode.ARMING:
                self._arming.begin()
            case Mode.DISARMING:
                self._telemetry.tell_results(self._motions.stop("disarmed"))
            case Mode.PAUSING:
                self._telemetry.tell_results(self._motions.stop(self._verdict.text))
            case Mode.STOPPING:
                self._stopping_for = Reaction.NONE
            case Mode.STOPPED:
                self._end_stop()
            case Mode.DISARMED if before is Mode.DISARMING:
                self._remove_power()
            case Mode.DISARMED:
                self._notice = (
                    f"arm failed: {self._arming.failure}" if before is Mode.ARMING else ""
                )
                self._release()

    def _begin_stop(self, verdict: Verdict) -> None:
        """Stop by the verdict's reaction: at once where power goes now, on ramps elsewhere."""
        self._mode = Mode.STOPPING
        self._stopping_for = verdict.reaction
        self._servos.remove_power(self._plan.unpowered_at_once(verdict.reaction, self._holding()))
        self._telemetry.tell_results(self._motions.stop(verdict.text))
        match self._plan.base_category(verdict.reaction):
            case StopCategory.POWER_REMOVED:
                self._wheels.cut_power()
                self._base.halt()
            case StopCategory.STOP_THEN_REMOVE_POWER:
                self._wheels.quick_stop()
                self._base.halt()

    def _end_stop(self) -> None:
        self._servos.remove_power(self._plan.unpowered_at_rest(self._stopping_for, self._holding()))

    def _insist(self) -> None:
        """Take the power again from joints that have not confirmed that they gave it up."""
        powered = self._servos.state.torque_on
        if self._stopping_for is Reaction.GROUP_STOP and powered[self._plan.released()].any():
            self._end_stop()

    def _holding(self) -> frozenset[str]:
        state = self._servos.state
        return self._payload.holding(
            state.position_rad, self._gate.sent, state.effort_ratio, state.torque_on
        )

    def _release(self) -> None:
        """Leave power only to groups whose stop category keeps it, and to hands that hold."""
        self._servos.remove_power(self._plan.released(self._holding()))
        if self._plan.base is not StopCategory.STOP_KEEP_POWER:
            self._wheels.disable()

    def _remove_power(self) -> None:
        if not self._servos.remove_power(self._plan.every_joint):
            self._notice = f"disarm: {self._servos.failure}"
        self._wheels.disable()

    def _at_rest(self) -> bool:
        return self._rest.reached(
            self._clock.now_ns(),
            setpoints_rest=self._motions.at_rest and self._base.at_rest,
            wheels_still=self._wheels.still,
        )

    # --- plan, limit, write -------------------------------------------------------------------

    def _take_commands(self) -> None:
        for event in self._commands.drain():
            refusal = "" if self._mode is Mode.ARMED else self._refusal()
            self._telemetry.tell_results(self._dispatcher.handle(event.payload, refusal))

    def _refusal(self) -> str:
        if self._safety.estop_latched:
            return "the emergency stop is latched: reset, then arm"
        if self._verdict.reaction >= Reaction.HOLD:
            latched = "reset, then arm" if self._verdict.latched else "remove the cause, then arm"
            return f"stopped by {self._verdict.text}: {latched}"
        if self._mode in (Mode.PAUSING, Mode.PAUSED):
            return f"protective stop by {self._verdict.text or 'a cause that is gone'}: wait"
        return f"control is {self._mode.value}: arm first"

    def _move_joints(self, period_s: float) -> None:
        """Advance the setpoints, bound them, add what gravity asks for, and send them."""
        state = self._servos.state
        loose = ~state.torque_on | (state.watchdog < 0)
        if loose.any():
            self._place(loose)
        self._telemetry.tell_results(self._motions.advance(period_s))
        sent = self._gate.limit(self._motions.state.position, period_s)
        if state.torque_on.any():
            self._servos.write(sent + self._gravity.at(sent))

    def _place(self, joints: Flags) -> None:
        """Let the setpoints of joints that hold nothing follow them, so that arming is bumpless."""
        measured = self._servos.state.position_rad
        self._motions.place(measured, joints)
        self._gate.place(measured, joints)

    def _move_base(self, period_s: float) -> None:
        wanted = (0.0, 0.0)
        if self._mode is Mode.ARMED and self._wheels.enabled:
            verdict = self._verdict
            wanted = permitted(
                (self._watch.v_m_s, self._watch.w_rad_s),
                self._base_limits,
                verdict.speed_ratio,
                verdict.blocked,
            )
        self._ramp_base(*wanted, period_s)

    def _ramp_base(self, v_m_s: float, w_rad_s: float, period_s: float) -> None:
        if not self._wheels.enabled:
            self._base.halt()
        self._base.advance(v_m_s, w_rad_s, period_s)
        self._wheels.cycle(self._base.v_m_s, self._base.w_rad_s)

    # --- tell ---------------------------------------------------------------------------------

    def _tell(self) -> None:
        self._tick_record.sent(self._gate.sent, self._base.v_m_s, self._base.w_rad_s)
        self._telemetry.tell_joints(self._servos.state, self._gate.sent)
        self._telemetry.tell_base(self._wheels)
        if self._ticks.tick % self._tuning.status_every == 0:
            self._telemetry.tell_status(self._status())

    def _status(self) -> dict[str, Any]:
        verdict = self._verdict
        details = (verdict.text, self._notice, self._desk.complaint)
        return {
            "state": status_name(self._mode, verdict.reaction),
            "estop_latched": self._safety.estop_latched,
            **verdict_document(verdict),
            "detail": "; ".join(detail for detail in details if detail)[:1500],
            "tick": self._ticks.tick,
            "judged_tick": self._judged_tick,
            "late_ticks": self._ticks.late_ticks,
            "period_s": round(self._ticks.period_s, 6),
            "buses": {
                self._servos.name: self._servos.counters,
                self._wheels.name: self._wheels.counters,
            },
            "active_motions": self._motions.active_ids,
        }
