"""A sound device that is plugged in later is found: PortAudio's list is read again for it."""

import sys
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from drivers.audio.base import AudioFormat
from drivers.audio.portaudio import _DEVICES, PortAudioInput, PortAudioOutput
from drivers.errors import DeviceMissing, LinkLost
from sim_twin.contracts.scripted import ManualClock

SPEECH = AudioFormat(rate_hz=16_000)


@pytest.fixture(autouse=True)
def no_other_devices() -> None:
    """Forget what other tests have left to the garbage collector."""
    _DEVICES.clear()


class SoundSystem(ModuleType):
    """Stand in for sounddevice; the test plugs devices, which it lists when initialised."""

    class PortAudioError(Exception):
        """The library's own."""

    def __init__(self) -> None:
        super().__init__("sounddevice")
        self.plugged = {"USB Audio"}
        self.time_s = 100.0
        self.lists = 0
        self._initialize()
        system = self

        class Stream:
            def __init__(self, device: str, **_: Any) -> None:
                if device not in system.known:
                    raise ValueError(f"No device matching {device!r}")
                self.closed = False
                self.write_available = 16_000

            @property
            def time(self) -> float:
                if self.closed:
                    raise SoundSystem.PortAudioError("bad stream pointer")
                return system.time_s

            def write(self, samples: Any) -> None:
                if self.closed:
                    raise SoundSystem.PortAudioError("bad stream pointer")

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
        return [
            {
                "name": name,
                "max_input_channels": 1,
                "max_output_channels": 1,
                "default_samplerate": 16_000.0,
            }
            for name in sorted(self.known)
        ]


@pytest.fixture
def system(monkeypatch: pytest.MonkeyPatch) -> SoundSystem:
    system = SoundSystem()
    monkeypatch.setitem(sys.modules, "sounddevice", system)
    return system


def microphone() -> PortAudioInput:
    return PortAudioInput("ReSpeaker", ManualClock(), SPEECH)


def test_a_microphone_plugged_in_after_the_list_was_made_is_found(system: SoundSystem) -> None:
    with pytest.raises(DeviceMissing, match=r"devices with inputs: 'USB Audio'"):
        microphone()
    system.plugged.add("ReSpeaker")
    microphone().close()
    assert system.lists == 3, "once at first, once for each time that it was not there"


def test_a_speaker_that_sounds_is_not_cut_off_to_look_for_a_microphone(
    system: SoundSystem,
) -> None:
    speaker = PortAudioOutput("USB Audio", SPEECH)
    speaker.write(np.zeros((16_000, 1), np.int16))
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
        speaker.write(np.zeros((10, 1), np.int16))
    speaker.close()


def test_a_microphone_that_listens_is_not_interrupted_to_look_for_a_speaker(
    system: SoundSystem,
) -> None:
    system.plugged = {"ReSpeaker"}
    system._initialize()
    ears = microphone()
    with pytest.raises(DeviceMissing):
        PortAudioOutput("USB Audio", SPEECH)
    system.plugged.add("USB Audio")
    with pytest.raises(DeviceMissing):
        PortAudioOutput("USB Audio", SPEECH)
    ears.close()
    PortAudioOutput("USB Audio", SPEECH).close()
