"""Stop a robot in lock-step again and again, and let the physics judge each stop."""

import itertools
import math
import random
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, cast

import numpy as np
from numpy.typing import NDArray

from sim_twin.campaigns.faulting.phases import NotSet, PhaseStage
from sim_twin.campaigns.report import CampaignCase, crash_is_failure
from sim_twin.campaigns.stopping.cells import SOURCES, HandLoad, StopCell, StopPhase, StopSource
from sim_twin.harness.lockstep_stack import LockstepControl, lockstep_robot
from sim_twin.harness.robot import RobotFailed
from sim_twin.physics.truth import STANDSTILL_RAD_S
from vla_deploy.control.modes.stop_proof import allowed_times_s
from vla_deploy.control.motion.base_motion import base_limits
from vla_deploy.ipc import topics
from vla_deploy.ipc.payloads.supervision import ProcessTable
from vla_deploy.ipc.stop_button import StopButton
from vla_deploy.robots.description import StopCategory

_LOOK_S: Final = 0.004
_STILL_FOR_S: Final = 0.3
_LONGEST_S: Final = 4.0
_PROOF_S: Final = 2.0
_RUN_UP_S: Final[Mapping[StopPhase, tuple[float, float]]] = {
    StopPhase.STANDING: (0.0, 0.2),
    StopPhase.DRIVING: (0.6, 1.2),
    StopPhase.ARM_MOVING: (0.25, 0.6),
    StopPhase.PLACING: (0.25, 0.6),
}
"""How long the motion goes on before the stop; none has ended by then."""
_SENSES_S: Final = 1.0
_POSE_S: Final = 3.0
_DRIVE_M_S: Final = 0.3
_ARM_RATIO: Final[Mapping[HandLoad, float]] = {HandLoad.EMPTY: 0.7, HandLoad.CARRYING: 0.3}
_PLACE_RATIO: Final = 0.25
"""Of the joints' top speed: how an arm lets down what it holds."""
_TABLE_AGE_S: Final = topics.PROCESS_TABLE.deadline_s
_TABLE: Final = cast("ProcessTable", {"processes": []})
"""Control reads its age alone."""
_SETTLE_S: Final = 0.5
_DEVICES_STOP_S: Final = 1.5
"""Until when watchdogs and heartbeats have stopped a robot without control, as in `kills`."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StopTrial:
    """Hold one stop: times from the request, ways until rest, and who says what of it.

    `moving_rad_s` is the speed of the fastest part at the request.

    `rest_s` is infinite where the physics saw no rest, `noticed_s` NaN where no control was left.
    """

    moving_rad_s: float
    noticed_s: float
    rest_s: float
    base_m: float
    joint_rad: float
    residual_rad_s: float
    proof: str
    failures: tuple[str, ...]


@crash_is_failure
def play(cell: StopCell, seed: int, count: int, robot: str) -> CampaignCase:
    """Stop a robot of its own `count` times in one cell."""
    trials: list[StopTrial] = []
    with (
        tempfile.TemporaryDirectory(prefix="vla-") as folder,
        closing(lockstep_robot(Path(folder), seed, takes_all=False, robot=robot)) as stack,
    ):
        began_s = stack.lockstep.now_s
        try:
            trials.extend(StopTrials(cell, stack, seed).trials(count))
        except (NotSet, RobotFailed) as error:
            return _case(cell, trials, stack.lockstep.now_s - began_s, (f"not set: {error}",))
        return _case(cell, trials, stack.lockstep.now_s - began_s)


class StopTrials:
    """Own the trials of one cell on one robot."""

    def __init__(self, cell: StopCell, stack: LockstepControl, seed: int) -> None:
        self._cell = cell
        self._stack = stack
        self._lockstep = stack.lockstep
        self._stage = PhaseStage(stack)
        self._draw = random.Random(seed * 1000 + cell.seed)
        self._ways = itertools.cycle((1.0, -1.0))
        self._speed_m_s = 0.0
        self._ids = itertools.count(1)
        self._button = StopButton(stack.space, "certificate", stack.clock)
        self._budget = stack.space.cell_writer(topics.BUDGET_STOP)
        self._table = stack.space.cell_writer(topics.PROCESS_TABLE)
        self._commands = stack.space.ring_writer(topics.MOTION_COMMAND)
        self._limit_s = _limit_s(stack, cell.source)
        parts = (*stack.robot.joint_names, *stack.robot.wheel_joints)
        model = stack.lockstep.twin.engine.model
        self._dofs = [int(model.joint(part).dofadr[0]) for part in parts]
        self._places = [int(model.joint(part).qposadr[0]) for part in stack.robot.joint_names]
        self._stop: Mapping[StopSource, Callable[[], None]] = {
            StopSource.REQUEST: self._press,
            StopSource.BUTTON: self._lockstep.twin.estop_button.press,
            StopSource.OPERATOR_STOP: self._ask_to_rest,
            StopSource.PROTECTIVE: lambda: self._demand(stop=True),
            StopSource.SERVO_BUS: lambda: self._unplug("servo_bus"),
            StopSource.CAN_BUS: lambda: self._unplug("can_bus"),
            StopSource.SUPERVISOR: lambda: None,  # its table is too old now
            StopSource.CONTROL: lambda: self._lockstep.kill(self._stack.control),
        }

    def trials(self, count: int) -> Iterator[StopTrial]:
        """Yield each stop as it has been judged.

        Raises:
            NotSet: the robot does not get into its phase.
            RobotFailed: it does not arm again.
        """
        self._stack.arm()
        self._lockstep.run_for(_SENSES_S)  # a base waits for them
        if self._cell.payload is HandLoad.CARRYING:
            self._stage.take_payload()
        else:  # off what the arms lie on when a robot is switched on
            self._go(self._stage.moves.hold, 1.0)
            self._lockstep.run_for(_POSE_S)
        for _ in range(count):
            self._stack.arm()
            self._lockstep.run_for(_SETTLE_S)
            self._stack.arm()  # joints that answer again may pause it for a moment
            yield self._trial(next(self._ways))
            self._undo()

    def _trial(self, way: float) -> StopTrial:
        run_up_s = self._draw.uniform(*_RUN_UP_S[self._cell.phase])
        if self._cell.source is StopSource.SUPERVISOR:
            self._table.put_document(_TABLE)  # for the last time
            self._lockstep.run_for(_TABLE_AGE_S - run_up_s)
        self._begin_phase(way)
        self._run(run_up_s)
        if self._stack.state() != "armed":
            raise NotSet(f"{self._stack.status()['detail']} before the stop")
        self._lockstep.twin.hazards.begin()
        number = (self._stack.status().get("last_stop") or {}).get("number", 0)
        moving_rad_s = self._fastest_rad_s()
        self._stop[self._cell.source]()
        began_ns, began_s = self._stack.clock.now_ns(), self._lockstep.now_s
        base, joints = self._base(), self._joints()
        rest_s, residual_rad_s = self._watch(began_s)
        base_m = math.dist(base, self._base())
        joint_rad = float(np.abs(self._joints() - joints).max(initial=0.0))
        proof = self._proof(number)
        noticed_s = (proof["begun_ns"] - began_ns) / 1e9 if proof else math.nan
        state = str(proof.get("state", ""))
        return StopTrial(
            moving_rad_s=moving_rad_s,
            noticed_s=noticed_s,
            rest_s=rest_s,
            base_m=base_m,
            joint_rad=joint_rad,
            residual_rad_s=residual_rad_s,
            proof=state,
            failures=(
                *self._motionless(moving_rad_s),
                *self._failures(rest_s, noticed_s, proof),
            ),
        )

    def _motionless(self, moving_rad_s: float) -> Iterator[str]:
        """Yield that the stop says nothing, since nothing moved that was to move."""
        if self._cell.phase is not StopPhase.STANDING and moving_rad_s <= STANDSTILL_RAD_S:
            yield f"nothing moved at the request: {moving_rad_s:.3f} rad/s"

    def _failures(self, rest_s: float, noticed_s: float, proof: Mapping[str, Any]) -> Iterator[str]:
        rule = SOURCES[self._cell.source]
        if rest_s > self._limit_s:
            yield f"at rest after {rest_s:.3f} s, limit {self._limit_s:.3f} s"
        if noticed_s > rule.notice_s:
            yield f"the stop began after {noticed_s:.3f} s, limit {rule.notice_s:g} s"
        yield from map(str, self._lockstep.twin.hazards.found)
        if self._cell.payload is HandLoad.CARRYING and not self._stage.holds_payload:
            yield f"{self._stage.moves.payload} is no longer in the hand"
        said = str(proof.get("state", ""))
        if said != rule.proves:
            why = proof.get("reason", "")
            yield f"control says {said or 'nothing'} {why}, expected {rule.proves or 'nothing'}"

    def _watch(self, began_s: float) -> tuple[float, float]:
        """Return when all rests for good, infinite for never, and the fastest part's speed then."""
        rest_s, residual_rad_s = math.inf, math.inf
        while (since_s := self._lockstep.now_s - began_s) < self._limit_s + _LONGEST_S:
            self._run(_LOOK_S)
            since_s += _LOOK_S
            speed_rad_s = self._fastest_rad_s()
            if speed_rad_s > STANDSTILL_RAD_S:
                rest_s, residual_rad_s = math.inf, speed_rad_s
            elif math.isinf(rest_s):
                rest_s, residual_rad_s = since_s, speed_rad_s
            elif since_s - rest_s >= _STILL_FOR_S:
                break
            else:
                residual_rad_s = max(residual_rad_s, speed_rad_s)
        return rest_s, residual_rad_s

    def _proof(self, number: int) -> Mapping[str, Any]:
        """Return what control has said of this stop at last; nothing where control is gone."""
        if self._cell.source is StopSource.CONTROL:
            return {}

        def proof() -> Mapping[str, Any]:
            told: Mapping[str, Any] = self._stack.status()["last_stop"] or {}
            return told if told.get("number", 0) > number else {}

        self._lockstep.run_until(
            lambda: proof().get("state", "in_progress") != "in_progress", _PROOF_S
        )
        return proof()

    # --- the robot's motion -------------------------------------------------------------------

    def _begin_phase(self, way: float) -> None:
        moves = self._stage.moves
        match self._cell.phase:
            case StopPhase.DRIVING:
                self._speed_m_s = way * _DRIVE_M_S
            case StopPhase.ARM_MOVING:
                carries = self._cell.payload is HandLoad.CARRYING
                far = moves.carry_reach if carries else moves.reach
                self._go(self._farther(far, moves.hold), _ARM_RATIO[self._cell.payload])
            case StopPhase.PLACING:
                self._go(self._farther(moves.carry_reach, moves.hold), _PLACE_RATIO)

    def _farther(self, *poses: Mapping[str, float]) -> Mapping[str, float]:
        """Return the pose that is the longer way off: a stop may have ended half way."""
        now = self._lockstep.truth()["joints"]
        ways = [max(abs(now[name]["position"] - to) for name, to in one.items()) for one in poses]
        return poses[int(np.argmax(ways))]

    def _go(self, targets: Mapping[str, float], speed_ratio: float) -> None:
        self._commands.publish(
            {
                "kind": "goal",
                "motion_id": next(self._ids),
                "targets": dict(targets),
                "speed_ratio": speed_ratio,
            }
        )

    def _run(self, seconds: float) -> None:
        if self._speed_m_s:
            self._stack.drive_for(seconds, self._speed_m_s)
        else:
            self._lockstep.run_for(seconds)

    def _fastest_rad_s(self) -> float:
        return float(np.abs(self._lockstep.twin.engine.data.qvel[self._dofs]).max())

    def _base(self) -> tuple[float, float]:
        robot = self._lockstep.truth()["robot"]
        return robot["x_m"], robot["y_m"]

    def _joints(self) -> NDArray[np.float64]:
        places: NDArray[np.float64] = self._lockstep.twin.engine.data.qpos[self._places]
        return places.copy()

    # --- the stops ----------------------------------------------------------------------------

    def _press(self) -> None:
        self._button.press()

    def _demand(self, *, stop: bool) -> None:
        self._budget.put_document({"stop": stop, "reason": "certificate" if stop else ""})

    def _unplug(self, component: str) -> None:
        self._lockstep.faults.inject(component, None, "unplug")

    def _ask_to_rest(self) -> None:
        """Send what the executor sends: its motions end, the base rests, control verifies."""
        moving = self._speed_m_s != 0.0
        self._speed_m_s = 0.0
        if moving:
            self._stack.drive_for(_LOOK_S, 0.0)
        newest = next(self._ids)
        for motion_id in range(max(1, newest - 1), newest):
            self._commands.publish({"kind": "cancel", "motion_id": motion_id})
        self._commands.publish({"kind": "rest", "motion_id": 0, "source": "certificate"})

    def _undo(self) -> None:
        """Take back what stops the robot."""
        self._speed_m_s = 0.0
        match self._cell.source:
            case StopSource.BUTTON:
                self._lockstep.twin.estop_button.release()
            case StopSource.PROTECTIVE:
                self._demand(stop=False)
            case StopSource.SERVO_BUS | StopSource.CAN_BUS:
                self._lockstep.faults.clear_all()
            case StopSource.SUPERVISOR:
                self._table.put_document(_TABLE)
            case StopSource.CONTROL:
                self._stack.restart_control()
        with suppress(RobotFailed):  # the next trial says so
            self._lockstep.run_for(_SETTLE_S)


def _limit_s(stack: LockstepControl, source: StopSource) -> float:
    """Return until when all must rest: as control judges itself, or by the devices' watchdogs."""
    by_category = allowed_times_s(stack.robot)
    rule = SOURCES[source]
    match source:
        case StopSource.CONTROL:
            return _DEVICES_STOP_S
        case StopSource.REQUEST | StopSource.BUTTON:
            return by_category[StopCategory.STOP_THEN_REMOVE_POWER] + rule.notice_s
        case StopSource.OPERATOR_STOP:
            return base_limits(stack.robot).slowing_s + _SETTLE_S + rule.notice_s
    return by_category[StopCategory.STOP_KEEP_POWER] + rule.notice_s


def _case(
    cell: StopCell, trials: Sequence[StopTrial], seconds: float, failures: tuple[str, ...] = ()
) -> CampaignCase:
    told = [f"{number}: {one}" for number, trial in enumerate(trials) for one in trial.failures]
    rests = [trial.rest_s for trial in trials]
    noticed = [trial.noticed_s for trial in trials if math.isfinite(trial.noticed_s)]
    failed = bool(failures or told)
    return CampaignCase(
        name=cell.name,
        failures=(*failures, *told),
        figures={
            "n": len(trials),
            "category": SOURCES[cell.source].category,
            "in_motion": sum(trial.moving_rad_s > STANDSTILL_RAD_S for trial in trials),
            **spread("begun_s", noticed),
            **spread("standstill_s", rests),
            "base_m": max((trial.base_m for trial in trials), default=None),
            "joint_rad": max((trial.joint_rad for trial in trials), default=None),
            "residual_rad_s": _finite(max((t.residual_rad_s for t in trials), default=math.inf)),
            "control": _counts([trial.proof for trial in trials]),
            "physics": "FAILED" if failed or not trials else "VERIFIED",
        },
        seconds=seconds,
    )


def spread(name: str, values: Sequence[float]) -> dict[str, float | None]:
    """Return median, 99th percentile and the largest; None of nothing, or where one is endless."""
    if not values or not all(map(math.isfinite, values)):
        return dict.fromkeys((f"{name}_p50", f"{name}_p99", f"{name}_max"))
    p50, p99 = np.percentile(values, (50, 99)).tolist()
    return {f"{name}_p50": p50, f"{name}_p99": p99, f"{name}_max": max(values)}


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _counts(words: Sequence[str]) -> str:
    """Return how often control said what: `3 verified`."""
    said = [f"{words.count(word)} {word}" for word in sorted(set(words)) if word]
    return ", ".join(said) or "-"
