"""PortAudio's devices: stamps, overflows, errors that say what to do, and replugging."""

import sys
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from drivers.audio.base import AudioFormat
from drivers.audio.open_audio import open_audio_input, open_audio_output
from drivers.audio.portaudio import _DEVICES, PortAudioInput, PortAudioOutput, sound_devices
from drivers.clock import NS_PER_S
from drivers.errors import DeviceMissing, LinkLost
from sim_twin.contracts.scripted import ManualClock

SPEECH = AudioFormat(rate_hz=16_000)


class SoundSystem(ModuleType):
    """Stand in for sounddevice; the test plugs devices, which it lists when initialised."""

    class PortAudioError(Exception):
        """The library's own."""

    def __init__(self) -> None:
        super().__init__("sounddevice")
        self.plugged = {"USB Audio"}
        self.time_s = 100.0
        self.lists = 0
        self.rows = 160
        self.overflowed = False
        self.failed = False
        self._initialize()
        system = self

        class Stream:
            latency = 0.01

            def __init__(self, device: str, **_: Any) -> None:
                if device not in system.known:
                    raise ValueError(f"No device matching {device!r}")
                self.closed = False

            def check(self) -> None:
                if self.closed or system.failed:
                    raise SoundSystem.PortAudioError("Device unavailable", -9985)

            @property
            def time(self) -> float:
                self.check()
                return system.time_s

            @property
            def read_available(self) -> int:
                self.check()
                return system.rows

            write_available = read_available

            def read(self, count: int) -> tuple[Any, bool]:
                return np.zeros((count, 1), np.int16), system.overflowed

            def write(self, samples: Any) -> None:
                assert len(samples) <= system.rows

            def start(self) -> None:
                """Nothing has to move."""

            def close(self) -> None:
                self.closed = True

        self.InputStream = self.OutputStream = Stream

    def _terminate(self) -> None:
        self.known: set[str] = set()

    def _initialize(self) -> None:
        self.known = set(self.plugged)
        self.lists += 1

    def query_devices(self) -> list[dict[str, Any]]:
        channels = {"max_input_channels": 1, "max_output_channels": 1}
        return [
            {"name": name, "default_samplerate": 16_000.0, **channels}
            for name in sorted(self.known)
        ]


@pytest.fixture(autouse=True)
def system(monkeypatch: pytest.MonkeyPatch) -> SoundSystem:
    _DEVICES.clear()  # what other tests have left to the garbage collector
    system = SoundSystem()
    monkeypatch.setitem(sys.modules, "sounddevice", system)
    return system


def microphone(name: str = "ReSpeaker", clock: ManualClock | None = None) -> PortAudioInput:
    return PortAudioInput(name, clock or ManualClock(NS_PER_S), SPEECH)


def sound(rows: int) -> Any:
    return np.zeros((rows, 1), np.int16)


def test_the_devices_are_listed() -> None:
    (device,) = sound_devices()
    assert (device.name, device.inputs, device.outputs) == ("USB Audio", 1, 1)


def test_an_unknown_device_is_refused_with_the_known_ones() -> None:
    with pytest.raises(DeviceMissing, match=r"'no such mic'.*devices with inputs: 'USB Audio'"):
        open_audio_input("no such mic", ManualClock(), SPEECH)
    with pytest.raises(DeviceMissing, match=r"'no such horn'.*devices with outputs: 'USB Audio'"):
        open_audio_output("no such horn", ManualClock(), SPEECH)


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


def test_stamps_are_of_the_first_sample_and_follow_the_rows() -> None:
    clock = ManualClock(NS_PER_S)
    device = microphone("USB Audio", clock)
    stamps = []
    for late_ms in (0, 3, 1, 7):
        clock.ns += 10_000_000
        arrived_ns, clock.ns = clock.ns, clock.ns + late_ms * 1_000_000
        block = device.poll()
        assert block is not None
        stamps.append(block.stamp_ns)
        clock.ns = arrived_ns
    # 10 ms of samples and 10 ms of latency lie before the arrival.
    assert stamps == [NS_PER_S + 10_000_000 * i - 10_000_000 for i in range(4)]


def test_an_overflow_is_counted_and_nothing_to_read_is_nothing(system: SoundSystem) -> None:
    device = microphone("USB Audio")
    system.overflowed = True
    device.poll()
    assert device.counters.lost_samples == 1
    system.rows = 0
    assert device.poll() is None


def test_an_unplugged_device_is_a_lost_link(system: SoundSystem) -> None:
    device, speaker = microphone("USB Audio"), PortAudioOutput("USB Audio", SPEECH)
    system.failed = True
    with pytest.raises(LinkLost, match="plug it in again"):
        device.poll()
    with pytest.raises(LinkLost, match="plug it in again"):
        speaker.write(sound(10))


def test_a_speaker_takes_what_it_has_room_for(system: SoundSystem) -> None:
    speaker = PortAudioOutput("USB Audio", SPEECH)
    assert speaker.write(sound(400)) == 160
    system.rows = 0
    assert speaker.write(sound(400)) == 0
    assert speaker.counters.samples == 160


def test_a_microphone_plugged_in_after_the_list_was_made_is_found(system: SoundSystem) -> None:
    with pytest.raises(DeviceMissing, match=r"devices with inputs: 'USB Audio'"):
        microphone()
    system.plugged.add("ReSpeaker")
    microphone().close()
    assert system.lists == 3, "once at first, once for each time that it was not there"


def test_a_speaker_that_sounds_is_not_cut_off_to_look_for_a_microphone(
    system: SoundSystem,
) -> None:
    system.rows = 16_000
    speaker = PortAudioOutput("USB Audio", SPEECH)
    speaker.write(sound(16_000))
    system.plugged.add("ReSpeaker")
    with pytest.raises(DeviceMissing):
        microphone()
    assert system.lists == 1
    system.time_s += 1.9
    with pytest.raises(DeviceMissing):
        microphone()
    system.time_s += 0.2
    microphone().close()
    with pytest.raises(LinkLost, match="plug it in again"):
        speaker.write(sound(10))
    speaker.close()


def test_a_microphone_that_listens_is_not_interrupted_to_look_for_a_speaker(
    system: SoundSystem,
) -> None:
    system.plugged = {"ReSpeaker"}
    system._initialize()
    listening = microphone()
    with pytest.raises(DeviceMissing):
        PortAudioOutput("USB Audio", SPEECH)
    system.plugged.add("USB Audio")
    with pytest.raises(DeviceMissing):
        PortAudioOutput("USB Audio", SPEECH)
    listening.close()
    PortAudioOutput("USB Audio", SPEECH).close()
