"""The room joins speaker, microphone and people."""

import numpy as np
import pytest

from drivers.audio.base import AudioFormat
from drivers.audio.clip import Clip
from drivers.audio.pcm_protocol import PcmBlock, PcmParser, encode_block
from drivers.audio.pcm_stream import PcmInput, PcmOutput
from sim_twin.harness.lockstep import Lockstep
from sim_twin.sensors.sound import LATENCY_NS, MicrophoneDevice, SpeakerDevice
from sim_twin.sound.hearing import let_arrive
from sim_twin.sound.room import NOISE_SIGMA, Room
from sim_twin.sound.talker import Talker, arrival, loudness

RATE_HZ = 16_000
FORMAT = AudioFormat(rate_hz=RATE_HZ)


def burst(seconds: float = 0.1) -> np.ndarray:
    return np.full((round(seconds * RATE_HZ), 1), 12_000, np.int16)


def test_what_the_speaker_plays_reaches_the_microphone_late_and_rings_out(
    lockstep: Lockstep,
) -> None:
    ear = PcmInput(lockstep.devices.stream("microphone"), lockstep.clock, FORMAT)
    mouth = PcmOutput(lockstep.devices.stream("speaker"), lockstep.clock, FORMAT)
    assert mouth.write(burst()) == len(burst())
    lockstep.run_for(0.6)
    block = ear.poll()
    assert block is not None
    level = np.abs(block.samples[:, 0].astype(float))
    first = int(np.flatnonzero(level > 20 * NOISE_SIGMA)[0])
    distance_m = lockstep.twin.microphone.room.acoustics.speaker_distance_m
    assert first / RATE_HZ == pytest.approx(LATENCY_NS / 1e9 + distance_m / 343, abs=0.003)
    ends = first + len(burst())
    assert level[first:ends].mean() > 2_000
    ringing, silence = (level[ends + at : ends + at + 800].mean() for at in (100, 5_000))
    assert ringing > 5 * silence
    assert silence < 2 * NOISE_SIGMA


def test_the_delay_from_speaker_to_microphone_is_constant_whatever_delays_the_bytes() -> None:
    ear = MicrophoneDevice(FORMAT)
    mouth = SpeakerDevice(FORMAT, ear.room)
    parser = PcmParser()
    host_ahead_ns, began = 77 * 10**9, []
    for held_up_ns in (2_000_000, 9_000_000, 0, 5_000_000):
        stamp_ns = ear.now_ns + 10**9
        for number in range(5):
            at_ns = stamp_ns + number * FORMAT.duration_ns(320)
            block = PcmBlock(
                format=FORMAT,
                first_row=0,
                stamp_ns=at_ns + host_ahead_ns,
                samples=np.full((320, 1), 12_000, np.int16),
            )
            mouth.step(at_ns + held_up_ns)
            mouth.receive(encode_block(block))
        ear.announce()
        ear.step(stamp_ns)
        ear.announce()
        ear.step(stamp_ns + 400_000_000)
        (heard,) = parser.feed(ear.transmit())
        loud = np.flatnonzero(np.abs(heard.samples[:, 0]) > 1_500)
        began.append(int(loud[0]))
        assert np.abs(heard.samples[loud[0] : loud[0] + 1_600, 0]).min() > 500
    assert len(set(began[2:])) == 1


def test_sound_that_is_not_read_is_forgotten() -> None:
    room = Room(RATE_HZ)
    for second in range(0, 400, 10):
        room.lay(np.ones(RATE_HZ, np.float32), second * RATE_HZ)
    assert len(room._sounding) <= 14


def test_a_person_is_heard_where_the_words_are_said_to_be(lockstep: Lockstep) -> None:
    ear = PcmInput(lockstep.devices.stream("microphone"), lockstep.clock, FORMAT)
    lockstep.run_for(0.2)
    room = lockstep.twin.microphone.room
    heard = arrival("pick up the red cup", Talker(), RATE_HZ, room.acoustics)
    began_ns = lockstep.twin.now_ns
    spoken = let_arrive(lockstep.twin, heard)
    ear.poll()
    samples = []
    while lockstep.twin.now_ns < spoken.ends_ns + 500_000_000:
        lockstep.run_for(0.1)
        block = ear.poll()
        assert block is not None
        samples.append(block.samples[:, 0])
    sound = np.concatenate(samples).astype(float)
    start, end = ((at - began_ns) * RATE_HZ // 10**9 for at in (spoken.begins_ns, spoken.ends_ns))
    assert np.std(sound[: start - 10]) < 2 * NOISE_SIGMA
    assert np.std(sound[start:end]) > 20 * NOISE_SIGMA
    assert np.std(sound[end + 4_800 :]) < 3 * NOISE_SIGMA


def test_twice_as_far_is_weaker_and_the_words_are_as_loud_as_declared() -> None:
    room = Room(RATE_HZ)
    near, far = (
        arrival("go to the kitchen", Talker(distance_m=d), RATE_HZ, room.acoustics) for d in (1, 4)
    )
    assert loudness(near.sound) > 1.3 * loudness(far.sound)
    assert 0.03 < loudness(near.sound) < 0.15


@pytest.mark.parametrize("snr_db", [0.0, 10.0, 20.0])
def test_a_stated_noise_lies_under_the_words_and_around_them(snr_db: float) -> None:
    room = Room(RATE_HZ)
    plain = arrival("go to the kitchen", Talker(), RATE_HZ, room.acoustics)
    noisy = arrival("go to the kitchen", Talker(), RATE_HZ, room.acoustics, snr_db=snr_db)
    begins, ends = noisy.words
    assert begins > RATE_HZ // 4
    assert ends - begins == plain.words[1] - plain.words[0]
    noise = np.std(noisy.sound.wave[: RATE_HZ // 2])
    assert 20 * np.log10(loudness(plain.sound) / noise) == pytest.approx(snr_db, abs=1.5)


def test_loudness_leaves_silence_out() -> None:
    wave = np.zeros(RATE_HZ, np.float32)
    wave[:1_600] = 0.2
    assert loudness(Clip(rate_hz=RATE_HZ, wave=wave)) == pytest.approx(0.2)
    assert loudness(Clip(rate_hz=RATE_HZ, wave=np.zeros(1_600, np.float32))) == 0.0
