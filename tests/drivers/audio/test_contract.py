"""Every microphone and speaker keeps its contract: stream, WAV file, and the real PortAudio.

PortAudio runs on ALSA's null device, in a process of its own: the configuration is read once.
"""

import os
import struct
import subprocess
import sys
import wave
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from drivers.audio.base import AudioFormat, AudioInput, AudioOutput, Samples
from drivers.audio.pcm_stream import PcmInput, PcmOutput
from drivers.audio.wav import WavInput, WavOutput, read_wav
from drivers.base import ByteTransport
from drivers.clock import NS_PER_S, Clock
from drivers.errors import DeviceMissing, LinkLost, WrongDevice
from sim_twin.contracts.audio import (
    HeardSpeakerContract,
    MicrophoneContract,
    MicrophoneUnplugContract,
    MicrophoneWireFaultContract,
    SpeakerContract,
)
from sim_twin.contracts.bench import ServedBench, WireBench, socket_bench
from sim_twin.contracts.scripted import ManualClock
from sim_twin.sensors.sound import MicrophoneDevice, SpeakerDevice

SPEECH = AudioFormat(rate_hz=16_000)
STEREO = AudioFormat(rate_hz=8_000, channels=2)


def listen(line: ByteTransport, clock: Clock) -> AudioInput:
    return PcmInput(line, clock, SPEECH)


def speak(line: ByteTransport, clock: Clock) -> AudioOutput:
    return PcmOutput(line, clock, STEREO)


class TestMicrophoneOnAWire(
    MicrophoneContract, MicrophoneUnplugContract, MicrophoneWireFaultContract
):
    @pytest.fixture
    def bench(self) -> WireBench[AudioInput]:
        device = MicrophoneDevice(SPEECH, seed=1)
        return WireBench(device, listen, device.announce)


class TestMicrophoneBehindASocket(MicrophoneContract, MicrophoneUnplugContract):
    patience_s = 0.3

    @pytest.fixture
    def bench(self, tmp_path: Path) -> Iterator[ServedBench[AudioInput]]:
        device = MicrophoneDevice(SPEECH, seed=1)
        bench = socket_bench(device, listen, tmp_path / "microphone", device.announce)
        yield bench
        bench.close()


class HeardWire(WireBench[AudioOutput]):
    def __init__(self) -> None:
        device = SpeakerDevice(STEREO)
        super().__init__(device, speak, device.announce)
        self.heard = device.said


class TestSpeakerOnAWire(SpeakerContract, HeardSpeakerContract):
    @pytest.fixture
    def bench(self) -> HeardWire:
        return HeardWire()


def tone(format_: AudioFormat, seconds: float) -> Samples:
    rows = np.arange(round(seconds * format_.rate_hz))
    wave_ = 8_000.0 * np.sin(2.0 * np.pi * 440.0 * rows / format_.rate_hz)
    return np.repeat(wave_.astype(np.int16)[:, None], format_.channels, axis=1)


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    path = tmp_path / "tone.wav"
    output = WavOutput(path, STEREO)
    output.write(tone(STEREO, 3.0))
    output.close()
    return path


class TimedBench:
    """Hold something that needs a clock and no wire."""

    def __init__(self) -> None:
        self.clock = ManualClock(NS_PER_S)

    def let(self, seconds: float) -> None:
        self.clock.ns += round(seconds * NS_PER_S)


class WavBench(TimedBench):
    def __init__(self, path: Path) -> None:
        super().__init__()
        self.path = path

    def open(self) -> AudioInput:
        return WavInput(self.path, self.clock)


class TestWavMicrophone(MicrophoneContract):
    @pytest.fixture
    def bench(self, recording: Path) -> WavBench:
        return WavBench(recording)


class WavSpeakerBench(TimedBench):
    def __init__(self, path: Path) -> None:
        super().__init__()
        self.path = path

    def open(self) -> AudioOutput:
        return WavOutput(self.path, STEREO)


class TestWavSpeaker(SpeakerContract):
    @pytest.fixture
    def bench(self, tmp_path: Path) -> WavSpeakerBench:
        return WavSpeakerBench(tmp_path / "said.wav")


def test_what_is_recorded_can_be_read_back(recording: Path) -> None:
    format_, samples = read_wav(recording)
    assert format_ == STEREO
    assert np.array_equal(samples, tone(STEREO, 3.0))


def test_the_end_of_a_file_is_a_lost_link(recording: Path) -> None:
    clock = ManualClock(NS_PER_S)
    microphone = WavInput(recording, clock)
    microphone.poll()
    clock.ns += 4 * NS_PER_S
    block = microphone.poll()
    assert block is not None
    assert len(block.samples) == 3 * STEREO.rate_hz
    with pytest.raises(LinkLost, match="has ended"):
        microphone.poll()


def test_a_missing_or_foreign_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DeviceMissing, match="no such file"):
        read_wav(tmp_path / "none.wav")
    (tmp_path / "note.wav").write_text("la la la")
    with pytest.raises(WrongDevice, match="no WAV file"):
        read_wav(tmp_path / "note.wav")
    with wave.open(str(tmp_path / "deep.wav"), "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(3)
        file.setframerate(16_000)
    with pytest.raises(WrongDevice, match="24-bit got"):
        read_wav(tmp_path / "deep.wav")


# PortAudio aborts where there is no default device.
ALSA = "".join(
    f"{name} {{ type null }}\n" for name in ("pcm.bench", "pcm.!default", "ctl.!default")
)
PORTAUDIO = """
import numpy as np, pytest
from drivers.audio.base import AudioFormat
from drivers.audio.portaudio import PortAudioInput, PortAudioOutput
from sim_twin.contracts.audio import MicrophoneChecks, SpeakerContract
from sim_twin.contracts.bench import HardwareBench
from sim_twin.contracts.sensors import SensorContract

SPEECH = AudioFormat(rate_hz=16_000)

class TestMicrophone(MicrophoneChecks):
    # The null device keeps no time: what the contract says of rate and news does not hold.
    patience_s = 0.3
    test_sound_values_arrive = SensorContract.test_sound_values_arrive
    test_stamps = SensorContract.test_stamps_grow_and_never_lie_in_the_future
    test_counters = SensorContract.test_counters_tell_that_something_came
    test_reopening = SensorContract.test_it_can_be_closed_twice_and_opened_again
    @pytest.fixture
    def bench(self):
        return HardwareBench(lambda clock: PortAudioInput("bench", clock, SPEECH))

class TestSpeaker(SpeakerContract):
    @pytest.fixture
    def bench(self):
        return HardwareBench(lambda clock: PortAudioOutput("bench", SPEECH))
"""


def test_portaudio_on_alsas_null_device_keeps_the_contracts(tmp_path: Path) -> None:
    pytest.importorskip("sounddevice", reason="the extra [audio] is not installed")
    (tmp_path / "asound.conf").write_text(ALSA)
    (tmp_path / "test_portaudio.py").write_text(PORTAUDIO)
    words = ["-m", "pytest", "-q", "-p", "no:cacheprovider", "-c", "/dev/null", "--rootdir"]
    ran = subprocess.run(
        [sys.executable, *words, str(tmp_path), str(tmp_path / "test_portaudio.py")],
        env={
            **os.environ,
            "ALSA_CONFIG_PATH": str(tmp_path / "asound.conf"),
            "PYTHONPATH": str(Path(__file__).parents[3]),
        },
        capture_output=True,
        text=True,
        check=False,
    )
    assert ran.returncode == 0, ran.stdout + ran.stderr
    assert "7 passed" in ran.stdout


def wav_of(path: Path, claimed_bytes: int, sound: bytes) -> Path:
    head = struct.pack("<4sI4s4sIHHIIHH", b"RIFF", min(36 + claimed_bytes, 0xFFFF_FFFF), b"WAVE",
                       b"fmt ", 16, 1, 1, 16_000, 32_000, 2, 16)  # fmt: skip
    path.write_bytes(head + struct.pack("<4sI", b"data", claimed_bytes) + sound)
    return path


@pytest.mark.parametrize("left", [0, 1, 999])
def test_a_recording_that_is_cut_off_is_not_taken_for_a_whole_one(
    tmp_path: Path, left: int
) -> None:
    path = wav_of(tmp_path / "cut.wav", 1000, bytes(left))
    with pytest.raises(WrongDevice, match=f"cut off: 1000 bytes of sound expected, {left} got"):
        read_wav(path)


@pytest.mark.parametrize("claimed_bytes", [0x7FFF_FFFE, 0xFFFF_FFFE])
def test_what_was_written_into_a_pipe_is_taken_as_far_as_it_goes(
    tmp_path: Path, claimed_bytes: int
) -> None:
    _, samples = read_wav(wav_of(tmp_path / "pipe.wav", claimed_bytes, b"\1\0\2\0\3"))
    assert samples.tolist() == [[1], [2]]
