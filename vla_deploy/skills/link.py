"""Hold the executor's end of every topic: the state it reads, the motions it asks for."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.clock import NS_PER_S, Clock
from vla_deploy.client.place_state import DOUBT_TEXT, Doubt, PlaceState
from vla_deploy.ipc import SharedSpace, topics
from vla_deploy.ipc.motion_ids import motion_ids
from vla_deploy.ipc.payloads.motion import ControlStatus, GoalMotion, TrajectoryMotion
from vla_deploy.ipc.payloads.scene import (
    BystanderDocument,
    HandDocument,
    SurfaceDocument,
    ThingDocument,
)
from vla_deploy.ipc.payloads.supervision import BatteryDocument
from vla_deploy.navigation.follower import AT_REST, Twist
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.floor_pose import Pose2D
from vla_deploy.safety import Direction
from vla_deploy.skills.errors import TryAgain
from vla_deploy.world import SceneUnreadable, Snapshot, read_snapshot

POSE_AGE_S = 0.5
# A loaded machine may hold perception up for a moment.
PATIENCE_S = 3.0
JOINT_AGE_S = 0.25
_POINT = ("x_m", "y_m")
_MOVER = ("mover_x_m", "mover_y_m", "mover_vx_m_s", "mover_vy_m_s")


@dataclass(frozen=True, slots=True, kw_only=True)
class EndedMotion:
    """Hold how a motion ended; one that a pause interrupted has still to come to its end."""

    status: str
    reason: str
    is_interrupted: bool = False


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LiveView:
    """Hold what is seen beside the map: cells' middles, (n, 2), and movers, (k, 4) x, y, vx, vy."""

    stamp_ns: int
    points: NDArray[np.float64]
    movers: NDArray[np.float64]


def _direction(twist: Twist) -> Direction:
    if twist.v_m_s:
        return Direction.FORWARD if twist.v_m_s > 0.0 else Direction.BACKWARD
    return Direction.TURN_LEFT if twist.w_rad_s > 0.0 else Direction.TURN_RIGHT


def _rows(data: np.void, count: int, names: Sequence[str]) -> NDArray[np.float64]:
    return np.column_stack([np.asarray(data[name], dtype=np.float64)[:count] for name in names])


class SkillLink:
    """Read the robot's state once per step and send it motions."""

    def __init__(self, space: SharedSpace, clock: Clock, robot: RobotDescription) -> None:
        self.robot = robot
        self.clock = clock
        self._joint_state = space.cell_reader(topics.JOINT_STATE)
        self._pose = space.cell_reader(topics.POSE)
        self._scene = space.cell_reader(topics.SCENE)
        self._scan = space.cell_reader(topics.SCAN)
        self._live = space.cell_reader(topics.LIVE_OBSTACLES)
        self._control_status = space.cell_reader(topics.CONTROL_STATUS)
        self._battery = space.cell_reader(topics.BATTERY)
        self._results_in = space.ring_reader(topics.MOTION_RESULT, from_start=False)
        self._commands = space.ring_writer(topics.MOTION_COMMAND)
        self._base = space.cell_writer(topics.BASE_COMMAND)
        self._ids = motion_ids(clock, "executor")
        self.acting = ""
        """Whose motions are sent now: one of several actions that go on side by side."""
        self._active: dict[int, str] = {}
        self._ended: dict[int, EndedMotion] = {}
        self._interrupted: set[int] = set()
        self._driver: str | None = None
        self._paused_ns = 0
        self._idle_ns = 0

    def refresh(self) -> None:
        """Take in the motions that have ended."""
        for event in self._results_in.drain():
            motion_id, status = event.payload["motion_id"], event.payload["status"]
            is_interrupted = motion_id in self._interrupted and status == "cancelled"
            self._interrupted.discard(motion_id)
            ended = EndedMotion(
                status=status, reason=event.payload["reason"], is_interrupted=is_interrupted
            )
            if motion_id in self._active:
                del self._active[motion_id]
                self._ended[motion_id] = ended

    @property
    def positions(self) -> NDArray[np.float64]:
        """Return every joint's position in the robot file's order.

        Raises:
            TryAgain: control has not told the joints' state for a while.
        """
        return self._joints("position")

    @property
    def setpoints(self) -> NDArray[np.float64]:
        """Return where control holds every joint: what a motion that follows another starts from.

        Raises:
            TryAgain: control has not told the joints' state for a while.
        """
        return self._joints("setpoint")

    @property
    def efforts(self) -> NDArray[np.float64]:
        """Return every joint's effort as a ratio of its stall torque.

        Raises:
            TryAgain: control has not told the joints' state for a while.
        """
        return self._joints("effort_ratio")

    @property
    def velocities(self) -> NDArray[np.float64]:
        """Return every joint's velocity.

        Raises:
            TryAgain: control has not told the joints' state for a while.
        """
        return self._joints("velocity")

    def _joints(self, field: str) -> NDArray[np.float64]:
        sample = self._joint_state.latest()
        if sample is None or sample.age_s(self.clock.now_ns()) > JOINT_AGE_S:
            raise TryAgain("control does not tell the joints' positions; is it running?")
        count = int(sample.data["joint_count"])
        return np.asarray(sample.data[field][:count], dtype=np.float64)

    @property
    def pose(self) -> Pose2D:
        """Return the base's pose in the map.

        Raises:
            TryAgain: perception has not told the pose for a while.
        """
        sample = self._pose.latest()
        if sample is None or sample.age_s(self.clock.now_ns()) > POSE_AGE_S:
            raise TryAgain("perception does not tell the robot's pose; is it running?")
        return Pose2D.of(sample.data)

    @property
    def battery(self) -> BatteryDocument | None:
        """Return how the battery is, None where nothing tells."""
        sample = self._battery.latest()
        if sample is None or sample.age_s(self.clock.now_ns()) > topics.BATTERY.deadline_s:
            return None
        return sample.document()

    @property
    def match_ratio(self) -> float:
        """Return how much of the newest scan the map explains at this pose; 0 before the first."""
        sample = self._pose.latest()
        return 0.0 if sample is None else float(sample.data["match_ratio"])

    @property
    def place_state(self) -> PlaceState:
        """Return what the pose is worth; lost before perception tells it."""
        sample = self._pose.latest()
        return PlaceState.LOST if sample is None else PlaceState(int(sample.data["state"]))

    @property
    def place_doubt(self) -> str:
        """Say why the pose is in doubt; "" when it is not."""
        sample = self._pose.latest()
        doubt = Doubt.STARTING if sample is None else Doubt(int(sample.data["doubt"]))
        return DOUBT_TEXT[doubt]

    @property
    def is_blind(self) -> bool:
        """Return whether perception has just fallen silent: worth a wait before giving up."""
        sample = self._pose.latest()
        return (
            sample is not None
            and POSE_AGE_S < sample.age_s(self.clock.now_ns()) < POSE_AGE_S + PATIENCE_S
        )

    @property
    def ranges_m(self) -> NDArray[np.float64] | None:
        """Return the newest lidar scan, beam i at i degrees, or None while there is none."""
        sample = self._scan.latest()
        if sample is None or sample.age_s(self.clock.now_ns()) > POSE_AGE_S:
            return None
        return np.asarray(sample.data["range_m"], dtype=np.float64)

    def live_obstacles(self) -> LiveView | None:
        """Return what perception sees beside the map; None while it tells nothing."""
        sample = self._live.latest()
        if sample is None or sample.age_s(self.clock.now_ns()) > topics.LIVE_OBSTACLES.deadline_s:
            return None
        data = sample.data
        return LiveView(
            stamp_ns=sample.stamp_ns,
            points=_rows(data, int(data["count"]), _POINT),
            movers=_rows(data, int(data["mover_count"]), _MOVER),
        )

    @property
    def bystanders(self) -> Sequence[BystanderDocument]:
        """Return the people and chairs that perception saw last."""
        sample = self._scene.latest()
        return () if sample is None else sample.document().get("bystanders", ())

    @property
    def objects(self) -> Sequence[ThingDocument]:
        """Return the scene's objects as perception published them last."""
        sample = self._scene.latest()
        return () if sample is None else sample.document().get("objects", ())

    @property
    def hands(self) -> Mapping[str, HandDocument]:
        """Return what each hand feels, as perception told it last; empty while it is silent."""
        sample = self._scene.latest()
        if sample is None or sample.age_s(self.clock.now_ns()) > PATIENCE_S:
            return {}
        return sample.document().get("hands", {})

    def snapshot(self) -> Snapshot | None:
        """Return the world as perception tells it now; None while it is silent or unreadable."""
        sample = self._scene.latest()
        if sample is None or sample.age_s(self.clock.now_ns()) > PATIENCE_S:
            return None
        try:
            return read_snapshot(sample.document(), self.clock.now_ns())
        except SceneUnreadable:  # a fault of perception, which tells of it itself
            return None

    @property
    def scene_stamp_ns(self) -> int:
        """Return when the newest image that perception judged was taken; 0 before the first."""
        sample = self._scene.latest()
        return 0 if sample is None else sample.document()["stamp_ns"]

    @property
    def surfaces(self) -> Sequence[SurfaceDocument]:
        """Return the horizontal surfaces that perception saw last."""
        sample = self._scene.latest()
        return () if sample is None else sample.document().get("surfaces", ())

    @property
    def control_status(self) -> ControlStatus | None:
        """Return control's newest status, or None when it is silent."""
        sample = self._control_status.latest()
        if sample is None or self.clock.now_ns() - sample.stamp_ns > NS_PER_S:
            return None
        return sample.document()

    def pause(self) -> None:
        """Bring to rest what this executor moves, for actions that go on from there later."""
        if self.is_paused:
            return
        self._paused_ns = self.clock.now_ns()
        for motion_id in sorted(self._active):
            self._commands.publish({"kind": "cancel", "motion_id": motion_id})
        self._interrupted |= self._active.keys()
        self.rest_base()

    def resume(self) -> None:
        """Let actions go on."""
        if self.is_paused:
            self._idle_ns += self.clock.now_ns() - self._paused_ns
            self._paused_ns = 0

    @property
    def is_paused(self) -> bool:
        """Return whether actions have been paused, and nothing is to move."""
        return self._paused_ns > 0

    def working_ns(self) -> int:
        """Return a time that stands still in pauses: what actions reckon their patience by."""
        return (self._paused_ns or self.clock.now_ns()) - self._idle_ns

    @property
    def in_protective_stop(self) -> bool:
        """Return whether control holds the robot by a protective stop, which ends itself."""
        status = self.control_status
        return status is not None and status["state"] == "protective_stop"

    def held_by_control(self, twist: Twist) -> str:
        """Say why control does not let the base make a motion now; "" when it does."""
        status = self.control_status
        if status is None or twist == AT_REST:
            return ""
        blocked = status.get("blocked", ())
        if status.get("speed_ratio", 1.0) > 0.0 and _direction(twist) not in blocked:
            return ""
        return f"control holds the base: {status['detail'] or status['cause']}"

    def drive(self, twist: Twist) -> None:
        """Ask for a base velocity; it must be repeated, control lets it go stale."""
        self._base.put(v_m_s=twist.v_m_s, w_rad_s=twist.w_rad_s)
        self._driver = self.acting if twist != AT_REST else None

    def send_goal(
        self,
        targets: Mapping[str, float],
        speed_ratio: float = 1.0,
        effort_ratio: Mapping[str, float] | None = None,
    ) -> int:
        """Ask control to bring joints to targets; return the motion's id."""
        command: GoalMotion = {
            "kind": "goal",
            "motion_id": next(self._ids),
            "targets": dict(targets),
            "speed_ratio": speed_ratio,
        }
        if effort_ratio:
            command["effort_ratio"] = dict(effort_ratio)
        return self._send(command)

    def send_trajectory(
        self,
        joints: Sequence[str],
        times_s: NDArray[np.float64],
        positions: NDArray[np.float64],
        contact_ratio: float | None = None,
    ) -> int:
        """Ask control to follow timed joint positions (n, joints); return the motion's id.

        With a `contact_ratio` of the contact limits it ends as soon as it meets something.
        """
        command: TrajectoryMotion = {
            "kind": "trajectory",
            "motion_id": next(self._ids),
            "joints": list(joints),
            "times_s": times_s.tolist(),
            "positions": positions.tolist(),
        }
        if contact_ratio is not None:
            command["contact_ratio"] = contact_ratio
        return self._send(command)

    def _send(self, command: GoalMotion | TrajectoryMotion) -> int:
        self._active[command["motion_id"]] = self.acting
        self._commands.publish(command)
        return command["motion_id"]

    def cancel(self, motion_id: int) -> None:
        """End a motion that this executor started."""
        self._commands.publish({"kind": "cancel", "motion_id": motion_id})
        self._active.pop(motion_id, None)
        self._interrupted.discard(motion_id)

    def ended(self, motion_id: int) -> EndedMotion | None:
        """Return how a motion ended, once, or None while it runs."""
        return self._ended.pop(motion_id, None)

    def halt(self) -> None:
        """Cancel every motion that this executor started and bring the base to rest."""
        for motion_id in sorted(self._active):
            self.cancel(motion_id)
        self.rest_base()

    def notify_rest(self, source: str) -> None:
        """Have control verify that all comes to rest, now that all motions are cancelled."""
        self._commands.publish({"kind": "rest", "motion_id": 0, "source": source})

    def halt_actor(self, actor: str) -> None:
        """Cancel the motions of one action, and bring the base to rest if it drives."""
        for motion_id in sorted(one for one, whose in self._active.items() if whose == actor):
            self.cancel(motion_id)
        if self._driver == actor:
            self.drive(AT_REST)

    def rest_base(self) -> None:
        """Bring the base to rest if this executor moves it."""
        if self._driver is not None:
            self.drive(AT_REST)
