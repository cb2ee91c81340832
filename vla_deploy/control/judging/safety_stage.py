"""Judge each tick by what is known in it, and record by what it was judged."""

import numpy as np

from drivers.clock import Clock
from vla_deploy.control.judging.input_collector import InputCollector
from vla_deploy.control.judging.surroundings import SurroundingsWatch
from vla_deploy.control.judging.thresholds import safety_limits
from vla_deploy.control.judging.tick_recorder import TickRecorder
from vla_deploy.control.motion.axes import Flags, Floats, all_of
from vla_deploy.control.motion.base_velocity import BaseVelocity
from vla_deploy.control.output.base_drive import BaseDrive
from vla_deploy.control.output.servos import ServoLine
from vla_deploy.ipc import SharedSpace
from vla_deploy.robots import RobotDescription
from vla_deploy.safety import CLEAR, SafetyState, Verdict, evaluate
from vla_deploy.safety.probes import jumped_joints


class Judging:
    """Hold the safety state, the limits and the newest verdict."""

    def __init__(
        self,
        space: SharedSpace,
        robot: RobotDescription,
        servos: ServoLine,
        wheels: BaseDrive,
        clock: Clock,
    ) -> None:
        self.limits = safety_limits(robot)
        self.state = SafetyState()
        self.verdict: Verdict = CLEAR
        self.tick = 0
        self.external_torque_nm: Floats | None = None
        self.watch = InputCollector(space, servos, wheels, clock)
        self._servos = servos
        self._wheels = wheels
        self._surroundings = SurroundingsWatch(space, robot)
        self._record = TickRecorder(space)
        self._none: Flags = np.zeros(len(robot.joint_names), dtype=np.bool_)

    def judge(
        self,
        tick: int,
        now_ns: int,
        setpoint: Floats,
        *,
        energised: bool,
        estop_source: str | None,
        reset_requested: bool,
        base_at_rest: bool,
        standstill: bool,
    ) -> Flags:
        """Take the tick's verdict, and return the joints whose encoders have jumped in it."""
        joints, wheels = self._servos.state, self._wheels
        around = self._surroundings.refresh(
            now_ns,
            joints.position_rad,
            joints.velocity_rad_s,
            joints.effort_ratio,
            setpoint,
            wheels.velocity,
            powered=energised and all_of(joints.torque_on),
        )
        self.external_torque_nm = around.external_torque_nm
        inputs = self.watch.inputs(
            energised=energised,
            stop_latched=bool(self.state.latched),
            estop_source=estop_source,
            reset_requested=reset_requested,
            setpoint=setpoint,
            base_at_rest=base_at_rest,
            standstill=standstill,
            surroundings=around,
        )
        before = self.state
        self.state, self.verdict = evaluate(before, inputs, self.limits)
        self.tick = tick
        self._record.judged(tick, now_ns, before, inputs, self.limits, self.verdict)
        # A joint that jumps is a finding, which counts: most ticks have none, of any rule.
        return jumped_joints(inputs, self.limits) if any(self.state.counts) else self._none

    def note_sent(self, setpoint: Floats, velocity: BaseVelocity) -> None:
        """Record what the tick has sent to joints and wheels."""
        self._record.sent(setpoint, velocity)

    def close(self) -> None:
        """Record a tick that did not come to its end, and unmap the topics."""
        self._record.close()
        self.watch.close()
        self._surroundings.close()
