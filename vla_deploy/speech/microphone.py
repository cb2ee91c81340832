"""Keep one microphone open, whichever kind it is, and give what it hears as one 16 kHz stream."""

from collections.abc import Callable
from typing import Any, Final

from drivers.audio.base import AudioBlock, AudioInput
from drivers.clock import NS_PER_S, Clock
from drivers.reopening import Reopening
from vla_deploy.speech.resampling import Resampler
from vla_deploy.speech.sound import SoundBlock

OpenInput = Callable[[], AudioInput]
SILENT_NS: Final = 2 * NS_PER_S
"""A device that is there and gives nothing for so long is said to be silent."""
_GAP_NS: Final = NS_PER_S // 20


class Microphone:
    """Hold a microphone that may come and go."""

    def __init__(self, name: str, open_input: OpenInput, clock: Clock) -> None:
        self._clock = clock
        self._open_input = open_input
        self._device: Reopening[AudioInput] = Reopening(name, self._connect, clock)
        self._input: AudioInput | None = None
        self._resampler: Resampler | None = None
        self._end_ns: int | None = None
        self._heard_ns = clock.now_ns()

    @property
    def away(self) -> str:
        """Return why nothing is heard; empty while the device gives sound."""
        if self._device.failure or self._input is None:
            return self._device.failure or "the microphone is not open yet"
        silent_ns = self._clock.now_ns() - self._heard_ns
        if silent_ns < SILENT_NS:
            return ""
        return f"the microphone is there but has given nothing for {silent_ns // NS_PER_S} s"

    def poll(self) -> SoundBlock | None:
        """Return what was heard since the last call, or None; opens the device where it is away.

        Raises:
            SpeechMissing: its rate needs a package that is not installed.
        """
        block = self._device.poll(lambda device: device.poll(), None)
        return None if block is None else self._sound(block)

    def document(self) -> dict[str, Any]:
        """Return what the device is and what was lost, as `speech_status` tells it."""
        device = self._input
        told: dict[str, Any] = {"away": self.away, "opened": self._device.reconnects}
        if device is not None:
            counters = device.counters
            told |= {"format": str(device.format), "lost_samples": counters.lost_samples}
        return told

    def close(self) -> None:
        """Release the device; closing twice is allowed."""
        self._device.close()

    def _connect(self) -> AudioInput:
        self._input = self._open_input()
        self._resampler = Resampler(self._input.format)
        self._end_ns = None
        self._heard_ns = self._clock.now_ns()
        return self._input

    def _sound(self, block: AudioBlock) -> SoundBlock:
        assert self._resampler is not None, "a block comes from a device that was connected"
        self._heard_ns = self._clock.now_ns()
        follows = self._end_ns is not None and abs(block.stamp_ns - self._end_ns) < _GAP_NS
        if not follows:
            self._resampler.reset()
        samples = self._resampler.feed(block.samples)
        self._end_ns = block.stamp_ns + block.format.duration_ns(len(block.samples))
        return SoundBlock(stamp_ns=block.stamp_ns, samples=samples, follows=follows)
