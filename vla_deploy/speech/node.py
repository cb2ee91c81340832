"""Run speech: the microphone's stream in; what was heard, and what the robot says, out."""

import logging
from collections.abc import Sequence
from concurrent.futures import Executor, Future
from dataclasses import dataclass, replace
from typing import Any, Final

from drivers.clock import NS_PER_S
from platforms import Profile
from vla_deploy.aside import AtOnce
from vla_deploy.inference.errors import InferenceError
from vla_deploy.inference.roles import ModelShelf
from vla_deploy.ipc import BY_NAME, CellWriter, SharedSpace
from vla_deploy.node import NodeContext
from vla_deploy.one_line import one_line
from vla_deploy.robots import RobotDescription
from vla_deploy.speech.choosing import Ears, ears_of
from vla_deploy.speech.companions import Playing, StreamListener, Voice
from vla_deploy.speech.errors import SpeechError, SpeechMissing
from vla_deploy.speech.hearing import Heard, Hearing, Room
from vla_deploy.speech.hot_words import HotWords
from vla_deploy.speech.microphone import Microphone, OpenInput
from vla_deploy.speech.page_microphone import PageMicrophone
from vla_deploy.speech.readings import Readings
from vla_deploy.speech.sound import SoundBlock
from vla_deploy.speech.telling import Telling
from vla_deploy.speech.verdict import Judgement, Verdict
from vla_deploy.speech.voice_activity import open_voice_activity

STATUS_PERIOD_NS: Final = round(NS_PER_S / BY_NAME["speech_status"].rate_hz)
_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class Prepared:
    """Hold what a profile asks of speech: its settings, and the recogniser."""

    profile: Profile
    ears: Ears


class SpeechNode:
    """Hear what is said to the robot, and say what it has to say.

    A robot that cannot hear says why in `speech_status` and goes on: commands may be typed. The
    recogniser is loaded and works in `executor`, beside the steps; without one, within them.
    """

    period_s = 0.02

    def __init__(
        self,
        context: NodeContext,
        robot: RobotDescription,
        profile: Profile,
        microphone: OpenInput | None,
        executor: Executor | None = None,
        *,
        voice: Voice | None = None,
        listeners: Sequence[StreamListener] = (),
        page_listeners: Sequence[StreamListener] = (),
        shelf: ModelShelf | None = None,
    ) -> None:
        """Take `microphone`, which opens it, None where the robot has none, and the companions."""
        self._clock = context.clock
        self._space = SharedSpace(context.run_dir / "ipc", context.clock)
        self._robot = robot
        self._profile = profile
        self._shelf = shelf or ModelShelf.of_run(context.run_dir, context.clock)
        self._executor = AtOnce() if executor is None else executor
        self._voice = voice
        self._room_listeners = tuple(listeners)
        self._page_listeners = tuple(page_listeners)
        self._listeners = (*self._room_listeners, *self._page_listeners)
        self._microphone: Microphone | None = None
        self._deaf = f"robot {robot.name} has no [microphone]"
        if microphone is not None:
            self._microphone = Microphone("microphone", microphone, context.clock)
            self._deaf = ""
        self._hearing: Hearing | None = None
        self._page: PageMicrophone
        self._rooms = {False: Room(), True: Room()}
        self._in_page = False
        self._opened_ears = False
        self._loading: Future[Ears] | None = None
        self._status_due_ns = 0

    def start(self) -> None:
        """Open topics and companions; microphone and recogniser follow beside the steps."""
        self._status: CellWriter = self._space.cell_writer("speech_status")
        self._telling = Telling(self._space, self._clock)
        self._page = PageMicrophone(self._space.record_reader("page_sound"), self._clock)
        for companion in self._companions():
            companion.start(self._space)
        if self._microphone is not None:
            self._open_ears()

    def step(self) -> None:
        """Speak, hear what the microphones have, and tell what was understood."""
        if self._voice is not None:
            self._voice.step()
        block = self._poll()
        if block is not None and self._voice is not None:
            block = self._voice.cleaned(block)
        for said in self._page.poll(self._profile.speech.unfinished_silence_s):
            self._hear_page(said)
        if block is not None:
            self._hear(block)
        self._take_loaded()
        if self._hearing is not None:
            for heard in self._hearing.heard():
                self._telling.tell(self._after_listeners(heard))
        self._tell_status()

    def stop(self) -> None:
        """Release microphone, networks, companions and topics."""
        if self._microphone is not None:
            self._microphone.close()
        self._close_ears()
        for companion in self._companions():
            companion.close()
        self._space.close()

    def prepare(self, profile: Profile, model_tier: int) -> Prepared:
        """Open the recogniser of a profile; where it has none, the robot says so."""
        return Prepared(profile=profile, ears=ears_of(self._shelf, profile, model_tier))

    def commit(self, prepared: Prepared) -> Prepared:
        """Change settings and recogniser between two phrases."""
        before, self._profile = self._profile, prepared.profile
        for listener in self._listeners:
            listener.heed(prepared.profile.speech)
        hearing = self._hearing
        if hearing is None:
            return Prepared(profile=before, ears=Ears(recogniser=None, why=self._deaf))
        hearing.settings = prepared.profile.speech
        recogniser, why = hearing.readings.take(prepared.ears.recogniser, prepared.ears.why)
        return Prepared(profile=before, ears=Ears(recogniser=recogniser, why=why))

    def discard(self, prepared: Prepared) -> None:
        """Close the recogniser that is not needed."""
        recogniser = prepared.ears.recogniser
        if recogniser is not None and self._hearing is not None:
            self._hearing.readings.release(recogniser)
        elif recogniser is not None:
            recogniser.close()

    def _companions(self) -> tuple[StreamListener | Voice, ...]:
        return self._listeners if self._voice is None else (self._voice, *self._listeners)

    def _open_ears(self) -> None:
        self._opened_ears = True
        try:
            activity = open_voice_activity(self._clock)
        except (InferenceError, SpeechError) as error:
            self._go_deaf(one_line(error))
            return
        hot_words = HotWords(self._robot.places, self._space.cell_reader("scene"))
        readings = Readings(self._executor, self._clock)
        self._hearing = Hearing(
            activity, readings, self._profile.speech, hot_words.text, self._suspicion
        )
        self._hearing.enter(self._rooms[False])
        self._loading = self._executor.submit(ears_of, self._shelf, self._profile, 0)

    def _close_ears(self) -> None:
        if self._hearing is not None:
            self._hearing.close()
        elif self._loading is None:
            self._executor.shutdown(wait=False, cancel_futures=True)
        self._hearing = None

    def _take_loaded(self) -> None:
        if self._hearing is None or self._loading is None or not self._loading.done():
            return
        ears, self._loading = self._loading.result(), None
        self._hearing.readings.take(ears.recogniser, ears.why)

    def _poll(self) -> SoundBlock | None:
        if self._microphone is None:
            return None
        try:
            return self._microphone.poll()
        except SpeechMissing as error:
            self._go_deaf(str(error))
            self._microphone.close()
            self._microphone = None
            return None

    def _go_deaf(self, why: str) -> None:
        _log.error("degraded: the robot is deaf: %s", why)
        self._deaf = why

    def _hear(self, block: SoundBlock) -> None:
        """Hear the room; while a person speaks into the page, only the listeners do."""
        hearing = self._hearing
        reads = hearing is not None and hearing.readings.recogniser is not None
        is_read = reads and not self._page.is_open
        for listener in self._room_listeners:
            listener.feed(block, is_read=is_read)
        if not self._page.is_open:
            self._understand(block, self._playing(), in_page=False)

    def _hear_page(self, block: SoundBlock) -> None:
        """Hear a person who holds the page's button: the robot falls silent for them."""
        # Who lets the button go at once leaves the recogniser no pause to read in.
        for listener in self._page_listeners:
            listener.feed(block, is_read=False)
        if not self._opened_ears:
            self._open_ears()
        if not self._in_page and self._voice is not None and self._playing() is not None:
            self._voice.barge_in(block.stamp_ns)
        self._understand(block, None, in_page=True)

    def _understand(self, block: SoundBlock, playing: Playing | None, *, in_page: bool) -> None:
        if self._hearing is None:
            return
        if in_page is not self._in_page:
            self._in_page = in_page
            self._hearing.enter(self._rooms[in_page])
            block = replace(block, follows=False)
        try:
            barged_ns = self._hearing.feed(block, playing)
        except InferenceError as error:
            self._go_deaf(one_line(error))
            self._close_ears()
            return
        if barged_ns is not None and self._voice is not None:
            self._voice.barge_in(barged_ns)

    def _suspicion(self, began_ns: int, ended_ns: int) -> float:
        """Return how near a listener to what is heard now came to hearing its word then."""
        listeners = self._page_listeners if self._in_page else self._room_listeners
        return max((one.suspicion(began_ns, ended_ns) for one in listeners), default=0.0)

    def _after_listeners(self, heard: Heard) -> Heard:
        """Keep a phrase from being a command that a listener has taken for something else."""
        if heard.judgement.verdict is Verdict.STOP:
            return heard
        for listener in self._listeners:
            reason = listener.refuses(heard.phrase.began_ns, heard.phrase.ended_ns)
            if reason:
                judgement = Judgement(verdict=Verdict.REJECTED, reason=reason)
                return replace(heard, judgement=judgement)
        return heard

    def _playing(self) -> Playing | None:
        return None if self._voice is None else self._voice.playing

    def _tell_status(self) -> None:
        now_ns = self._clock.now_ns()
        if now_ns >= self._status_due_ns:
            self._status_due_ns = now_ns + STATUS_PERIOD_NS
            self._status.put_document(self._document())

    def _document(self) -> dict[str, Any]:
        microphone, hearing = self._microphone, self._hearing
        recogniser = None if hearing is None else hearing.readings.recogniser
        why = self._why_deaf()
        return {
            "state": "deaf" if why or hearing is None else hearing.state,
            "why": why,
            "speaking": self._playing() is not None,
            "microphone": {} if microphone is None else microphone.document(),
            "page": self._page.document(),
            "room": {} if hearing is None else hearing.document(),
            "model": {} if recogniser is None else recogniser.document(),
            "heard": self._telling.document(),
            "voice": {} if self._voice is None else dict(self._voice.document()),
            **{one.name: dict(one.document()) for one in self._listeners},
        }

    def _why_deaf(self) -> str:
        """Return why spoken commands are not understood; empty while they are."""
        if self._deaf or self._microphone is None:
            return self._deaf
        if self._microphone.away or self._hearing is None:
            return self._microphone.away
        readings = self._hearing.readings
        return "" if readings.recogniser is not None else f"no model: {readings.why}"
