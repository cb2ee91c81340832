"""Keep one microphone open, whichever kind it is, and give what it hears in frames at 16 kHz."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Final, TypeVar

import numpy as np

from drivers.audio.base import FULL_SCALE, AudioBlock, AudioFormat, AudioInput, Samples
from drivers.clock import NS_PER_S, Clock
from drivers.errors import DriverError
from drivers.opener import DeviceLink
from drivers.reopening import Reopening
from vla_deploy.robots.devices import Audio
from vla_deploy.speech.errors import SpeechMissing, import_extra
from vla_deploy.speech.sound import RATE_HZ, Framer, Sound, SoundBlock

T = TypeVar("T")
OpenInput = Callable[[], AudioInput]
SILENT_NS: Final = 2 * NS_PER_S
"""A device that is there and gives nothing for so long is said to be silent."""
_GAP_NS: Final = NS_PER_S // 20
_MONO: Final = {"format": "flt", "layout": "mono"}


class Resampler:
    """Convert a stream block by block; what the filter still holds comes with the next block.

    Channels are averaged, then FFmpeg's resampler changes the rate: it lets through nothing above
    half of 16 kHz, and adds no delay.
    """

    def __init__(self, format_: AudioFormat) -> None:
        """Prepare for one format.

        Raises:
            SpeechMissing: the rate is another one than 16 kHz, and PyAV is not installed.
        """
        self._rate_hz = format_.rate_hz
        self._av: Any = None
        if format_.rate_hz != RATE_HZ:
            self._av = import_extra("av", "sound of another rate than 16 kHz needs PyAV")
            self._resampler = self._av.AudioResampler(**_MONO, rate=RATE_HZ)

    def feed(self, samples: Samples) -> Sound:
        """Return what a block, (n, channels), makes at 16 kHz; it may be a little or nothing."""
        mono: Sound = samples.mean(axis=1, dtype=np.float32) / np.float32(FULL_SCALE)
        if self._av is None or not len(mono):
            return mono
        frame = self._av.AudioFrame.from_ndarray(mono[None], **_MONO)
        frame.sample_rate = self._rate_hz
        parts = [one.to_ndarray()[0] for one in self._resampler.resample(frame)]
        return np.concatenate(parts, dtype=np.float32) if parts else np.zeros(0, np.float32)


class Microphone:
    """Hold a microphone that may come and go."""

    def __init__(self, open_input: OpenInput, clock: Clock) -> None:
        self._clock = clock
        self._open_input = open_input
        self._device: Reopening[AudioInput] = Reopening("microphone", self._connect, clock)
        self._resampler: Resampler | None = None
        self._framer = Framer()
        self._end_ns: int | None = None
        self._heard_ns = clock.now_ns()

    @property
    def away(self) -> str:
        """Return why nothing is heard; empty while the device gives sound."""
        if self._device.failure or self._resampler is None:
            return self._device.failure or "the microphone is not open yet"
        silent_ns = self._clock.now_ns() - self._heard_ns
        if silent_ns < SILENT_NS:
            return ""
        return f"the microphone is there but has given nothing for {silent_ns // NS_PER_S} s"

    def poll(self) -> list[SoundBlock]:
        """Return the frames that are whole now; opens the device where it is away."""
        block = self._device.poll(lambda device: device.poll(), None)
        return [] if block is None else list(self._framer.feed(self._sound(block)))

    def close(self) -> None:
        """Release the device; closing twice is allowed."""
        self._device.close()

    def _connect(self) -> AudioInput:
        device = self._open_input()
        try:
            self._resampler = Resampler(device.format)
        except SpeechMissing as error:
            device.close()
            raise DriverError(str(error)) from error
        self._end_ns = None
        self._heard_ns = self._clock.now_ns()
        return device

    def _sound(self, block: AudioBlock) -> SoundBlock:
        self._heard_ns = self._clock.now_ns()
        follows = self._end_ns is not None and abs(block.stamp_ns - self._end_ns) < _GAP_NS
        if self._resampler is None or not follows:
            self._resampler = Resampler(block.format)
        samples = self._resampler.feed(block.samples)
        self._end_ns = block.stamp_ns + block.format.duration_ns(len(block.samples))
        return SoundBlock(stamp_ns=block.stamp_ns, samples=samples, follows=follows)


def linked(
    audio: Audio | None,
    opened: Callable[[str, Clock, AudioFormat], T],
    links: Mapping[str, DeviceLink],
    clock: Clock,
) -> Callable[[], T] | None:
    """Return how to open a microphone or a speaker by its link's path; None where there is none."""
    if audio is None:
        return None
    return partial(opened, links[audio.device].path, clock, format_of(audio))


def format_of(audio: Audio) -> AudioFormat:
    """Return the format that a robot file declares."""
    return AudioFormat(rate_hz=audio.rate_hz, channels=audio.channels)
