"""Publish what was heard for the other processes: commands, stops, refusals, a question back."""

import os
from collections import Counter
from dataclasses import asdict
from itertools import count
from typing import Any, Final

from drivers.clock import NS_PER_S, Clock
from drivers.latency import LatencyHistogram
from vla_deploy.ipc import SharedSpace
from vla_deploy.ipc.stop_button import StopButton
from vla_deploy.speech.asr_pipeline import HeardPhrase
from vla_deploy.speech.verdict import Verdict

SOURCE: Final = "voice"
ASK_AGAIN: Final = "Sorry, I did not understand that. Please say it again."
FIRST_PAUSE_NS: Final = 10 * NS_PER_S
LONGEST_PAUSE_NS: Final = 160 * NS_PER_S
_LONGEST_TEXT: Final = 1000
_LONGEST_OTHER: Final = 200
"""What is longer is no command that may have been misheard."""


class SpeechEvents:
    """Hold the ways out.

    The robot asks again each time twice as seldom, until something is understood: whoever talks
    near it, and not to it, is left alone.
    """

    def __init__(self, space: SharedSpace, clock: Clock) -> None:
        """Open the topics."""
        self.counts: Counter[str] = Counter()
        self.latency = LatencyHistogram()
        self._clock = clock
        self._heard = space.ring_writer("heard")
        self._utterances = space.ring_writer("utterance")
        self._say = space.ring_writer("say")
        self._stop = StopButton(space, SOURCE, clock)
        self._pause_ns, self._ask_from_ns = FIRST_PAUSE_NS, 0
        self._numbers = count(1)

    def publish(self, heard: HeardPhrase) -> None:
        """Publish what becomes of a phrase; a stop goes first."""
        now_ns = self._clock.now_ns()
        verdict = heard.judgement.verdict
        if verdict is Verdict.STOP:
            self._stop.press(f'heard "{heard.text}"')
        self.counts[verdict] += 1
        if verdict is Verdict.ACCEPTED:
            self._pause_ns, self._ask_from_ns = FIRST_PAUSE_NS, 0
            self._command(heard)
        elif verdict is Verdict.DOUBTED:
            self._command(heard, doubted=True, ask_again=self._may_ask(now_ns))
        elif heard.judgement.ask_again and self._may_ask(now_ns):
            self._ask_again()
        self._heard.publish(self._document(heard, now_ns))
        self.latency.record(now_ns - heard.phrase.ended_ns)

    def document(self) -> dict[str, Any]:
        """Return counts and the time from the end of speech to its words, for `speech_status`."""
        latency = self.latency
        return {
            **{str(verdict): self.counts[verdict] for verdict in Verdict},
            "asked_again": self.counts["asked_again"],
            "end_to_text_p50_s": latency.percentile_ns(0.5) / NS_PER_S,
            "end_to_text_p95_s": latency.percentile_ns(0.95) / NS_PER_S,
        }

    def _command(self, heard: HeardPhrase, **doubt: bool) -> None:
        self._utterances.publish({"command_id": self._new_id(), **utterance(heard, **doubt)})

    def _may_ask(self, now_ns: int) -> bool:
        """Return whether the robot may ask again now; it then counts as having asked."""
        if now_ns < self._ask_from_ns:
            return False
        self._ask_from_ns = now_ns + self._pause_ns
        self._pause_ns = min(2 * self._pause_ns, LONGEST_PAUSE_NS)
        return True

    def _ask_again(self) -> None:
        self.counts["asked_again"] += 1
        self._say.publish({"say_id": self._new_id(), "text": ASK_AGAIN, "source": "speech"})

    def _new_id(self) -> str:
        return f"{SOURCE}-{os.getpid()}-{next(self._numbers)}"

    def _document(self, heard: HeardPhrase, now_ns: int) -> dict[str, Any]:
        return {
            "text": heard.text[:_LONGEST_TEXT],
            "verdict": str(heard.judgement.verdict),
            "reason": heard.judgement.reason,
            "began_ns": heard.phrase.began_ns,
            "ended_ns": heard.phrase.ended_ns,
            "told_ns": now_ns,
            **evidence(heard),
        }


def utterance(heard: HeardPhrase, **doubt: bool) -> dict[str, Any]:
    """Return what the planner gets of a phrase; of a doubted one, if it may ask for it again."""
    return {
        "text": heard.text[:_LONGEST_TEXT],
        "source": SOURCE,
        "heard": evidence(heard) | doubt,
    }


def evidence(heard: HeardPhrase) -> dict[str, Any]:
    """Return what speaks for the words of a phrase."""
    told: dict[str, Any] = {} if heard.transcript is None else asdict(heard.transcript)
    told.pop("text", None)
    others = [one for one in told.pop("others", ()) if len(one["text"]) <= _LONGEST_OTHER]
    return {
        "confidence": round(heard.confidence, 4),
        "voice": round(heard.phrase.voice, 3),
        "clipped_ratio": round(heard.phrase.clipped_ratio, 4),
        "others": others,
        **{
            key: round(value, 4) if isinstance(value, float) else value
            for key, value in told.items()
        },
    }
