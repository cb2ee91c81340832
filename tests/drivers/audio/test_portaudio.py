"""Errors of the sound system say what to do."""

from typing import Any

import numpy as np
import pytest

from drivers.audio.base import AudioFormat
from drivers.audio.open_audio import open_audio_input, open_audio_output
from drivers.audio.portaudio import PortAudioInput, PortAudioOutput, sound_devices
from drivers.clock import NS_PER_S
from drivers.errors import DeviceMissing, LinkLost
from sim_twin.contracts.scripted import ManualClock

SPEECH = AudioFormat(rate_hz=16_000)
sounddevice = pytest.importorskip("sounddevice", reason="the extra [audio] is not installed")


def test_the_devices_are_listed() -> None:
    for device in sound_devices():
        assert device.name
        assert device.inputs + device.outputs > 0


def test_an_unknown_device_is_refused_with_the_known_ones() -> None:
    clock = ManualClock(NS_PER_S)
    with pytest.raises(DeviceMissing, match=r"'no such mic'.*devices with inputs"):
        open_audio_input("no such mic", clock, SPEECH)
    with pytest.raises(DeviceMissing, match=r"'no such horn'.*devices with outputs"):
        open_audio_output("no such horn", clock, SPEECH)


@pytest.mark.parametrize(
    ("error", "remedy"),
    [
        (ImportError("sounddevice"), r"vla-deploy\[audio\]"),
        (OSError("PortAudio library not found"), "apt install libportaudio2"),
    ],
)
def test_a_missing_library_is_refused_with_what_to_install(
    monkeypatch: pytest.MonkeyPatch, error: Exception, remedy: str
) -> None:
    def missing(name: str) -> Any:
        raise error

    monkeypatch.setattr("drivers.audio.portaudio.import_module", missing)
    with pytest.raises(DeviceMissing, match=remedy):
        sound_devices()


class Stream:
    """Stand in for PortAudio's stream, which loses its device when the test says so."""

    def __init__(self, **_: Any) -> None:
        self.latency = 0.01
        self.rows = 160
        self.overflowed = False
        self.gone = False
        self.closed = False
        self.time = 1.0

    def start(self) -> None:
        pass

    def close(self) -> None:
        self.closed = True

    @property
    def read_available(self) -> int:
        if self.gone:
            raise sounddevice.PortAudioError("Device unavailable", -9985)
        return self.rows

    write_available = read_available

    def read(self, count: int) -> tuple[Any, bool]:
        return np.zeros((count, 1), np.int16), self.overflowed

    def write(self, samples: Any) -> bool:
        assert len(samples) <= self.rows
        return False


@pytest.fixture
def streams(monkeypatch: pytest.MonkeyPatch) -> list[Stream]:
    made: list[Stream] = []

    def make(**words: Any) -> Stream:
        made.append(Stream(**words))
        return made[-1]

    monkeypatch.setattr(sounddevice, "InputStream", make)
    monkeypatch.setattr(sounddevice, "OutputStream", make)
    return made


def test_stamps_are_of_the_first_sample_and_follow_the_rows(streams: list[Stream]) -> None:
    clock = ManualClock(NS_PER_S)
    microphone = PortAudioInput("mic", clock, SPEECH)
    stamps = []
    for late_ms in (0, 3, 1, 7):
        clock.ns += 10_000_000
        arrived_ns, clock.ns = clock.ns, clock.ns + late_ms * 1_000_000
        block = microphone.poll()
        assert block is not None
        stamps.append(block.stamp_ns)
        clock.ns = arrived_ns
    # 10 ms of samples and 10 ms of latency lie before the arrival.
    assert stamps == [NS_PER_S + 10_000_000 * i - 10_000_000 for i in range(4)]


def test_an_overflow_is_counted(streams: list[Stream]) -> None:
    microphone = PortAudioInput("mic", ManualClock(NS_PER_S), SPEECH)
    streams[0].overflowed = True
    microphone.poll()
    assert microphone.counters.lost_samples == 1


def test_nothing_to_read_is_nothing(streams: list[Stream]) -> None:
    microphone = PortAudioInput("mic", ManualClock(NS_PER_S), SPEECH)
    streams[0].rows = 0
    assert microphone.poll() is None


def test_an_unplugged_device_is_a_lost_link(streams: list[Stream]) -> None:
    microphone = PortAudioInput("mic", ManualClock(NS_PER_S), SPEECH)
    speaker = PortAudioOutput("horn", SPEECH)
    for stream in streams:
        stream.gone = True
    with pytest.raises(LinkLost, match="plug it in again"):
        microphone.poll()
    with pytest.raises(LinkLost, match="plug it in again"):
        speaker.write(np.zeros((10, 1), np.int16))


def test_a_speaker_takes_what_it_has_room_for(streams: list[Stream]) -> None:
    speaker = PortAudioOutput("horn", SPEECH)
    assert speaker.write(np.zeros((400, 1), np.int16)) == 160
    streams[0].rows = 0
    assert speaker.write(np.zeros((400, 1), np.int16)) == 0
    assert speaker.counters.samples == 160
