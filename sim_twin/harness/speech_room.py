"""Put a speech process into the twin's room without the physics: ears, mouth and people alone."""

from pathlib import Path
from typing import Any, Final

from drivers.audio.base import AudioFormat
from drivers.audio.pcm_stream import PcmInput, PcmOutput
from drivers.clock import NS_PER_S
from platforms import load_profile
from sim_twin.contracts.scripted import ManualClock
from sim_twin.faults.line_tamper import LineTamper
from sim_twin.ports.lines import MemoryLine
from sim_twin.sensors.sound import MicrophoneDevice, SpeakerDevice
from sim_twin.sound.talker import Talker, arrival
from vla_deploy.ipc import Announced, Announcer, SharedSpace, topics
from vla_deploy.ipc.payloads.speech import HeardMessage
from vla_deploy.robots import load_robot
from vla_deploy.runtime.executors import InlineExecutor
from vla_deploy.runtime.node import NodeContext
from vla_deploy.speech.node import SpeechNode
from vla_deploy.speech.stop_words.listener import StopWords
from vla_deploy.speech.voice.robot_voice import build_voice

STEP_NS: Final = NS_PER_S // 50
_FORMAT: Final = AudioFormat(rate_hz=16_000)


class SpeechRoom:
    """Step one robot's real speech node, with its real voice, on a clock of its own."""

    def __init__(self, run_dir: Path, stop_words: StopWords | None = None) -> None:
        """Start the node under `run_dir`; what it has said and heard is read from its topics."""
        self.clock = ManualClock(NS_PER_S)
        self.ear = MicrophoneDevice(_FORMAT, seed=1)
        self.mouth = SpeakerDevice(_FORMAT, self.ear.room)
        self.space = SharedSpace(run_dir / "ipc", self.clock)
        self.announcer = Announcer(self.space, "room", self.clock)
        self._heard = self.space.ring_reader(topics.HEARD, from_start=True)
        self._status = self.space.cell_reader(topics.SPEECH_STATUS)
        self.node = self._node(run_dir, stop_words)
        self.node.start()
        self.run(0.5)

    @property
    def now_s(self) -> float:
        """Return the room's time in seconds."""
        return self.clock.ns / NS_PER_S

    def run(self, seconds: float) -> None:
        """Run for a simulated time."""
        for _ in range(round(seconds * NS_PER_S / STEP_NS)):
            self.clock.ns += STEP_NS
            self.node.step()

    def robot_says(self, text: str, at_most_s: float = 60.0) -> Announced | None:
        """Have the robot say something to its end; None when there is none in time."""
        return self.end_of(self.announcer.say(text), at_most_s)

    def end_of(self, say_id: str, at_most_s: float) -> Announced | None:
        """Run until something that the robot says has ended; None when it has not in time."""
        for _ in range(round(at_most_s * NS_PER_S / STEP_NS)):
            self.run(STEP_NS / NS_PER_S)
            ended = self.announcer.ended(say_id)
            if ended is not None:
                return ended
        return None

    def person_says(self, text: str, talker: Talker, snr_db: float | None = None) -> float:
        """Begin to play a person's words now; return for how many seconds words arrive."""
        room = self.ear.room
        heard = arrival(text, talker, room.rate_hz, room.acoustics, snr_db=snr_db)
        room.lay(heard.sound.wave, room.row_at(self.clock.ns))
        return (heard.words[1] - heard.words[0]) / room.rate_hz

    def heard(self) -> list[HeardMessage]:
        """Return what the robot has heard since the last call."""
        return [event.payload for event in self._heard.drain()]

    def status(self) -> dict[str, Any]:
        """Return the newest `speech_status`."""
        sample = self._status.latest()
        return {} if sample is None else {**sample.document()}

    def close(self) -> None:
        """Stop the node and let go of its topics."""
        self.node.stop()
        self.space.close()

    def _node(self, run_dir: Path, stop_words: StopWords | None) -> SpeechNode:
        robot, clock = load_robot("butler"), self.clock
        context = NodeContext(
            run_dir=run_dir, robot=robot.name, profile="desktop", devices_dir=None, clock=clock
        )
        return SpeechNode(
            context,
            robot,
            load_profile(context.profile),
            lambda: PcmInput(self._line(self.ear), clock, _FORMAT),
            voice=build_voice(
                robot.voice,
                lambda: PcmOutput(self._line(self.mouth), clock, _FORMAT),
                clock,
                InlineExecutor(),
            ),
            stop_words=stop_words,
        )

    def _line(self, device: MicrophoneDevice | SpeakerDevice) -> MemoryLine:
        device.step(self.clock.ns)
        device.announce()
        return MemoryLine(LineTamper(device, self.clock.now_ns), self.clock)
