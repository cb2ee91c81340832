"""Be a microphone that plays a WAV file, or a speaker that records one; 16-bit PCM."""

import wave
from pathlib import Path

import numpy as np

from drivers.audio.base import AudioBlock, AudioCounters, AudioFormat, Samples, check_samples
from drivers.clock import NS_PER_S, Clock
from drivers.errors import DeviceMissing, LinkLost, WrongDevice

SAMPLE_BYTES = 2
ENDLESS_BYTES = 0x7FFF_0000
"""What writes into a pipe cannot know the length, and claims at least so much."""


def read_wav(path: Path) -> tuple[AudioFormat, Samples]:
    """Return a file's format and samples.

    Raises:
        DeviceMissing: there is no such file.
        WrongDevice: it is no WAV file of 16-bit samples, or it is cut off.
    """
    try:
        with wave.open(str(path), "rb") as file:
            if file.getsampwidth() != SAMPLE_BYTES:
                bits = 8 * file.getsampwidth()
                raise WrongDevice(f"{path}: 16-bit samples expected, {bits}-bit got; convert it")
            format_ = AudioFormat(rate_hz=file.getframerate(), channels=file.getnchannels())
            claimed_bytes = file.getnframes() * file.getnchannels() * SAMPLE_BYTES
            data = file.readframes(file.getnframes())
    except FileNotFoundError as error:
        raise DeviceMissing(f"{path}: no such file; correct the path") from error
    except (wave.Error, EOFError, ValueError) as error:
        raise WrongDevice(
            f"{path}: no WAV file of 16-bit samples ({str(error) or 'cut off'}); convert it"
        ) from error
    if len(data) < claimed_bytes < ENDLESS_BYTES:
        raise WrongDevice(
            f"{path}: cut off: {claimed_bytes} bytes of sound expected, {len(data)} got; "
            "record or copy it again"
        )
    whole = len(data) // (format_.channels * SAMPLE_BYTES) * format_.channels
    samples = np.frombuffer(data, "<i2", whole).astype(np.int16)
    return format_, samples.reshape(-1, format_.channels)


class WavInput:
    """Give a file's samples as fast as a microphone would, from the first poll on."""

    def __init__(self, path: Path, clock: Clock) -> None:
        """Read the file.

        Raises:
            DeviceMissing: there is no such file.
            WrongDevice: it is no WAV file of 16-bit samples, or it is cut off.
        """
        self.format, self._samples = read_wav(path)
        self.counters = AudioCounters()
        self._path = path
        self._clock = clock
        self._start_ns: int | None = None
        self._given = 0

    def poll(self) -> AudioBlock | None:
        """Return the samples whose time has come, or None; never waits.

        Raises:
            LinkLost: the file has ended.
        """
        now_ns = self._clock.now_ns()
        if self._start_ns is None:
            self._start_ns = now_ns
        if self._given == len(self._samples):
            raise LinkLost(f"{self._path}: the file has ended; open it again")
        due = min((now_ns - self._start_ns) * self.format.rate_hz // NS_PER_S, len(self._samples))
        if due <= self._given:
            return None
        stamp_ns = self._start_ns + self.format.duration_ns(self._given)
        samples, self._given = self._samples[self._given : due], due
        self.counters.blocks += 1
        self.counters.samples += len(samples)
        return AudioBlock(stamp_ns=stamp_ns, format=self.format, samples=samples)

    def close(self) -> None:
        """Forget the file; closing twice is allowed."""
        self._samples = self._samples[:0]
        self._given = 0


class WavOutput:
    """Record everything that is written; the file is whole once it is closed."""

    def __init__(self, path: Path, format_: AudioFormat) -> None:
        """Create the file.

        Raises:
            DeviceMissing: it cannot be created.
        """
        self.format = format_
        self.counters = AudioCounters()
        try:
            self._file = wave.open(str(path), "wb")  # noqa: SIM115 (closed by `close`)
        except OSError as error:
            raise DeviceMissing(f"{path}: {error.strerror}; choose another path") from error
        self._file.setnchannels(format_.channels)
        self._file.setsampwidth(SAMPLE_BYTES)
        self._file.setframerate(format_.rate_hz)

    def write(self, samples: Samples) -> int:
        """Record all of it.

        Raises:
            ValueError: the samples do not have the format's channels.
        """
        check_samples(samples, self.format)
        self._file.writeframes(np.ascontiguousarray(samples, "<i2").tobytes())
        self.counters.blocks += 1
        self.counters.samples += len(samples)
        return len(samples)

    def close(self) -> None:
        """Finish the file; closing twice is allowed."""
        self._file.close()
