"""Run the whole robot stack in lock-step: the processes' nodes, one thread, simulated time."""

import itertools
from pathlib import Path
from typing import Any, Unpack

from drivers.audio.base import Samples
from platforms import load_profile
from sim_twin.faults import FaultInjector
from sim_twin.harness.lockstep import Lockstep
from sim_twin.harness.senses_node import SensesNode
from sim_twin.sound.hearing import Spoken, let_arrive
from sim_twin.sound.streams import streamed_microphone, streamed_speaker
from sim_twin.sound.talker import Talker, arrival
from vla_deploy.control.node import ControlNode
from vla_deploy.ipc import SharedSpace, topics
from vla_deploy.ipc.payloads.motion import OperatorActName
from vla_deploy.ipc.payloads.tasks import UtteranceContent
from vla_deploy.perception.node import PerceptionNode
from vla_deploy.planning.node import PlannerNode
from vla_deploy.runtime.executors import InlineExecutor
from vla_deploy.runtime.node import Node
from vla_deploy.skills.node import ExecutorNode
from vla_deploy.speech.node import SpeechNode
from vla_deploy.speech.stop_words.listener import PAGE, build_stop_words
from vla_deploy.speech.voice.robot_voice import build_voice

READY_TIMEOUT_S = 10.0
COMMAND_TIMEOUT_S = 300.0
ACT_S = 3.0
ACT_EVERY_S = 0.5
REACHED = {"reset": "disarmed", "arm": "armed"}


class StackNotReady(Exception):
    """Say that the stack did not come up."""


class LockstepControl:
    """Own a twin and the control node; be the operator and read what control tells."""

    def __init__(
        self,
        tmp_path: Path,
        seed: int = 0,
        profile: str = "desktop",
        *,
        robot: str = "butler",
        world: str = "flat",
    ) -> None:
        self.lockstep = Lockstep(robot, world, seed, profile, tmp_path=tmp_path)
        self.robot = self.lockstep.robot
        self._profile = load_profile(profile)
        self.space = SharedSpace(tmp_path / "ipc", self.lockstep.clock)
        self.operator = self.space.ring_writer(topics.OPERATOR)
        self._status = self.space.cell_reader(topics.CONTROL_STATUS)
        self.control: Node = self._new_control()
        self.lockstep.add(self.control)

    @property
    def faults(self) -> FaultInjector:
        """Return the way to make the twin's devices fail."""
        return self.lockstep.faults

    def add_senses(self) -> None:
        """Give control what the base does not drive without: scan, attitude, pose and depth."""
        context, devices = self.lockstep.context, self.lockstep.devices
        self.lockstep.add(SensesNode(context, self.robot, devices))

    def restart_control(self) -> None:
        """Start control anew, as the supervisor does after it died."""
        self.control = self._new_control()
        self.lockstep.add(self.control)

    def _new_control(self) -> Node:
        context, devices = self.lockstep.context, self.lockstep.devices
        return ControlNode(context, self.robot, self._profile, devices)

    def status(self) -> dict[str, Any]:
        """Return control's newest status, or an empty document before the first."""
        sample = self._status.latest()
        return {} if sample is None else {**sample.document()}

    def operate(self, act: OperatorActName) -> None:
        """Publish an operator's act."""
        self.operator.publish({"act": act, "source": "test", "reason": ""})

    def arm(self) -> None:
        """Wait for control, arm it, and wait until it is armed.

        Raises:
            NotReady: it does not get there.
        """
        clock = self.lockstep
        if not clock.run_until(lambda: bool(self.status()), READY_TIMEOUT_S):
            raise StackNotReady("control tells no status")
        self.operate("arm")
        if not clock.run_until(lambda: self.status()["state"] == "armed", READY_TIMEOUT_S):
            raise StackNotReady(f"control does not arm: {self.status()}")

    def insist(self, act: OperatorActName) -> None:
        """Do an operator's act again and again, as a person would, until it has its effect."""
        for _ in range(round(ACT_S / ACT_EVERY_S)):
            self.operate(act)
            if self.lockstep.run_until(lambda: self.status()["state"] == REACHED[act], ACT_EVERY_S):
                return

    def speak(self, text: str, talker: Talker | None = None, snr_db: float | None = None) -> Spoken:
        """Let somebody in the room say a text; return when the words begin and end.

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
        self.space.close()


class LockstepStack(LockstepControl):
    """Own a twin and every node of the robot; give commands and read what became of them."""

    def __init__(
        self,
        tmp_path: Path,
        seed: int = 0,
        profile: str = "desktop",
        *,
        robot: str = "butler",
        world: str = "flat",
        speech: bool = False,
    ) -> None:
        """Start every node; with `speech` the robot hears and speaks too, which costs time."""
        super().__init__(tmp_path, seed, profile, robot=robot, world=world)
        self._utterances = self.space.ring_writer(topics.UTTERANCE)
        self._events = self.space.ring_reader(topics.TASK_EVENT, from_start=True)
        self._numbers = itertools.count(1)
        self.events: list[dict[str, Any]] = []
        self._outcomes: dict[str, dict[str, Any]] = {}
        context, devices = self.lockstep.context, self.lockstep.devices
        self.perception: Node = PerceptionNode(context, self.robot, self._profile, devices)
        self.planner: Node = PlannerNode(context, self.robot)
        rate_hz = self._profile.executor_rate_hz
        self.executor: Node = ExecutorNode(context, self.robot, rate_hz)
        for node in (self.perception, self.planner, self.executor):
            self.lockstep.add(node)
        if speech:
            self.lockstep.add(self._speech())

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
        self._utterances.publish({"command_id": command_id, "source": "test", **content})
        return command_id

    def outcome(self, command_id: str) -> dict[str, Any] | None:
        """Return a command's last event, once it has one."""
        for event in self._events.drain():
            self.events.append({**event.payload})
            if event.payload["event"] in ("finished", "rejected"):
                self._outcomes.setdefault(event.payload["command_id"], {**event.payload})
        return self._outcomes.get(command_id)

    def say(self, text: str, timeout_s: float = COMMAND_TIMEOUT_S) -> dict[str, Any]:
        """Give a command and run until it has ended.

        Raises:
            NotReady: it does not end in time.
        """
        command_id = self.give(text=text)
        if not self.lockstep.run_until(lambda: self.outcome(command_id) is not None, timeout_s):
            raise StackNotReady(f'"{text}" did not end within {timeout_s:g} s')
        return self._outcomes.pop(command_id)
