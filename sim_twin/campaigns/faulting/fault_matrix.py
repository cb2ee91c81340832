"""Let everything fail in every phase of the work, and judge by physics whether that was safe."""

import argparse
import math
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np

from sim_twin.campaigns.evidence import Watch, unwatched
from sim_twin.campaigns.faulting.choreography import Phase, choreography_of
from sim_twin.campaigns.faulting.phases import NotSet, PhaseStage
from sim_twin.campaigns.faulting.separation import Separation
from sim_twin.campaigns.faulting.witness import FaultWitness
from sim_twin.campaigns.processes import played
from sim_twin.campaigns.report import CampaignCase, CampaignReport, crash_is_failure
from sim_twin.campaigns.selection import chosen
from sim_twin.errors import FaultRefused
from sim_twin.faults import Component, Fault
from sim_twin.faults.request import FaultRequest, parse_request
from sim_twin.faults.table import faults_of
from sim_twin.harness.lockstep_stack import LockstepControl, lockstep_robot
from sim_twin.harness.robot import RobotFailed
from sim_twin.physics.hazards import Hazard
from sim_twin.physics.truth import STANDSTILL_RAD_S
from vla_deploy.robots import RobotDescription, load_robot

_SENSORS: Final = (
    *(Component.LIDAR, Component.IMU, Component.CAMERA),
    *(Component.MICROPHONE, Component.SPEAKER),
    *(Component.BROKER, Component.HOME_DEVICE),
)
"""Their drivers are in perception, speech and executor: these faults need the whole stack."""
_WORST: Final[Mapping[tuple[Component, Fault], Mapping[str, float]]] = {
    (Component.LIDAR, Fault.WRONG): {"ratio": 2.0},
    (Component.CAMERA, Fault.WRONG): {"ratio": 2.0},
}
"""What is near is told as far: the other direction only stops the robot early."""
_FAULT_S: Final = 2.0
_AFTER_S: Final = 1.5
_LOOK_S: Final = 0.02
_REST_S: Final = 1.5
"""The longest stop: 0.5 m/s at 0.6 m/s² takes 0.83 s, a debounce and a lost bus come before it."""
_STILL_RAD: Final = 0.05
"""A servo that comes back may give in this far to where control holds it."""
_LEAST_GAP_M: Final = 0.005
"""Between base and furniture; where Butler grasps, tables are 0.018 m and more away."""
_STOPPED: Final = ("stopping", "stopped", "fault")
_LIMP: Final = (Fault.BROWN_OUT, Fault.OVERHEAT, Fault.OVERLOAD)
"""These take the torque off in the servo's own firmware: what hangs on it goes limp whatever the
software does, so its own joint may fall with what it holds; all else must stay safe."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Cell:
    """Name one case of the matrix."""

    component: Component
    instance: str | None
    fault: Fault
    of: Fault | None
    phase: Phase

    @property
    def name(self) -> str:
        """Return the case in words."""
        where = f"{self.component.value}.{self.instance}" if self.instance else self.component.value
        what = f"{self.fault.value}.{self.of.value}" if self.of else self.fault.value
        return f"{where}/{what}/{self.phase.value}"

    def limp_joints(self, robot: RobotDescription) -> frozenset[str]:
        """Return the joints whose servos themselves take the torque off."""
        if self.component not in (Component.SERVO, Component.SERVO_BUS):
            return frozenset()
        if self.fault not in _LIMP and self.of not in _LIMP:
            return frozenset()
        return frozenset(robot.joint_names if self.instance is None else (self.instance,))

    def request(self, robot: RobotDescription) -> FaultRequest:
        """Return the checked request: it begins at once, and ends."""
        raw: dict[str, Any] = {"component": self.component, "fault": self.fault}
        raw |= {"instance": self.instance} if self.instance else {}
        raw |= {"of": self.of, "period_s": 0.2} if self.of else {}
        raw |= _WORST.get((self.component, self.fault), {})
        return parse_request({**raw, "duration_s": _FAULT_S}, robot)


def cells(robot: RobotDescription) -> Iterator[Cell]:
    """Return every supported fault of every component in every phase."""
    moves = choreography_of(robot)
    instances: dict[Component, tuple[str | None, ...]] = {
        Component.SERVO: moves.servos,
        Component.DRIVE: robot.wheel_joints[:1],
        Component.HOME_DEVICE: tuple(robot.devices)[:1],
    }
    for component in Component:
        for fault in faults_of(component):
            for instance in instances.get(component, (None,)):
                of = faults_of(component)[0] if fault is Fault.INTERMITTENT else None
                for phase in moves.phases:
                    cell = Cell(
                        component=component, instance=instance, fault=fault, of=of, phase=phase
                    )
                    if _is_possible(cell, robot):
                        yield cell


def _is_possible(cell: Cell, robot: RobotDescription) -> bool:
    try:
        cell.request(robot)
    except FaultRefused:
        return False
    return True


@crash_is_failure
def play(
    cell: Cell, seed: int = 0, robot: str = "butler", watch: Watch = unwatched
) -> CampaignCase:
    """Play one case on a robot of its own and judge it."""
    description = load_robot(robot)
    request = cell.request(description)
    return play_disturbance(
        Disturbance(
            name=cell.name,
            phase=cell.phase,
            happens=lambda stack: stack.lockstep.faults.inject_checked(request),
            limp=cell.limp_joints(description),
            takes_all=cell.component in _SENSORS,
        ),
        seed,
        robot,
        watch,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Disturbance:
    """Hold what happens to a robot in a phase of its work; `limp` joints may fall then."""

    name: str
    phase: Phase
    happens: Callable[[LockstepControl], object]
    limp: frozenset[str] = frozenset()
    takes_all: bool = False
    """Whether it needs the whole stack."""


def play_disturbance(
    what: Disturbance, seed: int = 0, robot: str = "butler", watch: Watch = unwatched
) -> CampaignCase:
    """Let it happen to a robot of its own and judge whether that was safe."""
    with (
        tempfile.TemporaryDirectory(prefix="vla-") as folder,
        closing(lockstep_robot(Path(folder), seed, takes_all=what.takes_all, robot=robot)) as stack,
    ):
        watch(stack)
        try:
            return _Trial(what, stack).run()
        except (NotSet, RobotFailed) as error:
            why = f"the stage could not be set: {error}"
            return CampaignCase(name=what.name, failures=(why,))


class _Trial:
    """Watch one robot through one disturbance."""

    def __init__(self, what: Disturbance, stack: LockstepControl) -> None:
        self._what = what
        self._stack = stack
        self._stage = PhaseStage(stack)
        self._limp = what.limp
        engine = stack.lockstep.twin.engine
        drives = stack.robot.parts.base is not None
        self._separation = Separation(engine.model, engine.data) if drives else None
        self._stopped_s = math.nan
        self._rest_s = math.nan
        self._rest_places = np.zeros(0)
        self._moved_rad = 0.0

    def run(self) -> CampaignCase:
        """Set the stage, let it fail, and judge."""
        lockstep, what = self._stack.lockstep, self._what
        self._stage.begin(what.phase)
        lockstep.twin.hazards.begin()
        firm = [name for name in self._stack.robot.joint_names if name not in self._limp]
        seen = FaultWitness(self._stack, lockstep.now_s, (*firm, *self._stack.robot.wheel_joints))
        what.happens(self._stack)
        while seen.since_s < _FAULT_S + _AFTER_S:
            self._stage.run_for(_LOOK_S)
            seen.look()
            if self._separation is not None:
                self._separation.look()
            self._watch_stop(seen)
        return CampaignCase(
            name=what.name,
            failures=tuple(self._failures()),
            figures={
                "cause": seen.cause,
                "cause_s": _known(seen.cause_s),
                "rest_s": _known(self._rest_s),
                "gap_m": _known(self._least_gap_m),
            },
            seconds=seen.since_s,
        )

    @property
    def _least_gap_m(self) -> float:
        """Return how near the base came to furniture; one that is mounted comes near to nothing."""
        return math.inf if self._separation is None else self._separation.least_m

    def _watch_stop(self, seen: FaultWitness) -> None:
        """Note when it stops and first rests, and how far it moves after that."""
        if math.isnan(self._stopped_s):
            if seen.states & set(_STOPPED):
                self._stopped_s = seen.since_s
        elif math.isnan(self._rest_s):
            if seen.speed_rad_s() < STANDSTILL_RAD_S:
                self._rest_s, self._rest_places = seen.since_s, seen.where().copy()
        else:
            moved_rad = float(np.abs(seen.where() - self._rest_places).max(initial=0.0))
            self._moved_rad = max(self._moved_rad, moved_rad)

    def _failures(self) -> Iterator[str]:
        for hazard in self._stack.lockstep.twin.hazards.found:
            if not self._may(hazard):
                yield str(hazard)
        if self._rest_s - self._stopped_s > _REST_S:
            yield f"at rest {self._rest_s - self._stopped_s:.3f} s after the stop, limit {_REST_S}"
        if not math.isnan(self._stopped_s) and math.isnan(self._rest_s):
            yield f"never at rest after the stop at {self._stopped_s:.3f} s"
        if self._moved_rad > _STILL_RAD:
            yield f"moved on after the stop, by {self._moved_rad:.3f} rad"
        if self._least_gap_m < _LEAST_GAP_M:
            yield f"{self._least_gap_m:.4f} m to furniture, limit {_LEAST_GAP_M}"
        limp_grippers = self._limp & self._stack.robot.gripper_joints
        carries = self._what.phase is Phase.CARRYING and not limp_grippers
        if carries and not self._stage.holds_payload:
            yield f"{self._stage.moves.payload} is no longer in the hand"

    def _may(self, hazard: Hazard) -> bool:
        """Return whether a servo without torque accounts for it."""
        carries = self._what.phase is Phase.CARRYING
        falls = hazard.kind == "fall" and hazard.part == self._stage.moves.payload and carries
        swings = hazard.kind in ("joint speed", "joint range") and hazard.part in self._limp
        return bool(self._limp) and (falls or swings)


def _known(value: float) -> float | None:
    """Return None for what was never reached: JSON has neither NaN nor infinity."""
    return value if math.isfinite(value) else None


def run(options: argparse.Namespace, tell: Callable[[str], None]) -> CampaignReport:
    """Play every case whose name contains `options.only`, several at a time."""
    robot = load_robot(options.robot)
    mine = chosen(cells(robot), options.only, lambda cell: cell.name)
    cases = played(
        partial(play, seed=options.seed, robot=options.robot), mine, options.workers, tell, 20
    )
    return CampaignReport(campaign="faults", cases=cases, summary=_summary(cases))


def _summary(cases: Sequence[CampaignCase]) -> dict[str, Any]:
    """Return the longest way to rest in each phase, and how near the base came to anything."""
    longest = {}
    for phase in Phase:
        rests = _figures("rest_s", [case for case in cases if case.name.endswith(phase.value)])
        if rests:
            longest[f"longest_rest_s_{phase.value}"] = max(rests)
    nearest = min(_figures("gap_m", cases), default=None)
    return {**longest, "least_gap_m": nearest, "unsafe": sum(bool(case.failures) for case in cases)}


def _figures(name: str, cases: Sequence[CampaignCase]) -> list[float]:
    told = [case.figures.get(name) for case in cases]
    return [value for value in told if value is not None]
