"""Play a scenario in lock-step against the real control, or the whole stack, and judge it."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from sim_twin.campaigns.faulting.verdict import failures
from sim_twin.campaigns.faulting.witness import FaultWitness
from sim_twin.faults.scenario import Meanwhile, Scenario
from sim_twin.harness.lockstep_stack import LockstepStack, lockstep_robot
from vla_deploy.ipc import topics

_SAMPLE_S: Final = 0.004
_COMMAND_EVERY: Final = 5
_SETTLE_S: Final = 0.3
_RETURN_S: Final = 1.3  # a lost bus is opened again once a second
_STILL_RAD: Final = 0.02
_TRAVEL_S: Final = 20.0
_TRAVEL_M: Final = 0.8
_TURN_RAD: Final = 2.5
_DRIVE_M_S: Final = 0.3
_REACH: Final = {"left_elbow": 1.9, "left_shoulder_pitch": 0.7, "right_elbow": 1.9}
_WHEELS: Final = ("left_wheel", "right_wheel")


@dataclass(frozen=True, slots=True, kw_only=True)
class RehearsalOutcome:
    """Hold what happened: `failures` is empty when the stack did all that it must do."""

    scenario: str
    cause: str
    cause_s: float
    rest_s: float
    failures: tuple[str, ...]

    @property
    def row(self) -> str:
        """Return one line for a table."""
        verdict = "ok" if not self.failures else "FAILED: " + "; ".join(self.failures)
        cause = self.cause if math.isnan(self.cause_s) else f"{self.cause} {self.cause_s:.3f} s"
        return f"{self.scenario:28} {cause:32} at rest {self.rest_s:6.3f} s  {verdict}"


class Rehearsal:
    """Own one robot for one scenario."""

    def __init__(self, scenario: Scenario, tmp_path: Path, seed: int = 0) -> None:
        self._scenario = scenario
        self._stack = lockstep_robot(tmp_path, seed, takes_all=scenario.meanwhile.takes_all)
        self._base_command = self._stack.space.cell_writer(topics.BASE_COMMAND)
        self._start_s = 0.0

    def run(self) -> RehearsalOutcome:
        """Play the scenario to its end."""
        try:
            return self._play()
        finally:
            self._stack.close()

    def _play(self) -> RehearsalOutcome:
        scenario, lockstep = self._scenario, self._stack.lockstep
        self._stack.arm()
        lockstep.run_for(_SETTLE_S)
        self._start_s = lockstep.now_s
        joints = () if scenario.meanwhile.takes_all else self._stack.robot.joint_names
        parts = (*joints, *_WHEELS)
        seen = FaultWitness(self._stack, self._start_s + scenario.begin_s, parts)
        before, command = seen.counters(), self._begin_activity()
        for request in scenario.faults:
            lockstep.faults.inject_checked(request)
        for _ in self._samples(scenario.end_s):
            if seen.since_s >= 0.0:
                seen.look()
        wrong = [*failures(scenario.expect, seen, before), *self._return(seen)]
        wrong += self._judge_travel(command) if command else []
        return RehearsalOutcome(
            scenario=scenario.name,
            cause=seen.cause,
            cause_s=seen.cause_s,
            rest_s=seen.rest_s,
            failures=tuple(wrong),
        )

    def _begin_activity(self) -> str:
        """Set the robot in motion; return the command's id on a travel, else nothing."""
        match self._scenario.meanwhile:
            case Meanwhile.REACH:
                self._stack.go(_REACH, 0.7)
            case Meanwhile.TRAVEL:
                return self._give("move", distance_m=_TRAVEL_M)
            case Meanwhile.TURN:
                return self._give("turn", angle_rad=_TURN_RAD)
        return ""

    def _give(self, skill: str, **parameters: float) -> str:
        assert isinstance(self._stack, LockstepStack)
        step = {"id": "a1", "skill": skill, "parameters": parameters}
        return self._stack.give(plan={"goal": skill, "actions": [step]})

    def _samples(self, until_s: float) -> Iterator[None]:
        """Run on to a moment of the scenario, and stop every few milliseconds to look."""
        drives, count = self._scenario.meanwhile is Meanwhile.DRIVE, 0
        while self._stack.lockstep.now_s - self._start_s < until_s:
            if drives and count % _COMMAND_EVERY == 0:
                self._base_command.put(v_m_s=_DRIVE_M_S, w_rad_s=0.0)
            self._stack.lockstep.run_for(_SAMPLE_S)
            count += 1
            yield

    def _return(self, seen: FaultWitness) -> list[str]:
        """See what happens once the fault has gone: nothing moves without an operator's act."""
        expect, wrong = self._scenario.expect, []
        stands = expect.recovery and not expect.runs_back and not math.isnan(seen.rest_s)
        place, furthest = seen.where(), 0.0
        for _ in self._samples(self._scenario.end_s + _RETURN_S):
            seen.look_at_pose()
            furthest = max(furthest, float(np.abs(seen.where() - place).max()))
        if stands and expect.torque != "off" and furthest > _STILL_RAD:
            wrong.append(f"it moved on without an operator's act, by {furthest:.3f} rad")
        if expect.recovery and self._stack.status()["state"] == "armed":
            wrong.append("it armed again without an operator's act")
        for act in expect.recovery:
            self._stack.insist(act)
        if self._stack.status()["state"] != "armed":
            wrong.append(f"it did not recover: {self._stack.status()}")
        if expect.pose_error_m is not None and seen.worst_pose_m > expect.pose_error_m:
            wrong.append(f"pose off by {seen.worst_pose_m:.3f} m, limit {expect.pose_error_m:g} m")
        if expect.yaw_error_rad is not None and seen.worst_yaw_rad > expect.yaw_error_rad:
            wrong.append(f"heading off by {seen.worst_yaw_rad:.3f}, limit {expect.yaw_error_rad:g}")
        return wrong

    def _judge_travel(self, command: str) -> list[str]:
        stack, wanted = self._stack, self._scenario.expect.travel
        assert isinstance(stack, LockstepStack)
        stack.lockstep.run_until(lambda: stack.outcome(command) is not None, _TRAVEL_S)
        outcome = stack.outcome(command) or {"error": "no end in sight"}
        ending = "succeeds" if outcome.get("success") else "fails"
        if wanted is None or ending == wanted:
            return []
        return [f"the travel {ending} ({outcome.get('error')}), expected: {wanted}"]
