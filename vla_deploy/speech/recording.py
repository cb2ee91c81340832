"""Hear without a process around it: a recording, or a microphone of the command line."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from drivers.audio.wav import read_wav
from drivers.clock import Clock
from platforms import Profile
from vla_deploy.runtime.executors import InlineExecutor
from vla_deploy.speech.asr_pipeline import AsrPipeline
from vla_deploy.speech.microphone import Resampler
from vla_deploy.speech.model_selection import SelectedRecogniser
from vla_deploy.speech.sound import FRAME, Sound, SoundBlock, duration_ns
from vla_deploy.speech.transcription_queue import TranscriptionQueue
from vla_deploy.speech.voice_activity import open_voice_activity


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


def frames_of(sound: Sound, before: int = 0) -> Iterator[SoundBlock]:
    """Cut a recording, with silence behind it; `before` samples of other sound came before it."""
    padded = np.pad(sound, (0, -len(sound) % FRAME))
    for at in range(0, len(padded), FRAME):
        stamp_ns = duration_ns(before + at)
        yield SoundBlock(stamp_ns=stamp_ns, samples=padded[at : at + FRAME], follows=at > 0)


def open_hearing(selected: SelectedRecogniser, profile: Profile, clock: Clock) -> AsrPipeline:
    """Return hearing that reads each phrase at once, as no process' steps wait for it.

    Raises:
        SpeechMissing: faster-whisper is not installed.
        InferenceError: its voice network cannot be opened.
    """
    queue = TranscriptionQueue(InlineExecutor(), clock)
    queue.selected = selected
    return AsrPipeline(open_voice_activity(), queue, profile.speech)


def sound_of(path: Path) -> Sound:
    """Return a WAV file as one channel at 16 kHz.

    Raises:
        DriverError: it is missing, or no WAV file of 16-bit samples.
        SpeechMissing: it has another rate, and PyAV is not installed.
    """
    format_, samples = read_wav(path)
    return Resampler(format_).feed(samples)
