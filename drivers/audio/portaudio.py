"""Drive a microphone or speaker of the computer's sound system, by PortAudio (`[audio]` extra)."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from types import ModuleType
from typing import Any, Final
from weakref import WeakSet

import numpy as np

from drivers.audio.base import AudioBlock, AudioCounters, AudioFormat, Samples, check_samples
from drivers.clock import NS_PER_S, Clock
from drivers.device_clock import DeviceClock
from drivers.errors import DeviceMissing, LinkLost

IDLE_S: Final = 1.0
_DEVICES: "Final[WeakSet[PortAudioInput | PortAudioOutput]]" = WeakSet()


@dataclass(frozen=True, slots=True, kw_only=True)
class SoundDevice:
    """Describe one device of the sound system."""

    name: str
    inputs: int
    outputs: int
    rate_hz: float


def sound_devices() -> tuple[SoundDevice, ...]:
    """Return what the sound system has.

    Raises:
        DeviceMissing: sounddevice or PortAudio is not installed.
    """
    return tuple(
        SoundDevice(
            name=row["name"],
            inputs=row["max_input_channels"],
            outputs=row["max_output_channels"],
            rate_hz=row["default_samplerate"],
        )
        for row in _library().query_devices()
    )


class PortAudioInput:
    """Read what a microphone has taken, stamped by its latency."""

    def __init__(self, name: str, clock: Clock, format_: AudioFormat) -> None:
        """Open and start the device that `name` is a part of.

        Raises:
            DeviceMissing: there is no such device, it cannot have this format, or the library is
                not installed.
        """
        self.format = format_
        self.counters = AudioCounters()
        self._name = name
        self._clock = clock
        self._stream = _open(name, format_, "InputStream", "inputs")
        self._rows = 0
        self._row_clock = DeviceClock()
        self._last_stamp_ns = 0
        _DEVICES.add(self)

    @property
    def may_pause(self) -> bool:
        """Return whether the device may be opened anew now: never one that listens."""
        return bool(self._stream.closed)

    def poll(self) -> AudioBlock | None:
        """Return the samples since the last call as one block, or None; never waits.

        Raises:
            LinkLost: the device has gone.
        """
        with _loss_told(self._name):
            available = self._stream.read_available
            if available <= 0:
                return None
            samples, overflowed = self._stream.read(available)
            latency_ns = round(self._stream.latency * NS_PER_S)
        if overflowed:
            # PortAudio tells that samples were lost, not how many: their count is no clock now.
            self.counters.lost_samples += 1
            self._row_clock = DeviceClock()
        self.counters.blocks += 1
        self.counters.samples += len(samples)
        return AudioBlock(
            stamp_ns=self._stamp(len(samples), latency_ns),
            format=self.format,
            samples=np.asarray(samples, np.int16),
        )

    def close(self) -> None:
        """Release the device; closing twice is allowed."""
        if not self._stream.closed:
            self._stream.close()

    def _stamp(self, count: int, latency_ns: int) -> int:
        """Return when the first of `count` rows was taken: the rows themselves are the clock."""
        self._rows += count
        ends_ns = self._row_clock.to_host_ns(
            self.format.duration_ns(self._rows), self._clock.now_ns()
        )
        stamp_ns = ends_ns - latency_ns - self.format.duration_ns(count)
        self._last_stamp_ns = max(stamp_ns, self._last_stamp_ns + 1)
        return self._last_stamp_ns


class PortAudioOutput:
    """Hand samples to a speaker as far as it has room."""

    def __init__(self, name: str, format_: AudioFormat) -> None:
        """Open and start the device that `name` is a part of.

        Raises:
            DeviceMissing: there is no such device, it cannot have this format, or the library is
                not installed.
        """
        self.format = format_
        self.counters = AudioCounters()
        self._name = name
        self._stream = _open(name, format_, "OutputStream", "outputs")
        self._silent_at_s = 0.0
        _DEVICES.add(self)

    @property
    def may_pause(self) -> bool:
        """Return whether the device may be opened anew now: nothing sounds."""
        return bool(self._stream.closed or self._stream.time > self._silent_at_s + IDLE_S)

    def write(self, samples: Samples) -> int:
        """Hand over what there is room for and return how many rows that was; never waits.

        Raises:
            ValueError: the samples do not have the format's channels.
            LinkLost: the device has gone.
        """
        check_samples(samples, self.format)
        with _loss_told(self._name):
            taken = samples[: max(0, self._stream.write_available)]
            if len(taken):
                self._stream.write(np.ascontiguousarray(taken))
                starts_s = max(self._stream.time, self._silent_at_s)
                self._silent_at_s = starts_s + len(taken) / self.format.rate_hz
        self.counters.blocks += bool(len(taken))
        self.counters.samples += len(taken)
        return len(taken)

    def close(self) -> None:
        """Release the device; closing twice is allowed."""
        if not self._stream.closed:
            self._stream.close()


def _library() -> ModuleType:
    try:
        return import_module("sounddevice")
    except ImportError as error:
        raise DeviceMissing(
            "sound needs the package sounddevice: pip install 'vla-deploy[audio]'"
        ) from error
    except OSError as error:
        raise DeviceMissing(
            f"sound needs PortAudio ({error}): apt install libportaudio2"
        ) from error


def _open(name: str, format_: AudioFormat, kind: str, way: str) -> Any:
    library = _library()
    try:
        stream = _started(library, name, format_, kind)
    except (ValueError, library.PortAudioError) as error:
        known = [repr(device.name) for device in sound_devices() if getattr(device, way)]
        listed = ", ".join(known) or "there is none: plug one in"
        raise DeviceMissing(
            f"sound device {name!r} with {format_}: {error}; devices with {way}: {listed}"
        ) from error
    return stream


def _started(library: Any, name: str, format_: AudioFormat, kind: str) -> Any:
    """Return a running stream; a device that is not known may have been plugged in since.

    PortAudio lists devices once. Making the list anew closes every stream, so it is done only
    while none listens and nothing sounds; the owner of a silent speaker opens it again.
    """
    try:
        return _start(library, name, format_, kind)
    except (ValueError, library.PortAudioError):
        if not all(device.may_pause for device in _DEVICES):
            raise
        for device in _DEVICES:
            device.close()
        library._terminate()
        library._initialize()
        return _start(library, name, format_, kind)


def _start(library: Any, name: str, format_: AudioFormat, kind: str) -> Any:
    stream = getattr(library, kind)(
        device=name, samplerate=format_.rate_hz, channels=format_.channels, dtype="int16"
    )
    stream.start()
    return stream


@contextmanager
def _loss_told(name: str) -> Iterator[None]:
    library = _library()
    try:
        yield
    except library.PortAudioError as error:
        raise LinkLost(f"sound device {name!r}: {error}; plug it in again") from error
