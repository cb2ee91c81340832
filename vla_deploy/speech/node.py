"""Run speech: the microphone's stream in; what was heard, and what the robot says, out."""

import logging
from collections.abc import Sequence
from typing import Any

from drivers.clock import NS_PER_S
from platforms import Profile
from vla_deploy.ipc import BY_NAME, CellWriter, SharedSpace
from vla_deploy.node import NodeContext
from vla_deploy.robots import RobotDescription
from vla_deploy.speech.companions import StreamListener, Voice
from vla_deploy.speech.errors import SpeechMissing
from vla_deploy.speech.microphone import Microphone, OpenInput
from vla_deploy.speech.sound import SoundBlock

STATUS_PERIOD_NS = round(NS_PER_S / BY_NAME["speech_status"].rate_hz)
_log = logging.getLogger(__name__)


class SpeechNode:
    """Hear what is said to the robot, and say what it has to say.

    A robot that cannot hear says why in `speech_status` and goes on: commands may be typed.
    """

    period_s = 0.02

    def __init__(
        self,
        context: NodeContext,
        robot: RobotDescription,
        profile: Profile,
        microphone: OpenInput | None,
        *,
        voice: Voice | None = None,
        listeners: Sequence[StreamListener] = (),
    ) -> None:
        """Take `microphone`, which opens it, None where the robot has none, and the companions."""
        self._clock = context.clock
        self._space = SharedSpace(context.run_dir / "ipc", context.clock)
        self._profile = profile
        self._voice = voice
        self._listeners = tuple(listeners)
        self._microphone: Microphone | None = None
        self._deaf = f"robot {robot.name} has no [microphone]"
        if microphone is not None:
            self._microphone = Microphone("microphone", microphone, context.clock)
            self._deaf = ""
        self._status_due_ns = 0

    def start(self) -> None:
        """Open topics and companions; the microphone is opened by the first step."""
        self._status: CellWriter = self._space.cell_writer("speech_status")
        for companion in self._companions():
            companion.start(self._space)

    def step(self) -> None:
        """Speak, and hear what the microphone has."""
        if self._voice is not None:
            self._voice.step()
        block = self._poll()
        if block is not None:
            self._hear(block)
        self._tell()

    def stop(self) -> None:
        """Release microphone, companions and topics."""
        if self._microphone is not None:
            self._microphone.close()
        for companion in self._companions():
            companion.close()
        self._space.close()

    def _companions(self) -> tuple[StreamListener | Voice, ...]:
        return self._listeners if self._voice is None else (self._voice, *self._listeners)

    def _poll(self) -> SoundBlock | None:
        if self._microphone is None:
            return None
        try:
            return self._microphone.poll()
        except SpeechMissing as error:
            _log.error("degraded: the robot is deaf: %s", error)
            self._deaf = str(error)
            self._microphone.close()
            self._microphone = None
            return None

    def _hear(self, block: SoundBlock) -> None:
        for listener in self._listeners:
            listener.feed(block)

    def _tell(self) -> None:
        now_ns = self._clock.now_ns()
        if now_ns >= self._status_due_ns:
            self._status_due_ns = now_ns + STATUS_PERIOD_NS
            self._status.put_document(self._document())

    def _document(self) -> dict[str, Any]:
        microphone = self._microphone
        why = self._deaf or ("" if microphone is None else microphone.away)
        return {
            "state": "deaf" if why else "listening",
            "why": why,
            "speaking": self._voice is not None and self._voice.playing is not None,
            "microphone": {} if microphone is None else microphone.document(),
            "voice": {} if self._voice is None else dict(self._voice.document()),
            **{one.name: dict(one.document()) for one in self._listeners},
        }
