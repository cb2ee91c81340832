"""Publish what was heard for the other processes: commands, stops, refusals, a question back."""

import os
from collections import Counter
from itertools import count
from typing import Final, Unpack

from drivers.clock import NS_PER_S, Clock
from drivers.latency import LatencyHistogram
from vla_deploy.ipc import Announcer, SharedSpace, topics
from vla_deploy.ipc.payloads.speech import PhraseCounts
from vla_deploy.ipc.payloads.tasks import HeardDoubt, HeardEvidence, UtteranceContent
from vla_deploy.ipc.stop_button import StopButton
from vla_deploy.speech.asr_pipeline import HeardPhrase
from vla_deploy.speech.verdict import PhraseVerdict

SOURCE: Final = "voice"
ASK_AGAIN: Final = "Sorry, I did not understand that. Please say it again."
FIRST_PAUSE_NS: Final = 10 * NS_PER_S
LONGEST_PAUSE_NS: Final = 160 * NS_PER_S
_LONGEST_TEXT: Final = 1000
_LONGEST_OTHER: Final = 200
"""What is longer is no command that may have been misheard."""


class SpeechEvents:
    """Hold the ways out.

    The robot asks again each time twice as seldom, until something is understood: people who talk
    near it, and not to it, are left alone.
    """

    def __init__(self, space: SharedSpace, clock: Clock) -> None:
        """Open the topics."""
        self._counts: Counter[str] = Counter()
        self._latency = LatencyHistogram()
        self._clock = clock
        self._heard = space.ring_writer(topics.HEARD)
        self._utterances = space.ring_writer(topics.UTTERANCE)
        self._voice = Announcer(space, "speech", clock)
        self._stop = StopButton(space, SOURCE, clock)
        self._pause_ns, self._ask_from_ns = FIRST_PAUSE_NS, 0
        self._numbers = count(1)

    def publish(self, heard: HeardPhrase) -> None:
        """Publish what becomes of a phrase; a stop goes first."""
        now_ns, judgement = self._clock.now_ns(), heard.judgement
        verdict = judgement.verdict
        if verdict is PhraseVerdict.STOP:
            self._stop.press(f'heard "{heard.text}"')
        self._counts[verdict] += 1
        if verdict is PhraseVerdict.ACCEPTED:
            self._pause_ns, self._ask_from_ns = FIRST_PAUSE_NS, 0
            self._command(heard)
        elif verdict is PhraseVerdict.DOUBTED:
            self._command(heard, doubted=True, ask_again=self._may_ask(now_ns))
        elif judgement.ask_again and self._may_ask(now_ns):
            self._voice.say(ASK_AGAIN)
        sure = evidence(heard)
        self._heard.publish(
            {
                "text": heard.text[:_LONGEST_TEXT],
                "verdict": verdict.value,
                "reason": judgement.reason,
                "began_ns": heard.phrase.began_ns,
                "ended_ns": heard.phrase.ended_ns,
                "told_ns": now_ns,
                "confidence": sure["confidence"],
                "others": sure["others"],
            }
        )
        self._latency.record(now_ns - heard.phrase.ended_ns)

    def document(self) -> PhraseCounts:
        """Return counts and the time from the end of speech to its words, for `speech_status`."""
        return {
            "accepted": self._counts[PhraseVerdict.ACCEPTED],
            "doubted": self._counts[PhraseVerdict.DOUBTED],
            "rejected": self._counts[PhraseVerdict.REJECTED],
            "stop": self._counts[PhraseVerdict.STOP],
            "end_to_text_p50_s": self._latency.percentile_ns(0.5) / NS_PER_S,
            "end_to_text_p95_s": self._latency.percentile_ns(0.95) / NS_PER_S,
        }

    def _command(self, heard: HeardPhrase, **doubt: Unpack[HeardDoubt]) -> None:
        command_id = f"{SOURCE}-{os.getpid()}-{next(self._numbers)}"
        self._utterances.publish(
            {"command_id": command_id, "source": SOURCE, **utterance(heard, **doubt)}
        )

    def _may_ask(self, now_ns: int) -> bool:
        """Return whether the robot may ask again now; it then counts as having asked."""
        if now_ns < self._ask_from_ns:
            return False
        self._ask_from_ns = now_ns + self._pause_ns
        self._pause_ns = min(2 * self._pause_ns, LONGEST_PAUSE_NS)
        return True


def utterance(heard: HeardPhrase, **doubt: Unpack[HeardDoubt]) -> UtteranceContent:
    """Return what the planner gets of a phrase; of a doubted one, if it may ask for it again."""
    return {"text": heard.text[:_LONGEST_TEXT], "heard": {**evidence(heard), **doubt}}


def evidence(heard: HeardPhrase) -> HeardEvidence:
    """Return how sure the words of a phrase are, and what may have been said instead."""
    others = () if heard.transcript is None else heard.transcript.others
    return {
        "confidence": round(heard.confidence, 4),
        "others": [
            {"text": text, "odds": odds} for text, odds in others if len(text) <= _LONGEST_OTHER
        ],
    }
