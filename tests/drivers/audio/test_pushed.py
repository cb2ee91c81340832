"""A microphone fed by pushed samples keeps the microphone contract."""

import numpy as np
import pytest

from drivers.audio.base import AudioFormat, AudioInput
from drivers.audio.pushed import PushedInput
from drivers.clock import NS_PER_S
from drivers.errors import LinkLost
from sim_twin.contracts.audio import MicrophoneContract
from sim_twin.contracts.scripted import ManualClock

BROWSER = AudioFormat(rate_hz=48_000, channels=2)


class PushingBench:
    """Push as a browser does: what time has passed, in one block."""

    def __init__(self) -> None:
        self.clock = ManualClock(NS_PER_S)
        self.device: PushedInput | None = None

    def open(self) -> AudioInput:
        self.device = PushedInput(BROWSER, self.clock)
        return self.device

    def let(self, seconds: float) -> None:
        self.clock.ns += round(seconds * NS_PER_S)
        assert self.device is not None
        self.device.push(np.ones((round(seconds * BROWSER.rate_hz), 2), np.int16))


class TestPushedMicrophone(MicrophoneContract):
    @pytest.fixture
    def bench(self) -> PushingBench:
        return PushingBench()


def test_samples_that_are_not_polled_are_dropped_oldest_first_and_counted() -> None:
    clock = ManualClock(NS_PER_S)
    device = PushedInput(BROWSER, clock)
    for number in range(15):
        clock.ns += NS_PER_S // 10
        device.push(np.full((4_800, 2), number, np.int16))
    block = device.poll()
    assert block is not None
    assert len(block.samples) == BROWSER.rate_hz
    assert block.samples[0, 0] == 5
    assert block.stamp_ns == clock.ns - NS_PER_S
    assert device.counters.lost_samples == 5 * 4_800


def test_a_page_that_was_closed_is_a_lost_link() -> None:
    clock = ManualClock(NS_PER_S)
    device = PushedInput(BROWSER, clock)
    assert device.poll() is None
    clock.ns += 4 * NS_PER_S
    with pytest.raises(LinkLost, match="nobody sends"):
        device.poll()


def test_samples_of_another_shape_are_refused_and_a_closed_one_takes_none() -> None:
    device = PushedInput(BROWSER, ManualClock())
    with pytest.raises(ValueError, match=r"expected int16 samples of shape \(n, 2\)"):
        device.push(np.zeros((10, 1), np.int16))
    device.close()
    with pytest.raises(LinkLost, match="closed"):
        device.push(np.zeros((10, 2), np.int16))
