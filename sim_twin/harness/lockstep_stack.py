"""Run the whole robot stack in lock-step: the processes' nodes, one thread, simulated time."""

import itertools
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from functools import cached_property
from pathlib import Path
from typing import Any, Final, Unpack

from drivers import registry
from drivers.audio.base import Samples
from drivers.clock import NS_PER_S
from drivers.imu.base import Imu
from drivers.lidar.base import Lidar
from drivers.opener import DeviceOpener
from platforms import load_profile
from sim_twin.faults import FaultInjector
from sim_twin.harness.audio_streams import streamed_microphone, streamed_speaker
from sim_twin.harness.lockstep import DEVICES_DIR, Lockstep
from sim_twin.harness.robot import RobotFailed, RobotUnderTest
from sim_twin.sound.hearing import Spoken, let_arrive
from sim_twin.sound.talker import Talker, arrival
from vla_deploy.client.link import RobotLink
from vla_deploy.control.node import ControlNode
from vla_deploy.devices import HomeDevices, open_home
from vla_deploy.ipc import CellWriter, SharedSpace, topics
from vla_deploy.ipc.payloads.motion import OperatorActName
from vla_deploy.ipc.payloads.tasks import UtteranceContent
from vla_deploy.memory import MemoryStore
from vla_deploy.missions.store import FILE_NAME, MissionStore
from vla_deploy.perception.node import PerceptionNode
from vla_deploy.perception.pose_tracker import PoseTracker
from vla_deploy.perception.wheel_pose import WheelPose
from vla_deploy.planning.node import PlannerNode
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.battery_settings import BatterySettings
from vla_deploy.robots.home_devices import BROKER_SOCKET
from vla_deploy.robots.kinematics.model import RobotModel
from vla_deploy.runtime.executors import InlineExecutor
from vla_deploy.runtime.node import Node, NodeContext
from vla_deploy.skills.node import ExecutorNode
from vla_deploy.speech.node import SpeechNode
from vla_deploy.speech.stop_words.listener import PAGE, build_stop_words
from vla_deploy.speech.voice.robot_voice import build_voice
from vla_deploy.supervisor.battery import open_battery

COMMAND_TIMEOUT_S: Final = 300.0
LOOK_PERIOD_S: Final = 1.0 / topics.NEAR_OBSTACLES.rate_hz
_COMMAND_S: Final = 0.02
_ACT_S: Final = 3.0
_ACT_EVERY_S: Final = 0.5
_REACHED: Final = {"reset": "disarmed", "arm": "armed"}


class LockstepControl(RobotUnderTest):
    """Own a twin and the control node; be the operator and read what control publishes."""

    status_age_limit_s = None

    def __init__(
        self,
        tmp_path: Path,
        seed: int = 0,
        profile: str = "desktop",
        *,
        robot: str = "butler",
        world: str = "",
    ) -> None:
        self.lockstep = Lockstep(robot, world, seed, profile, tmp_path=tmp_path)
        self.robot = self.lockstep.robot
        self._profile = load_profile(profile)
        self.clock = self.lockstep.clock
        self._link = RobotLink(tmp_path, self.clock, source="test")
        self.space = self._link.space
        self.control: Node = self._new_control()
        self.lockstep.add(self.control)

    @property
    def faults(self) -> FaultInjector:
        """Return the way to make the twin's devices fail."""
        return self.lockstep.faults

    def add_senses(self) -> None:
        """Give control what the base does not drive without: scan, attitude, pose and depth.

        A base without a lidar has its pose by its wheels.
        """
        context, devices = self.lockstep.context, self.lockstep.devices
        if self.robot.finds_its_way:
            self.lockstep.add(SensesNode(context, self.robot, devices))
        else:
            self.lockstep.add(WheelSenseNode(context, self.robot))

    def restart_control(self) -> None:
        """Start control anew, as the supervisor does after it died."""
        self.control = self._new_control()
        self.lockstep.add(self.control)

    def _new_control(self) -> Node:
        context, devices = self.lockstep.context, self.lockstep.devices
        return ControlNode(context, self.robot, self._profile, devices)

    @property
    def link(self) -> RobotLink:
        """Return the way to the robot's topics."""
        return self._link

    def status(self) -> dict[str, Any]:
        """Return control's newest status, or an empty document before the first."""
        return self.document(topics.CONTROL_STATUS)

    def operate(self, act: OperatorActName) -> None:
        """Publish an operator's act."""
        self._link.writer(topics.OPERATOR).publish({"act": act, "source": "test", "reason": ""})

    def insist(self, act: OperatorActName) -> None:
        """Do an operator's act again and again, as a person would, until it has its effect."""
        for _ in range(round(_ACT_S / _ACT_EVERY_S)):
            self.operate(act)
            if self.wait_until(lambda: self.state() == _REACHED[act], _ACT_EVERY_S):
                return

    @cached_property
    def _base_command(self) -> CellWriter:
        return self.space.cell_writer(topics.BASE_COMMAND)

    def drive_for(
        self, duration_s: float, v_m_s: float, w_rad_s: float = 0.0, left_m_s: float = 0.0
    ) -> None:
        """Drive for a time, past the executor: control wants its commands again and again."""
        end_s = self.lockstep.now_s + duration_s
        while self.lockstep.now_s < end_s - 1e-9:
            self._base_command.put(v_m_s=v_m_s, w_rad_s=w_rad_s, left_m_s=left_m_s)
            self.lockstep.run_for(min(_COMMAND_S, end_s - self.lockstep.now_s))

    def wait_until(self, condition: Callable[[], object], timeout_s: float = 60.0) -> bool:
        """Run until `condition()`; return whether it came true in time."""
        return self.lockstep.run_until(condition, timeout_s)

    def pause(self, duration_s: float) -> None:
        """Run every node for a simulated time."""
        self.lockstep.run_for(duration_s)

    def speak(self, text: str, talker: Talker | None = None, snr_db: float | None = None) -> Spoken:
        """Play a text as said by a person in the room; return when the words begin and end.

        Raises:
            VoiceError: the talker's words do not become sound.
        """
        room = self.lockstep.twin.microphone.room
        heard = arrival(text, talker or Talker(), room.rate_hz, room.acoustics, snr_db=snr_db)
        return let_arrive(self.lockstep.twin, heard)

    def said(self) -> Samples:
        """Return what the robot's speaker has played since the last call, (n, channels)."""
        return self.lockstep.twin.speaker.said()

    def close(self) -> None:
        """Stop every node and release the twin."""
        self.lockstep.close()
        self._link.close()


class BatteryNode:
    """Step what the supervisor steps beside the processes: the keeper of the battery."""

    period_s = 0.5

    def __init__(self, context: NodeContext, robot: BatterySettings, space: SharedSpace) -> None:
        root = context.run_dir / DEVICES_DIR
        self._keeper = open_battery(robot, space, context.clock, root, InlineExecutor())

    def start(self) -> None:
        """Do nothing: the keeper is open."""

    def step(self) -> None:
        """Measure and publish."""
        self._keeper.step()

    def stop(self) -> None:
        """Close the topic."""
        self._keeper.close()


class LockstepStack(LockstepControl):
    """Own a twin and every node of the robot; give commands and read what became of them."""

    def __init__(
        self,
        tmp_path: Path,
        seed: int = 0,
        profile: str = "desktop",
        *,
        robot: str = "butler",
        world: str = "",
        speech: bool = False,
        memory: Path | None = None,
    ) -> None:
        """Start every node; with `speech` the robot hears and speaks too, which costs time.

        With a file for its `memory` it remembers from run to run.
        """
        super().__init__(tmp_path, seed, profile, robot=robot, world=world)
        self._memory = memory
        self._events = self._link.events(topics.TASK_EVENT, from_start=True)
        self._numbers = itertools.count(1)
        self.events: list[dict[str, Any]] = []
        self._outcomes: dict[str, dict[str, Any]] = {}
        context, devices = self.lockstep.context, self.lockstep.devices
        self.perception: Node = PerceptionNode(context, self.robot, self._profile, devices)
        self.planner: Node = self._new_planner()
        rate_hz = self._profile.executor_rate_hz
        self.executor: Node = ExecutorNode(
            context, self.robot, rate_hz, devices=self._open_home(context)
        )
        for node in (self.perception, self.planner, self.executor):
            self.lockstep.add(node)
        if self.robot.battery is not None:
            self.lockstep.add(BatteryNode(context, self.robot.battery, self.space))
        if speech:
            self.lockstep.add(self._speech())

    def restart_planner(self) -> None:
        """Start the planner anew, as the supervisor does after it died."""
        self.planner = self._new_planner()
        self.lockstep.add(self.planner)

    def _new_planner(self) -> Node:
        context = self.lockstep.context
        missions = MissionStore(context.run_dir / FILE_NAME)
        memory = None if self._memory is None else MemoryStore(self._memory)
        return PlannerNode(context, self.robot, memory=memory, missions=missions)

    def _open_home(self, context: NodeContext) -> HomeDevices:
        """Begin the twin's home, and return its devices as the executor has them."""
        broker = context.run_dir / BROKER_SOCKET
        self.lockstep.twin.begin_home(broker)
        return open_home(self.robot, context.clock, lambda _name: InlineExecutor(), broker)

    def _speech(self) -> Node:
        context, devices, robot = self.lockstep.context, self.lockstep.devices, self.robot
        speaker = streamed_speaker(robot, devices, context.clock)
        voice = build_voice(robot.voice, speaker, context.clock, InlineExecutor())
        return SpeechNode(
            context,
            robot,
            self._profile,
            streamed_microphone(robot, devices, context.clock),
            voice=voice,
            stop_words=build_stop_words(context, self._profile),
            page_stop_words=build_stop_words(context, self._profile, place=PAGE),
        )

    def give(self, **content: Unpack[UtteranceContent]) -> str:
        """Give a command without waiting; return its id."""
        command_id = f"command-{next(self._numbers)}"
        self._link.writer(topics.UTTERANCE).publish(
            {"command_id": command_id, "source": "test", **content}
        )
        return command_id

    def outcome(self, command_id: str) -> dict[str, Any] | None:
        """Return a command's last event, once it has one."""
        for event in self._events.drain():
            self.events.append({**event.payload})
            if event.payload["event"] in ("finished", "rejected"):
                self._outcomes.setdefault(event.payload["command_id"], {**event.payload})
        return self._outcomes.get(command_id)

    def has_said(self, words: str) -> bool:
        """Return whether a skill has said something with these words in it."""
        return any(one["event"] == "said" and words in one["text"] for one in self.events)

    def say(self, text: str, timeout_s: float = COMMAND_TIMEOUT_S) -> dict[str, Any]:
        """Give a command and run until it has ended.

        Raises:
            RobotFailed: it does not end in time.
        """
        return self.end_of(self.give(text=text), timeout_s, text)

    def end_of(
        self, command_id: str, timeout_s: float = COMMAND_TIMEOUT_S, text: str = ""
    ) -> dict[str, Any]:
        """Run until a command has ended, given as `text`; return its outcome.

        Raises:
            RobotFailed: it does not end in time.
        """
        if not self.wait_until(lambda: self.outcome(command_id) is not None, timeout_s):
            raise RobotFailed(f'"{text or command_id}" did not end within {timeout_s:g} s')
        return self._outcomes.pop(command_id)


@contextmanager
def armed_lockstep(run_dir: Path, **chosen: Any) -> Iterator[LockstepStack]:
    """Give the whole robot in lock-step, armed; `chosen` are arguments of `LockstepStack`.

    Raises:
        RobotFailed: control does not arm.
    """
    with closing(LockstepStack(run_dir, **chosen)) as stack:
        stack.arm()
        yield stack


def lockstep_robot(
    tmp_path: Path, seed: int = 0, *, takes_all: bool, robot: str = "butler"
) -> LockstepControl:
    """Return the whole stack, or, at a fraction of its cost, control and what it drives by."""
    if takes_all:
        return LockstepStack(tmp_path, seed, robot=robot)
    control = LockstepControl(tmp_path, seed, robot=robot)
    if control.robot.parts.base is not None:
        control.add_senses()
    return control


class SensesNode:
    """Publish what a driving base is judged by where perception, which needs a camera, is away.

    Lidar and IMU are read by their real drivers, the camera sees an empty floor. The pose follows
    wheels and IMU from where the robot starts; scans do not correct it.
    """

    period_s = 0.02

    def __init__(
        self, context: NodeContext, robot: RobotDescription, devices: DeviceOpener
    ) -> None:
        """Open lidar and IMU.

        Raises:
            DriverError: one of them is missing or busy.
            MapInvalid: the robot file's map cannot be used.
        """
        self._clock = clock = context.clock
        lidar, imu = devices.serial(robot.lidar.device), devices.serial(robot.imu.device)
        self._lidar: Lidar = registry.open_lidar(robot.lidar.model, lidar, clock)
        self._imu: Imu = registry.open_imu(robot.imu.model, imu, clock)
        self._space = SharedSpace(context.run_dir / "ipc", clock)
        self._pose_tracker = PoseTracker(robot, RobotModel(robot), self._space)
        self._scan = self._space.cell_writer(topics.SCAN)
        self._attitude = self._space.cell_writer(topics.IMU)
        self._obstacles = self._space.cell_writer(topics.NEAR_OBSTACLES)
        self._next_look_ns = 0

    def start(self) -> None:
        """Open the pose's topics; the rest is open."""
        self._pose_tracker.start(self._space)

    def step(self) -> None:
        """Publish what is new.

        Raises:
            LinkLost: a line has gone.
        """
        self._publish_attitude()
        self._pose_tracker.predict(self._clock.now_ns())
        self._publish_scan()
        if self._clock.now_ns() >= self._next_look_ns:
            self._next_look_ns = self._clock.now_ns() + round(LOOK_PERIOD_S * NS_PER_S)
            self._obstacles.put(count=0, period_s=LOOK_PERIOD_S, x_m=(), y_m=(), z_m=())

    def stop(self) -> None:
        """Release lidar and IMU."""
        self._lidar.close()
        self._imu.close()
        self._space.close()

    def _publish_attitude(self) -> None:
        samples = self._imu.poll()
        if not samples:
            return
        newest = samples[-1]
        self._pose_tracker.add_imu(newest)
        self._attitude.put(
            yaw_rad=newest.yaw_rad,
            pitch_rad=newest.pitch_rad,
            roll_rad=newest.roll_rad,
            acceleration_m_s2=newest.acceleration_m_s2,
        )

    def _publish_scan(self) -> None:
        scan = self._lidar.poll()
        if scan is not None:
            ages_s = (self._clock.now_ns() - scan.beam_stamp_ns) / NS_PER_S
            self._scan.put(range_m=scan.range_m, beam_age_s=ages_s)


class WheelSenseNode:
    """Publish the pose of a base by its wheels where perception, which needs a camera, is away."""

    period_s = 0.02

    def __init__(self, context: NodeContext, robot: RobotDescription) -> None:
        self._clock = context.clock
        self._space = SharedSpace(context.run_dir / "ipc", context.clock)
        self._pose = WheelPose(robot, self._space)

    def start(self) -> None:
        """Open the topics."""
        self._pose.start(self._space)

    def step(self) -> None:
        """Publish the pose."""
        self._pose.predict(self._clock.now_ns())

    def stop(self) -> None:
        """Close the topics."""
        self._space.close()
