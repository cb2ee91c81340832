"""Say aloud what the topic `say` asks for: one text after the other, and silent at a word."""

import logging
from collections.abc import Mapping
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from drivers.audio.base import AudioFormat
from drivers.audio.espeak import ESPEAK, EspeakEngine
from drivers.clock import NS_PER_S, Clock
from drivers.errors import VoiceError
from vla_deploy.ipc import SharedSpace, topics
from vla_deploy.ipc.payloads.speech import VoiceEventName, VoiceStatus
from vla_deploy.ipc.stop_button import ESTOP
from vla_deploy.robots.devices import VoiceSettings
from vla_deploy.speech.sound import RATE_HZ, Playing, SoundBlock
from vla_deploy.speech.voice.audio_player import AudioPlayer, OpenOutput, PreparedSound
from vla_deploy.speech.voice.own_echo import OwnEcho

TAIL_NS: Final = 7 * NS_PER_S // 20
"""For so long a speaker's latency and the room let what was said be heard."""
LONGEST_LETTERS: Final = 400
"""More is cut at a word: half a minute of talk is enough, and the text is shown whole elsewhere."""
LONGEST_ID: Final = 80
MOST_WAITING: Final = 16
_REASON_LETTERS: Final = 200  # of any alphabet, a slot holds them
_log = logging.getLogger(__name__)


@dataclass(slots=True, kw_only=True, eq=False)
class _Saying:
    """Hold what waits to be said, or is: it is `prepared` first, then it plays."""

    say_id: str
    text: str
    prepared: "Future[PreparedSound] | None" = None
    has_begun: bool = False


class RobotVoice:
    """Speak, a little in each step.

    `executor` turns text into sound between the steps. A speaker that is away is tried again; what
    is to be said meanwhile fails at once, and says why.
    """

    def __init__(
        self,
        engine: EspeakEngine,
        open_output: OpenOutput,
        clock: Clock,
        executor: Executor,
        *,
        volume_ratio: float = 1.0,
    ) -> None:
        self._engine = engine
        self._executor = executor
        self._clock = clock
        self._volume_ratio = volume_ratio
        self._echo = OwnEcho()
        self._player = AudioPlayer(open_output, clock, self._echo.note)
        self._waiting: list[_Saying] = []
        self._saying: _Saying | None = None
        self._sounding: _Saying | None = None

    @property
    def playing(self) -> Playing | None:
        """Return what sounds at this moment, the room's answer to it included."""
        saying, until_ns = self._sounding, self._player.sounds_until_ns + TAIL_NS
        if saying is None or self._clock.now_ns() >= until_ns:
            return None
        return Playing(say_id=saying.say_id, text=saying.text, echo_db=self._echo.left_db)

    def start(self, space: SharedSpace) -> None:
        """Open the topics, and look for the engine."""
        self._orders = space.ring_reader(topics.SAY, from_start=False)
        self._operator = space.ring_reader(topics.OPERATOR, from_start=False)
        self._events = space.ring_writer(topics.VOICE_EVENT)
        missing = self._engine.missing()
        if missing:
            _log.error("degraded: the robot has no voice: %s", missing)

    def step(self) -> None:
        """Take what is to be said, and hand the speaker what it has room for."""
        for asked in self._operator.drain():
            if asked.payload.get("act") == ESTOP:
                self.fall_silent("the robot was stopped")
        for event in self._orders.drain():
            self._take(event.payload)
        if self._saying is None:
            self._begin_next()
        self._player.step()
        if self._saying is not None:
            self._advance(self._saying)

    def cleaned(self, frame: SoundBlock) -> SoundBlock:
        """Return a frame of the microphone without what the robot says."""
        return self._echo.clean(frame)

    def fall_silent(self, reason: str) -> None:
        """Break off what is being said and drop what waits."""
        self._drop(self._waiting, reason)
        self._break_off(reason)

    def document(self) -> VoiceStatus:
        """Return what `speech_status` tells under "voice"."""
        missing = self._engine.missing()
        why = missing or self._player.away
        return {
            "state": "missing" if missing else "away" if why else "ready",
            "why": why,
            "waiting": len(self._waiting),
        }

    def close(self) -> None:
        """Fall silent and release everything; closing twice is allowed."""
        self._player.cut()
        self._player.close()
        self._executor.shutdown(wait=False, cancel_futures=True)

    def _take(self, payload: Mapping[str, Any]) -> None:
        say_id, text = str(payload.get("say_id", ""))[:LONGEST_ID], payload.get("text")
        if payload.get("cancel") is True:
            self._take_back(say_id)
        elif not isinstance(text, str) or not text.strip():
            self._publish(say_id, "failed", f"text: expected words, got {text!r:.100}")
        elif len(self._waiting) == MOST_WAITING:
            self._publish(say_id, "dropped", "too much waits to be said")
        else:
            self._waiting.append(_Saying(say_id=say_id, text=_spoken(text)))

    def _take_back(self, say_id: str) -> None:
        reason = "it was taken back"
        self._drop([one for one in self._waiting if one.say_id == say_id], reason)
        if self._saying is not None and self._saying.say_id == say_id:
            self._break_off(reason)

    def _drop(self, dropped: list[_Saying], reason: str) -> None:
        self._waiting = [waiting for waiting in self._waiting if waiting not in dropped]
        for waiting in dropped:
            self._publish(waiting.say_id, "dropped", reason)

    def _begin_next(self) -> None:
        if not self._waiting:
            return
        saying, format_ = self._waiting.pop(0), self._player.format
        if format_ is None or self._player.away:
            self._publish(saying.say_id, "failed", self._player.away)
        else:
            saying.prepared = self._executor.submit(self._prepare, saying.text, format_)
            self._saying = saying

    def _prepare(self, text: str, format_: AudioFormat) -> PreparedSound:
        clip = self._engine.synthesise(text)
        wave = clip.at_rate(RATE_HZ).wave * np.float32(self._volume_ratio)
        return PreparedSound(samples=clip.samples(format_, self._volume_ratio), wave=wave)

    def _advance(self, saying: _Saying) -> None:
        if saying.prepared is not None:
            self._play_once_done(saying, saying.prepared)
        elif self._player.away:
            self._end(saying, "failed", self._player.away)
        elif not saying.has_begun and self._player.has_begun:
            saying.has_begun = True
            self._sounding = saying
            self._publish(saying.say_id, "began", "")
        elif self._player.is_done:
            self._end(saying, "finished", "")

    def _play_once_done(self, saying: _Saying, prepared: "Future[PreparedSound]") -> None:
        if not prepared.done():
            return
        try:
            self._player.play(prepared.result())
        except VoiceError as error:
            self._end(saying, "failed", str(error))
            return
        saying.prepared = None
        self._player.step()

    def _break_off(self, reason: str) -> None:
        saying = self._saying
        if saying is not None:
            self._end(saying, "interrupted" if saying.has_begun else "dropped", reason)

    def _end(self, saying: _Saying, event: VoiceEventName, reason: str) -> None:
        self._player.cut()
        self._saying = None
        self._publish(saying.say_id, event, reason)

    def _publish(self, say_id: str, event: VoiceEventName, reason: str) -> None:
        self._events.publish({"say_id": say_id, "event": event, "reason": reason[:_REASON_LETTERS]})


def _spoken(text: str) -> str:
    """Return a text as it is said; `red_cup` is two words."""
    said = " ".join(text.replace("_", " ").split())
    return said if len(said) <= LONGEST_LETTERS else said[:LONGEST_LETTERS].rsplit(" ", 1)[0]


def build_voice(
    settings: VoiceSettings, open_output: OpenOutput | None, clock: Clock, executor: Executor
) -> RobotVoice | None:
    """Return the voice of a robot; None where it has no speaker."""
    if open_output is None:
        return None
    engine = EspeakEngine(
        voice=settings.voice,
        words_per_minute=settings.words_per_minute,
        pitch=settings.pitch,
        program=settings.program or ESPEAK,
    )
    return RobotVoice(engine, open_output, clock, executor, volume_ratio=settings.volume_ratio)
