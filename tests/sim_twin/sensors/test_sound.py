"""The twin's room: the microphone receives what is played, the speaker's sound is kept."""

import numpy as np
import pytest

from drivers.audio.base import AudioFormat, Samples
from drivers.audio.pcm_protocol import PcmParser
from drivers.audio.pcm_stream import PcmInput, PcmOutput
from sim_twin.errors import TwinModelMismatch
from sim_twin.harness.lockstep import Lockstep
from sim_twin.sensors.sound import MicrophoneDevice

SPEECH = AudioFormat(rate_hz=16_000)


def beep(rows: int = 1_600) -> Samples:
    return np.full((rows, 1), 10_000, np.int16)


def heard(device: MicrophoneDevice, *times_ns: int) -> Samples:
    parser = PcmParser()
    blocks = []
    for now_ns in times_ns:
        device.step(now_ns)
        blocks += parser.feed(device.transmit())
    return np.concatenate([block.samples for block in blocks])


def test_sound_lies_where_it_was_played_over_a_little_noise() -> None:
    device = MicrophoneDevice(SPEECH, seed=1)
    device.step(100_000_000)
    device.play(beep())
    sound = heard(device, 150_000_000, 400_000_000)[:, 0]
    loud = np.flatnonzero(sound > 5_000)
    assert (loud[0], loud[-1]) == (1_600, 3_199)
    assert 5.0 < np.std(sound[:1_600]) < 20.0


def test_two_sounds_follow_each_other() -> None:
    device = MicrophoneDevice(SPEECH)
    device.play(beep())
    device.play(beep())
    sound = heard(device, 500_000_000)[:, 0]
    assert np.count_nonzero(sound > 5_000) == 3_200
    assert sound.max() < 11_000


def test_the_same_seed_is_the_same_room_however_it_is_read() -> None:
    once = heard(MicrophoneDevice(SPEECH, seed=3), 300_000_000)
    often = heard(MicrophoneDevice(SPEECH, seed=3), 100_000_000, 110_000_000, 300_000_000)
    other = heard(MicrophoneDevice(SPEECH, seed=4), 300_000_000)
    assert np.array_equal(once, often)
    assert not np.array_equal(once, other)


def test_a_late_host_receives_the_last_second() -> None:
    device = MicrophoneDevice(SPEECH)
    assert len(heard(device, 10_000_000_000)) == 16_000


def test_the_microphone_receives_the_room_and_the_test_receives_the_speaker(
    lockstep: Lockstep,
) -> None:
    twin, devices, clock = lockstep.twin, lockstep.devices, lockstep.clock
    ear = PcmInput(devices.stream("microphone"), clock, twin.microphone.format)
    mouth = PcmOutput(devices.stream("speaker"), clock, twin.speaker.format)
    lockstep.run_for(0.1)
    twin.microphone.play(beep())
    words = np.arange(2_000, dtype=np.int16)[:, None]
    assert mouth.write(words) == 2_000
    lockstep.run_for(0.3)
    block = ear.poll()
    assert block is not None
    assert np.count_nonzero(block.samples > 5_000) == 1_600
    assert np.array_equal(twin.speaker.said(), words)
    assert len(twin.speaker.said()) == 0


def test_a_robot_without_a_device_has_none_in_the_twin(lockstep: Lockstep) -> None:
    lockstep.twin.streamed_devices.clear()
    with pytest.raises(TwinModelMismatch, match="needs a microphone in the robot file"):
        _ = lockstep.twin.microphone
