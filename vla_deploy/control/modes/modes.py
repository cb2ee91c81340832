"""Carry out the changes of mode that acts and verdicts ask for."""

from vla_deploy.control.modes.operator_acts import OperatorAct
from vla_deploy.control.modes.refusal import refusal_in
from vla_deploy.control.modes.state_machine import Mode, ModeInputs, next_mode
from vla_deploy.control.modes.stopping import Stopping
from vla_deploy.control.motion.motions import MotionResult, MotionSet
from vla_deploy.control.output.arming import Arming
from vla_deploy.safety import Verdict

AT_REST_MODES = (Mode.DISARMED, Mode.STOPPED)
_INSIST_TICKS = 25


class Modes:
    """Hold the mode, and `notice`: what a person who asked for something has to be told."""

    def __init__(
        self, arming: Arming, stopping: Stopping, motions: MotionSet, *, never_moves: str = ""
    ) -> None:
        """Take what carries changes out; `never_moves` says why the robot is never armed."""
        self.mode = Mode.DISARMED
        self._never_moves = never_moves
        self.notice = ""
        self.stop_begun = False
        """Whether this tick began a stop, or one that is more severe."""
        self._arming = arming
        self._stopping = stopping
        self._motions = motions

    def step(
        self,
        act: OperatorAct | None,
        verdict: Verdict,
        tick: int,
        *,
        at_rest: bool,
        estop_latched: bool,
    ) -> list[MotionResult]:
        """Do one tick's share, and return the motions that it ends."""
        before = self.mode
        self.stop_begun = False
        if act in (OperatorAct.ARM, OperatorAct.DISARM):
            self.notice = ""
        self.mode = next_mode(
            before,
            ModeInputs(
                reaction=verdict.reaction,
                latched=verdict.latched,
                arm=act is OperatorAct.ARM and not self._never_moves,
                disarm=act is OperatorAct.DISARM,
                armed=self._arming.step() if before is Mode.ARMING else None,
                at_rest=at_rest,
            ),
        )
        ended: list[MotionResult] = []
        if self.mode is not before:
            ended = self._enter(before, verdict)
        elif act is OperatorAct.ARM and self.mode is not Mode.ARMED:
            self.notice = f"arm refused: {self.refusal(verdict, estop_latched=estop_latched)}"
        elif act is OperatorAct.DISARM and before in AT_REST_MODES:
            self._remove_power()
        return ended + self._attend_stop(verdict, tick)

    def refusal(self, verdict: Verdict, *, estop_latched: bool) -> str:
        """Return why a motion is refused now, or nothing while control is armed."""
        if self._never_moves:
            return self._never_moves
        if self.mode is Mode.ARMED:
            return ""
        return refusal_in(self.mode, verdict, estop_latched=estop_latched)

    def _enter(self, before: Mode, verdict: Verdict) -> list[MotionResult]:
        match self.mode:
            case Mode.ARMING:
                self._arming.begin()
            case Mode.DISARMING:
                return self._motions.stop("disarmed")
            case Mode.PAUSING:
                self.stop_begun = True
                return self._motions.stop(verdict.text)
            case Mode.STOPPING:
                self._stopping.forget()
            case Mode.STOPPED:
                self._stopping.end()
            case Mode.DISARMED if before is Mode.DISARMING:
                self._remove_power()
            case Mode.DISARMED:
                failed = before is Mode.ARMING
                self.notice = f"arm failed: {self._arming.failure}" if failed else ""
                self._stopping.release()
        return []

    def _attend_stop(self, verdict: Verdict, tick: int) -> list[MotionResult]:
        """Begin the stop that a verdict asks for, and see that its power is really gone."""
        ended: list[MotionResult] = []
        if self.mode in (Mode.STOPPING, Mode.STOPPED) and self._stopping.is_exceeded_by(verdict):
            self.mode = Mode.STOPPING
            self.stop_begun = True
            ended = self._stopping.begin(verdict)
        if self.mode is Mode.STOPPED and tick % _INSIST_TICKS == 0:
            self._stopping.insist()
        return ended

    def _remove_power(self) -> None:
        failure = self._stopping.remove_power()
        if failure:
            self.notice = f"disarm: {failure}"
