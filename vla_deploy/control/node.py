"""Run control: read, judge, plan, limit, write, tell - once per tick, in this order."""

from collections.abc import Callable
from contextlib import closing

from drivers.clock import NS_PER_S
from drivers.errors import DriverError
from drivers.opener import DeviceOpener
from platforms import Profile
from vla_deploy.control.judging.estop_button import EstopButton
from vla_deploy.control.judging.safety_stage import Judging
from vla_deploy.control.modes.controlled_descent import LOWERING_S
from vla_deploy.control.modes.modes import AT_REST_MODES, Modes
from vla_deploy.control.modes.operator_acts import OperatorAct, OperatorInbox
from vla_deploy.control.modes.resetting import Resetting
from vla_deploy.control.modes.retuning import Tuning, require_bus_rate, retuned, tuning_of
from vla_deploy.control.modes.standstill import Standstill
from vla_deploy.control.modes.state_machine import Mode
from vla_deploy.control.modes.stop_proof import ASKED_TO_REST, StopProof
from vla_deploy.control.modes.stopping import Stopping
from vla_deploy.control.modes.switching_off import SwitchingOff
from vla_deploy.control.motion.axes import Flags, any_of
from vla_deploy.control.motion.dispatch import Dispatcher, axis_limits
from vla_deploy.control.motion.motions import MotionSet
from vla_deploy.control.output.arming import Arming
from vla_deploy.control.output.base_drive import base_drive
from vla_deploy.control.output.base_output import BaseOutput
from vla_deploy.control.output.joint_output import JointOutput
from vla_deploy.control.output.payload import Payload
from vla_deploy.control.output.servos import ServoLine
from vla_deploy.control.reporting.status import Status
from vla_deploy.control.reporting.telemetry import Telemetry, TickClock
from vla_deploy.ipc import SharedSpace, topics
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.description import StopCategory
from vla_deploy.runtime.node import NodeContext
from vla_deploy.runtime.power_off import power_off_asked
from vla_deploy.safety import Cause

_RAMP_DOWN_S = 3.0
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
        """Prepare everything that needs no device.

        Raises:
            ProfileError: the servo bus is too slow for the rate.
        """
        require_bus_rate(robot, profile)
        clock = self._clock = context.clock
        self._robot, self._profile, self._run_dir = robot, profile, context.run_dir
        self._tuning = tuning_of(profile)
        self._ticks = TickClock(self.period_s)
        self._act: OperatorAct | None = None

        space = SharedSpace(context.run_dir / "ipc", clock)
        self._payload = Payload(robot, space.cell_reader(topics.EXECUTOR_STATUS))
        servos = self._servos = ServoLine(robot, profile, devices, clock)
        wheels = self._wheels = base_drive(robot, profile, devices, servos, clock)
        self._motions = MotionSet(axis_limits(robot))
        self._joints = JointOutput(robot, self._motions, servos, self._payload)
        self._base = BaseOutput(robot, wheels)
        self._dispatcher = Dispatcher(robot, self._motions, servos)
        self._rest = Standstill()
        self._resetting = Resetting(servos, wheels)

        self._button = EstopButton(robot, devices, clock)
        with closing(space.cell_reader(topics.CONTROL_STATUS)) as before:
            self._inbox = OperatorInbox(
                space.ring_reader(topics.OPERATOR, from_start=True),
                self._button.source,
                before.latest(),
            )
        self._judging = Judging(space, robot, servos, wheels, clock)
        self._stopping = Stopping(robot, servos, wheels, self._joints, self._base, self._payload)
        self._modes = Modes(
            Arming(servos, wheels, clock),
            self._stopping,
            self._motions,
            never_moves=robot.never_moves,
        )
        self._proof = StopProof(robot, self._judging.limits, servos, wheels)
        self._commands = space.ring_reader(topics.MOTION_COMMAND, from_start=False)
        self._telemetry = Telemetry(space, len(robot.joint_names))
        self._status = Status(
            *(self._ticks, self._modes, self._judging, self._inbox, self._motions),
            *(self._proof, servos, wheels),
            never_moves=robot.never_moves,
        )

    def start(self) -> None:
        """Open buses and button; groups of stop category 2 keep the power they have.

        Raises:
            DriverError: a device is missing, busy, silent or not the one declared.
        """
        self._servos.open()
        self._stopping.release()
        try:
            self._wheels.open()
            self._button.open()
        except DriverError:
            self._servos.close()  # before `stop` could let arms fall that hold themselves
            raise
        self._joints.place_all()

    def step(self) -> None:
        """Do one tick."""
        now_ns = self._clock.now_ns()
        period_s = self._ticks.begin(now_ns)
        self._read()
        self._judge(now_ns)
        self._change_mode()
        self._take_commands()
        self._prove_stop(now_ns)
        self._feel()
        self._ease_off(period_s)
        self._telemetry.tell_results(self._joints.move(period_s))
        self._move_base(period_s)
        self._tell(now_ns)

    def stop(self) -> None:
        """Ramp to rest, release what may be released, and close the buses.

        Power goes only when the robot is switched off, but for hands that hold something. Whatever
        else ends this process, such as a crash or the supervisor's death, leaves groups of stop
        category 2 too to their Bus Watchdog and to the next control.
        """
        self._telemetry.tell_results(self._motions.stop("control is shut down"))
        self._wind_down(self._at_rest, _RAMP_DOWN_S)
        if power_off_asked(self._run_dir):
            self._switch_off()
        else:
            self._stopping.release()
        self._wheels.cycle(0.0, 0.0)
        for device in (self._wheels, self._servos, self._button):
            device.close()
        for topic in (self._telemetry, self._judging, self._commands, self._payload):
            topic.close()

    def _switch_off(self) -> None:
        self._wheels.disable()
        asked_before = self._inbox.estop_source is not None
        off = SwitchingOff(self._robot, self._servos, self._stopping, self._joints)
        self._wind_down(
            lambda: off.step(self.period_s, None if asked_before else self._inbox.estop_source),
            LOWERING_S,
        )
        off.end()

    def _wind_down(self, done: Callable[[], bool], limit_s: float) -> None:
        """Go on sending setpoints until this is done, or its time is over; nothing is judged."""
        deadline_ns = self._clock.now_ns() + round(limit_s * NS_PER_S)
        while not done() and self._clock.now_ns() < deadline_ns:
            self._servos.read()
            self._inbox.listen()
            self._telemetry.tell_results(self._joints.move(self.period_s))
            self._telemetry.tell_joints(self._servos.state, self._joints.sent)
            self._base.brake(self.period_s)
            self._clock.sleep_until(self._clock.now_ns() + round(self.period_s * NS_PER_S))

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

    def _read(self) -> None:
        if self._modes.mode in AT_REST_MODES:
            if self._servos.try_reopen():
                # Setpoints came to rest further on than servos did that heard of them no more.
                self._joints.place_all()
                self._stopping.release()
            self._wheels.try_reopen()
        self._servos.read()
        self._judging.watch.refresh()
        self._inbox.listen()

    def _judge(self, now_ns: int) -> None:
        self._act = None if self._resetting.under_way else self._inbox.next_act()
        if self._act is OperatorAct.RESET:
            self._modes.notice = self._resetting.begin(
                now_ns,
                stopping=self._modes.mode is Mode.STOPPING,
                met=self._has_met,
            )
        self._modes.notice = self._resetting.step() or self._modes.notice
        jumped = self._judging.judge(
            self._ticks.tick,
            now_ns,
            self._joints.sent,
            energised=self._modes.mode is not Mode.DISARMED,
            estop_source=self._inbox.estop_source,
            reset_requested=self._resetting.asks,
            base_at_rest=self._base.ramp.at_rest,
            standstill=self._modes.mode in _STANDSTILL_MODES,
        )
        self._follow_encoders(jumped)
        given_up = self._resetting.note(
            now_ns, self._judging.verdict.reset, estop_asked=self._inbox.estop_source is not None
        )
        self._modes.notice = given_up or self._modes.notice

    def _change_mode(self) -> None:
        ended = self._modes.step(
            self._act,
            self._judging.verdict,
            self._ticks.tick,
            at_rest=self._at_rest(),
            estop_latched=self._judging.state.estop_latched,
        )
        self._telemetry.tell_results(ended)

    def _at_rest(self) -> bool:
        return self._rest.reached(
            self._clock.now_ns(),
            setpoints_rest=self._motions.at_rest and self._base.ramp.at_rest,
            wheels_still=self._wheels.still,
        )

    def _follow_encoders(self, jumped: Flags) -> None:
        """Hold joints whose encoders have jumped where they say they are: else the arm goes there.

        The stop begins in this very tick; nothing may move them before.
        """
        if any_of(jumped):
            self._joints.place(jumped)
            self._telemetry.tell_results(self._motions.stop(self._judging.verdict.text))

    def _feel(self) -> None:
        torque_nm = self._judging.external_torque_nm
        if torque_nm is not None:
            self._telemetry.tell_results(self._motions.feel(torque_nm))

    def _ease_off(self, period_s: float) -> None:
        """Stop an arm that has met a contact from pressing on."""
        torque_nm = self._judging.external_torque_nm
        if self._has_met and torque_nm is not None and self._modes.mode is Mode.STOPPED:
            self._joints.ease_off(torque_nm, period_s)

    @property
    def _has_met(self) -> bool:
        """Return whether it stands because it has met something, whatever else stops it too."""
        verdicts = (self._judging.verdict, *self._judging.state.latched)
        return any(verdict.cause is Cause.COLLISION for verdict in verdicts)

    def _take_commands(self) -> None:
        verdict, latched = self._judging.verdict, self._judging.state.estop_latched
        for event in self._commands.drain():
            refusal = self._modes.refusal(verdict, estop_latched=latched)
            self._telemetry.tell_results(self._dispatcher.handle(event.payload, refusal))

    def _move_base(self, period_s: float) -> None:
        if self._modes.mode is Mode.ARMED:
            wanted = self._judging.watch.wanted
            self._base.follow(wanted, self._judging.verdict, period_s)
        else:
            self._base.brake(period_s)

    def _prove_stop(self, now_ns: int) -> None:
        """Follow a stop to standstill: that of a verdict, or of an operator who asks for rest."""
        verdict, asked_by = self._judging.verdict, self._dispatcher.take_rest()
        if self._modes.stop_begun:
            category = self._stopping.category(verdict)
            self._proof.begin(now_ns, verdict.cause.value, verdict.subject, category)
        elif asked_by is not None and self._modes.mode is Mode.ARMED:
            self._proof.begin(now_ns, ASKED_TO_REST, asked_by, StopCategory.STOP_KEEP_POWER)
        if not self._proof.under_way:
            return
        if self._modes.mode is Mode.ARMED and self._motions.active_ids:
            self._proof.fail("a new motion began before standstill was proved")
        else:
            self._proof.step(now_ns)

    def _tell(self, now_ns: int) -> None:
        self._judging.note_sent(self._joints.sent, self._base.ramp.velocity)
        self._telemetry.tell_joints(self._servos.state, self._joints.sent)
        self._telemetry.tell_base(self._wheels)
        document = self._status.due(self._tuning.status_every, now_ns)
        if document is not None:
            self._telemetry.tell_status(document)
