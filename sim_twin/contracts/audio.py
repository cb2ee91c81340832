"""State what every microphone and every speaker must do."""

from typing import Any, ClassVar, Protocol

import numpy as np
import pytest

from drivers.audio.base import AudioBlock, AudioOutput, Samples
from drivers.errors import DeviceMissing, LinkLost
from sim_twin.contracts.bench import Bench, PluggedBench
from sim_twin.contracts.sensors import (
    POLL_S,
    SensorChecks,
    SensorContract,
    UnplugContract,
    WireFaultContract,
)

LOUD = 8_000


class MicrophoneChecks(SensorChecks):
    """Say what a sound block is."""

    lost_bytes_every: ClassVar[int] = 5_000

    def check(self, value: AudioBlock) -> None:
        """Assert the block's shape and kind."""
        assert value.samples.dtype == np.int16
        assert value.samples.ndim == 2
        assert value.samples.shape[1] == value.format.channels
        assert len(value.samples) > 0


class MicrophoneContract(MicrophoneChecks, SensorContract):
    """Hold for any form of a microphone."""

    def test_as_many_samples_come_as_time_passes(self, bench: Any) -> None:
        """The rate is the declared one, within what one poll may hold back."""
        device = bench.open()
        self.collect(bench, device, self.patience_s / 2)
        began_ns = bench.clock.now_ns()
        blocks = self.collect(bench, device, self.patience_s)
        seconds = (bench.clock.now_ns() - began_ns) / 1e9
        rows = sum(len(block.samples) for block in blocks)
        assert rows / device.format.rate_hz == pytest.approx(seconds, rel=0.25, abs=2 * POLL_S)
        device.close()


class MicrophoneUnplugContract(MicrophoneChecks, UnplugContract):
    """Hold where the cable can be pulled."""


class MicrophoneWireFaultContract(MicrophoneChecks, WireFaultContract):
    """Hold on a line that can be spoiled."""


def write_all(bench: Bench[AudioOutput], speaker: AudioOutput, samples: Samples) -> int:
    """Write everything as room comes, and return how often the speaker was asked."""
    asked = 0
    while len(samples) and asked < 1_000:
        samples = samples[speaker.write(samples) :]
        bench.let(POLL_S)
        asked += 1
    assert len(samples) == 0
    return asked


class SpeakerContract:
    """Hold for any form of a speaker."""

    def test_everything_is_taken_in_time(self, bench: Bench[AudioOutput]) -> None:
        """Sound that is longer than the device's room is taken bit by bit."""
        speaker = bench.open()
        rows = speaker.format.rate_hz // 2
        write_all(bench, speaker, np.full((rows, speaker.format.channels), LOUD, np.int16))
        assert speaker.counters.samples == rows
        speaker.close()

    def test_samples_of_another_shape_or_kind_are_refused(self, bench: Bench[AudioOutput]) -> None:
        """Mistakes are told, not played."""
        speaker = bench.open()
        wide = np.zeros((10, speaker.format.channels + 1), np.int16)
        with pytest.raises(ValueError, match="expected int16 samples of shape"):
            speaker.write(wide)
        flat: Any = np.zeros((10, speaker.format.channels), np.float32)
        with pytest.raises(ValueError, match="float32"):
            speaker.write(flat)
        speaker.close()

    def test_it_can_be_closed_twice_and_opened_again(self, bench: Bench[AudioOutput]) -> None:
        """An orderly end leaves the speaker ready."""
        speaker = bench.open()
        speaker.close()
        speaker.close()
        speaker = bench.open()
        assert speaker.write(np.zeros((8, speaker.format.channels), np.int16)) == 8
        speaker.close()


class HeardBench(PluggedBench[AudioOutput], Protocol):
    """Hold a speaker whose sound can be heard and whose cable can be pulled."""

    def heard(self) -> Samples:
        """Return what came out since the last call."""
        ...


class HeardSpeakerContract:
    """Hold where the bench hears the speaker and can unplug it."""

    def test_what_is_written_is_what_is_heard(self, bench: HeardBench) -> None:
        """No sample is lost, doubled or out of order."""
        speaker = bench.open()
        rows = speaker.format.rate_hz
        ramp = (np.arange(rows) % 30_000).astype(np.int16)
        samples = np.repeat(ramp[:, None], speaker.format.channels, axis=1)
        assert write_all(bench, speaker, samples) > 5
        bench.let(POLL_S)
        assert np.array_equal(bench.heard(), samples)
        speaker.close()

    def test_a_pulled_cable_is_a_lost_link_and_a_replug_brings_it_back(
        self, bench: HeardBench
    ) -> None:
        """The loss is told, the device is missing meanwhile, and usable afterwards."""
        speaker = bench.open()
        silence = np.zeros((8, speaker.format.channels), np.int16)
        speaker.write(silence)
        bench.unplug()
        with pytest.raises(LinkLost, match=r"plug|restart"):
            for _ in range(10):
                speaker.write(silence)
        speaker.close()
        with pytest.raises(DeviceMissing):
            bench.open()
        bench.replug()
        speaker = bench.open()
        assert speaker.write(silence) == 8
        speaker.close()
