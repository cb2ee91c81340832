"""Make a planner's request of what the robot publishes of itself."""

import logging
from collections.abc import Mapping
from dataclasses import replace
from typing import Final

from drivers.clock import NS_PER_S, Clock
from vla_deploy.client.readiness import refusal_of
from vla_deploy.ipc import BadPayload, CellReader, FrameReader, Sample, SharedSpace, topics
from vla_deploy.ipc.payloads.supervision import BatteryDocument
from vla_deploy.ipc.rgbd_image import colours
from vla_deploy.ipc.topics import P
from vla_deploy.memory import NO_EXPERIENCE, Experience, MemoryStore, experience_of
from vla_deploy.memory.episode import unix_s
from vla_deploy.missions.criteria import Facts
from vla_deploy.model_servers.calls.picture import Image
from vla_deploy.navigation.path_planning import base_planner
from vla_deploy.planning.dialogue.command import UserCommand
from vla_deploy.planning.dialogue.task_log import TaskLog
from vla_deploy.planning.errors import BatteryLow, NotReadyToMove
from vla_deploy.planning.interfaces import Aid, PlanRequest
from vla_deploy.planning.understanding import Conversation
from vla_deploy.plans.battery_rules import refusal_at_low
from vla_deploy.plans.knowledge import world_of
from vla_deploy.plans.plan import Plan
from vla_deploy.robots import RobotDescription
from vla_deploy.world import SceneUnreadable, Snapshot, Viewpoint, read_snapshot
from vla_deploy.world.touch import is_denied

STATUS_AGE_S: Final = 2.0
_POSE_AGE_S: Final = 1.0
_SCENE_AGE_S: Final = 10.0
_IMAGE_AGE_S: Final = 2.0

_log = logging.getLogger(__name__)

Pose = tuple[float, float, float]


class Situation:
    """Hold the cells that say how the robot is, where it stands, and what it knows around it."""

    def __init__(
        self,
        space: SharedSpace,
        clock: Clock,
        robot: RobotDescription,
        memory: MemoryStore | None = None,
    ) -> None:
        self._clock = clock
        self._robot = robot
        self._memory = memory
        self._is_free = base_planner(robot).is_free
        self._pose = space.cell_reader(topics.POSE)
        self._scene = space.cell_reader(topics.SCENE)
        self._executor = space.cell_reader(topics.EXECUTOR_STATUS)
        self._control = space.cell_reader(topics.CONTROL_STATUS)
        self._table = space.cell_reader(topics.PROCESS_TABLE)
        self._battery = space.cell_reader(topics.BATTERY)
        self._devices = space.cell_reader(topics.DEVICE_STATUS)
        self._frames: FrameReader = space.frame_reader(topics.RGBD)
        self._log = TaskLog(space)
        self._called_up: tuple[tuple[str, str, bool], Experience] = ("", "", False), NO_EXPERIENCE

    def request(
        self,
        command: UserCommand,
        conversation: Conversation,
        *,
        of_use: frozenset[Aid] = frozenset(),
    ) -> PlanRequest:
        """Return the request for a command with what is known now, and what aids are of use."""
        here = self._here()
        scene = self._snapshot(here)
        self._log.step()
        return PlanRequest(
            command_id=command.command_id,
            text=command.text,
            world=world_of(self._robot, self._holding(scene), self._is_free, self._devices_on()),
            scene=scene,
            here=here,
            conversation=conversation,
            battery=self.battery(),
            heard_confidence=command.heard_confidence,
            image=self._image() if Aid.IMAGE in of_use else None,
            experience=self._experience_of(command, with_episodes=Aid.MEMORY in of_use),
            task=self._task(),
            last_actions=self._log.last_actions,
        )

    def facts(self) -> Facts:
        """Return what is known now, for criteria to be judged by."""
        here = self._here()
        scene = self._snapshot(here)
        world = world_of(self._robot, self._holding(scene), self._is_free)
        return Facts(world=world, scene=scene, here=here)

    @property
    def is_executing(self) -> bool:
        """Return whether the executor says that it carries out a plan, from any source."""
        return bool(self.executing)

    @property
    def executing(self) -> frozenset[str] | None:
        """Return the commands that the executor says it carries out, None while it is silent."""
        sample = self._fresh(self._executor, STATUS_AGE_S)
        return None if sample is None else frozenset(sample.document()["commands"])

    @property
    def is_paused(self) -> bool:
        """Return whether the executor says that it has paused."""
        sample = self._fresh(self._executor, STATUS_AGE_S)
        return sample is not None and sample.document()["state"] == "paused"

    def _experience_of(self, command: UserCommand, *, with_episodes: bool) -> Experience:
        """Call up once for each command what bears on it: it is asked for at every step of it."""
        key = (command.command_id, command.text, with_episodes)
        if key != self._called_up[0]:
            found = experience_of(self._memory, command.text, unix_s(), with_episodes=with_episodes)
            self._called_up = key, found
        return self._called_up[1]

    def _task(self) -> str:
        """Return what is carried out, in the words of who asked for it, and the skill of now."""
        sample = self._fresh(self._executor, STATUS_AGE_S)
        status = None if sample is None else sample.document()
        if status is None or status.get("state", "idle") == "idle":
            return ""
        words = self._log.words_of(status.get("command_id") or "")
        skill = status.get("skill")
        return f"{words or 'a plan'}: {skill}" if skill else words or "a plan"

    def why_not_ready(self) -> str:
        """Return why the robot may not move now, "" where it may."""
        try:
            self.check_ready()
        except NotReadyToMove as error:
            return str(error)
        return ""

    def check_ready(self) -> None:
        """Accept that the robot moves now.

        Raises:
            NotReady: it may not; says why, and what to do about it.
        """
        table = self._table.latest()
        if table is not None and table.document().get("refusal"):
            raise NotReadyToMove(table.document()["refusal"])
        control = self._fresh(self._control, STATUS_AGE_S)
        refusal = refusal_of(control.document() if control is not None else None)
        if refusal:
            raise NotReadyToMove(refusal)

    def battery(self) -> BatteryDocument | None:
        """Return how the battery is, None where nothing tells."""
        sample = self._fresh(self._battery, topics.BATTERY.deadline_s)
        return None if sample is None else sample.document()

    def check_battery(self, plan: Plan) -> None:
        """Accept a plan that the battery is full enough for.

        Raises:
            BatteryLow: it is low, and the plan does more than going to charge.
        """
        refusal = refusal_at_low(plan, self.battery(), self._robot.battery)
        if refusal:
            raise BatteryLow(refusal)

    def _holding(self, scene: Snapshot | None) -> Mapping[str, str | None]:
        """Return what the executor says that each hand holds, less what the fingers deny."""
        sample = self._fresh(self._executor, STATUS_AGE_S)
        if sample is None:
            return {}
        hands = scene.hands if scene is not None else {}
        return {
            name: None if is_denied(hands.get(name), kind) else kind
            for name, kind in sample.document().get("holding", {}).items()
        }

    def _devices_on(self) -> Mapping[str, bool]:
        """Return whether the devices of the home are on that answer."""
        sample = self._fresh(self._devices, topics.DEVICE_STATUS.deadline_s)
        rows = () if sample is None else sample.document()["devices"]
        return {one["name"]: one["is_on"] for one in rows if one["is_on"] is not None}

    def _here(self) -> Pose | None:
        sample = self._fresh(self._pose, _POSE_AGE_S)
        if sample is None:
            return None
        x_m, y_m, yaw_rad = (float(sample.data[name]) for name in ("x_m", "y_m", "yaw_rad"))
        return x_m, y_m, yaw_rad

    def _snapshot(self, here: Pose | None) -> Snapshot | None:
        sample = self._fresh(self._scene, _SCENE_AGE_S)
        if sample is None:
            return None
        try:
            known = read_snapshot(sample.document(), self._clock.now_ns())
        except SceneUnreadable as error:  # a fault of perception: plan as if it were away
            _log.warning("%s", error)
            return None
        if here is None:
            return known
        return replace(known, robot=Viewpoint(x_m=here[0], y_m=here[1], yaw_rad=here[2]))

    def _image(self) -> Image | None:
        frame = self._frames.latest()
        if frame is None or self._clock.now_ns() - frame.stamp_ns > _IMAGE_AGE_S * NS_PER_S:
            return None
        try:
            return colours(frame)
        except BadPayload as error:  # a fault of perception: plan as if it saw nothing
            _log.warning("%s", error)
            return None

    def _fresh(self, reader: CellReader[P], age_limit_s: float) -> Sample[P] | None:
        sample = reader.latest()
        is_fresh = sample is not None and sample.age_s(self._clock.now_ns()) <= age_limit_s
        return sample if is_fresh else None
