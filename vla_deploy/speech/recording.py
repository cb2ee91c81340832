"""Hear without a process around it: a recording, or a microphone of the command line."""

from typing import Final

from drivers.clock import Clock
from platforms import Profile
from vla_deploy.aside import AtOnce
from vla_deploy.speech.asr_pipeline import AsrPipeline
from vla_deploy.speech.model_selection import SelectedRecogniser
from vla_deploy.speech.sound import count_of
from vla_deploy.speech.transcription_queue import TranscriptionQueue
from vla_deploy.speech.voice_activity import open_voice_activity

BLOCK: Final = count_of(0.02)


class StreamClock:
    """Be as late as the sound that has been heard."""

    def __init__(self) -> None:
        self.ns = 0

    def now_ns(self) -> int:
        """Return the end of what was heard."""
        return self.ns

    def sleep_until(self, deadline_ns: int) -> None:
        """Jump to the deadline."""
        self.ns = max(self.ns, deadline_ns)


def open_hearing(selected: SelectedRecogniser, profile: Profile, clock: Clock) -> AsrPipeline:
    """Return hearing that reads each phrase at once, as no process' steps wait for it.

    Raises:
        SpeechMissing: faster-whisper is not installed.
        InferenceError: its voice network cannot be opened.
    """
    queue = TranscriptionQueue(AtOnce(), clock)
    queue.selected = selected
    return AsrPipeline(open_voice_activity(), queue, profile.speech)
