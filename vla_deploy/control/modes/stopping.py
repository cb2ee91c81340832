"""Stop the robot by its stop categories: say who loses power at once, at rest, and not at all."""

from vla_deploy.control.modes.stop_plan import StopPlan
from vla_deploy.control.motion.axes import Axes
from vla_deploy.control.motion.motions import MotionResult
from vla_deploy.control.output.base_drive import BaseDrive
from vla_deploy.control.output.base_output import BaseOutput
from vla_deploy.control.output.joint_output import JointOutput
from vla_deploy.control.output.payload import Payload
from vla_deploy.control.output.servos import ServoLine
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.description import StopCategory
from vla_deploy.safety import Reaction, Verdict


class Stopping:
    """Follow one stop from its beginning to standstill, and take power where it has to go.

    Joint groups of category 2, and hands that hold something, keep theirs; `switching_off` leaves
    it to those hands alone, and only `remove_power` takes it all.
    """

    def __init__(
        self,
        robot: RobotDescription,
        servos: ServoLine,
        wheels: BaseDrive,
        joints: JointOutput,
        base: BaseOutput,
        payload: Payload,
    ) -> None:
        self._plan = StopPlan(robot)
        self._servos = servos
        self._wheels = wheels
        self._joints = joints
        self._base = base
        self._payload = payload
        self._reaction = Reaction.NONE

    def forget(self) -> None:
        """Let the next verdict that stops begin a stop of its own."""
        self._reaction = Reaction.NONE

    def is_exceeded_by(self, verdict: Verdict) -> bool:
        """Return whether a verdict asks for more than the stop that is under way."""
        return verdict.reaction > self._reaction

    def category(self, verdict: Verdict) -> StopCategory:
        """Return the lowest stop category by which a part stops."""
        return self._plan.category(verdict.reaction)

    def begin(self, verdict: Verdict) -> list[MotionResult]:
        """Stop by the verdict's reaction: at once where power goes now, on ramps elsewhere.

        Return the motions that this ends.
        """
        reaction = self._reaction = verdict.reaction
        self._servos.remove_power(self._plan.unpowered_at_once(reaction, self._holding()))
        ended = self._joints.motions.stop(verdict.text)
        match self._plan.base_category(reaction):
            case StopCategory.POWER_REMOVED:
                self._wheels.cut_power()
                self._base.ramp.halt()
            case StopCategory.STOP_THEN_REMOVE_POWER:
                self._wheels.quick_stop()
                self._base.ramp.halt()
        return ended

    def end(self) -> None:
        """Take the power, at rest, from what a stop of this reaction leaves without."""
        self._servos.remove_power(self._plan.unpowered_at_rest(self._reaction, self._holding()))

    def insist(self) -> None:
        """Take the power again from joints that have not confirmed that they gave it up."""
        powered = self._servos.state.torque_on
        if self._reaction is Reaction.GROUP_STOP and powered[self._plan.released()].any():
            self.end()

    def release(self) -> None:
        """Leave power only to groups whose stop category keeps it, and to hands that hold."""
        self._servos.remove_power(self._plan.released(self._holding()))
        if self._plan.base is not StopCategory.STOP_KEEP_POWER:
            self._wheels.disable()

    def switching_off(self) -> Axes:
        """Return the joints that lose their power at the end: all but those that hold something."""
        return self._plan.switched_off(self._holding())

    def switch_off(self, joints: Axes) -> str:
        """Take the power from these joints; return why a servo did not confirm it, or nothing."""
        return "" if self._servos.remove_power(joints) else self._servos.failure

    def remove_power(self) -> str:
        """Take all power; return why a servo did not confirm it, or nothing."""
        confirmed = self._servos.remove_power(self._plan.every_joint)
        self._wheels.disable()
        return "" if confirmed else self._servos.failure

    def _holding(self) -> frozenset[str]:
        state = self._servos.state
        return self._payload.holding(
            state.position_rad, self._joints.sent, state.effort_ratio, state.torque_on
        )
