"""Run speech: the microphone's stream in; what was heard, and what the robot says, out."""

import logging
from concurrent.futures import Executor, Future
from dataclasses import replace
from typing import Final

from drivers.clock import NS_PER_S
from platforms import Profile
from vla_deploy.inference.errors import InferenceError
from vla_deploy.inference.roles import ModelShelf
from vla_deploy.ipc import BY_NAME, SharedSpace, topics
from vla_deploy.ipc.payloads.speech import SpeechStatus
from vla_deploy.robots import RobotDescription
from vla_deploy.runtime.executors import InlineExecutor
from vla_deploy.runtime.node import NodeContext
from vla_deploy.runtime.one_line import one_line
from vla_deploy.speech.asr_pipeline import AsrPipeline, HeardPhrase
from vla_deploy.speech.errors import SpeechError
from vla_deploy.speech.event_publisher import SpeechEvents
from vla_deploy.speech.microphone import Microphone, OpenInput
from vla_deploy.speech.model_selection import SelectedRecogniser, select_recogniser
from vla_deploy.speech.page_microphone import PageMicrophone
from vla_deploy.speech.sound import Playing, SoundBlock
from vla_deploy.speech.stop_words.listener import StopWords
from vla_deploy.speech.transcription_queue import TranscriptionQueue
from vla_deploy.speech.verdict import PhraseJudgement, PhraseVerdict
from vla_deploy.speech.voice.robot_voice import RobotVoice
from vla_deploy.speech.voice_activity import open_voice_activity
from vla_deploy.speech.words import words_of

STATUS_PERIOD_NS: Final = round(NS_PER_S / BY_NAME["speech_status"].rate_hz)
SOMEBODY_SPOKE: Final = "somebody spoke"
PreparedSpeech = tuple[Profile, SelectedRecogniser]
"""What a profile asks of speech: its settings, and the recogniser."""
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
        executor: Executor | None = None,
        loader: Executor | None = None,
        *,
        voice: RobotVoice | None = None,
        stop_words: StopWords | None = None,
        page_stop_words: StopWords | None = None,
        shelf: ModelShelf | None = None,
    ) -> None:
        """Take `microphone`, which opens it, None where the robot has none.

        The recogniser works in `executor`, and is loaded in `loader`; without one, within the
        steps. The two listeners hear the room and the page.
        """
        self._clock = context.clock
        self._space = SharedSpace(context.run_dir / "ipc", context.clock)
        self._robot = robot
        self._profile = profile
        self._shelf = shelf or ModelShelf.of_run(context.run_dir, context.clock)
        self._executor = InlineExecutor() if executor is None else executor
        self._loader = InlineExecutor() if loader is None else loader
        self._voice = voice
        self._stop_words, self._page_stop_words = stop_words, page_stop_words
        self._listeners = tuple(one for one in (stop_words, page_stop_words) if one is not None)
        self._microphone: Microphone | None = None
        self._deaf = f"robot {robot.name} has no [microphone]"
        if microphone is not None:
            self._microphone = Microphone(microphone, context.clock)
            self._deaf = ""
        self._asr: AsrPipeline | None = None
        self._page: PageMicrophone
        self._in_page = False
        self._loading: Future[SelectedRecogniser] | None = None
        self._status_due_ns = 0

    def start(self) -> None:
        """Open topics, voice and listeners; the recogniser follows beside the steps."""
        self._status = self._space.cell_writer(topics.SPEECH_STATUS)
        self._publisher = SpeechEvents(self._space, self._clock)
        self._page = PageMicrophone(self._space.record_reader(topics.PAGE_SOUND), self._clock)
        if self._voice is not None:
            self._voice.start(self._space)
        for listener in self._listeners:
            listener.start(self._space)
        self._open_asr()

    def step(self) -> None:
        """Speak, hear what the microphones have, and publish what was understood."""
        if self._voice is not None:
            self._voice.step()
        for frame in self._page.poll(self._profile.speech.unfinished_silence_s):
            self._hear_page(frame)
        if self._microphone is not None:
            for frame in self._microphone.poll():
                self._hear_room(frame)
        self._take_loaded()
        if self._asr is not None:
            for heard in self._asr.heard():
                self._publisher.publish(self._after_listeners(heard))
        self._publish_status()

    def stop(self) -> None:
        """Release microphone, networks, voice, listeners and topics."""
        if self._microphone is not None:
            self._microphone.close()
        self._close_asr()
        self._loader.shutdown(wait=False, cancel_futures=True)
        for listener in self._listeners:
            listener.close()
        if self._voice is not None:
            self._voice.close()
        self._space.close()

    def prepare(self, profile: Profile, model_tier: int) -> PreparedSpeech:
        """Open the recogniser of a profile; where it has none, the robot says so."""
        return profile, self._select(profile, model_tier).result()

    def commit(self, prepared: PreparedSpeech) -> PreparedSpeech:
        """Change settings and recogniser between two phrases."""
        before = SelectedRecogniser(recogniser=None, why=self._deaf)
        (profile, selected), profile_before = prepared, self._profile
        self._profile = profile
        for listener in self._listeners:
            listener.adopt(profile.speech)
        if self._asr is not None:
            self._asr.endpointer.settings = profile.speech
            before, self._asr.queue.selected = self._asr.queue.selected, selected
        return profile_before, before

    def discard(self, prepared: PreparedSpeech) -> None:
        """Close the recogniser that is not needed, behind what it was asked last."""
        recogniser = prepared[1].recogniser
        if recogniser is not None and self._asr is not None:
            self._executor.submit(recogniser.close)
        elif recogniser is not None:
            recogniser.close()

    def _open_asr(self) -> None:
        try:
            activity = open_voice_activity()
        except (InferenceError, SpeechError) as error:
            self._go_deaf(one_line(error))
            return
        queue = TranscriptionQueue(self._executor, self._clock)
        names = frozenset(words_of(self._robot.name))
        self._asr = AsrPipeline(activity, queue, self._profile.speech, names)
        self._loading = self._select(self._profile, 0)

    def _select(self, profile: Profile, model_tier: int) -> "Future[SelectedRecogniser]":
        """Open a recogniser in the loader's thread, which has the priority of the steps."""
        return self._loader.submit(self._opened, profile, model_tier)

    def _opened(self, profile: Profile, model_tier: int) -> SelectedRecogniser:
        selected = select_recogniser(self._shelf, profile, model_tier)
        if selected.recogniser is None:
            _log.error("degraded: nothing turns speech into text, type commands: %s", selected.why)
        elif selected.why:
            _log.warning("degraded: %s", selected.why)
        return selected

    def _close_asr(self) -> None:
        if self._asr is not None:
            self._asr.close()
        else:
            self._executor.shutdown(wait=False, cancel_futures=True)
        self._asr = None

    def _take_loaded(self) -> None:
        if self._asr is None or self._loading is None or not self._loading.done():
            return
        self._asr.queue.selected, self._loading = self._loading.result(), None

    def _go_deaf(self, why: str) -> None:
        _log.error("degraded: the robot is deaf: %s", why)
        self._deaf = why

    def _hear_room(self, frame: SoundBlock) -> None:
        """Hear the room; while a person speaks into the page, only for stop words."""
        if self._voice is not None:
            frame = self._voice.cleaned(frame)
        if self._stop_words is not None:
            self._stop_words.feed(frame, self._playing())
        if not self._page.is_open:
            self._understand(frame, self._playing(), in_page=False)

    def _hear_page(self, frame: SoundBlock) -> None:
        """Hear a person who holds the page's button: the robot falls silent for them."""
        if self._page_stop_words is not None:
            self._page_stop_words.feed(frame)
        if not self._in_page and self._voice is not None and self._playing() is not None:
            self._voice.fall_silent(SOMEBODY_SPOKE)
        self._understand(frame, None, in_page=True)

    def _understand(self, frame: SoundBlock, playing: Playing | None, *, in_page: bool) -> None:
        if self._asr is None:
            return
        if in_page is not self._in_page:
            self._in_page = in_page
            frame = replace(frame, follows=False)
        try:
            barged_in = self._asr.feed(frame, playing)
        except InferenceError as error:
            self._go_deaf(one_line(error))
            self._close_asr()
            return
        if barged_in and self._voice is not None:
            self._voice.fall_silent(SOMEBODY_SPOKE)

    def _after_listeners(self, heard: HeardPhrase) -> HeardPhrase:
        """Keep a phrase in which a listener has heard a stop from being a command."""
        if heard.judgement.verdict is PhraseVerdict.STOP:
            return heard
        for listener in self._listeners:
            reason = listener.refuses(heard.phrase.began_ns, heard.phrase.ended_ns)
            if reason:
                judgement = PhraseJudgement(verdict=PhraseVerdict.REJECTED, reason=reason)
                return replace(heard, judgement=judgement)
        return heard

    def _playing(self) -> Playing | None:
        return None if self._voice is None else self._voice.playing

    def _publish_status(self) -> None:
        now_ns = self._clock.now_ns()
        if now_ns >= self._status_due_ns:
            self._status_due_ns = now_ns + STATUS_PERIOD_NS
            self._status.put_document(self._document())

    def _document(self) -> SpeechStatus:
        asr, why = self._asr, self._why_deaf()
        recogniser = None if asr is None else asr.queue.recogniser
        document: SpeechStatus = {
            "state": "deaf" if why or asr is None else asr.state,
            "why": why,
            "speaking": self._playing() is not None,
            "model": {} if recogniser is None else {"name": recogniser.model.manifest.name},
            "heard": self._publisher.document(),
            "voice": {} if self._voice is None else self._voice.document(),
        }
        if self._stop_words is not None:
            document["stop_words"] = self._stop_words.document()
        if self._page_stop_words is not None:
            document["page_stop_words"] = self._page_stop_words.document()
        return document

    def _why_deaf(self) -> str:
        """Return why spoken commands are not understood; empty while they are."""
        if self._deaf or self._microphone is None:
            return self._deaf
        if self._microphone.away or self._asr is None:
            return self._microphone.away
        queue = self._asr.queue
        return "" if queue.recogniser is not None else f"no model: {queue.selected.why}"
