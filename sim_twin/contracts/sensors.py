"""State what holds for every sensor that is polled: lidar, IMU, camera, microphone.

A test module gives a form of the device by a fixture `bench` and inherits the classes that the form
can stand: `SensorContract` always, `UnplugContract` where the cable can be pulled, and
`WireFaultContract` where the line is emulated. `lidar.py` and its neighbours say what a sound value
is.
"""

from dataclasses import astuple
from typing import Any, ClassVar

import pytest

from drivers.errors import DeviceMissing, LinkLost
from drivers.reopening import Reopening
from sim_twin.contracts.bench import Truncation
from sim_twin.faults.line_tamper import Garbage, Latency, Silence

POLL_S = 0.02
DELAY_S = 0.2


def values_of(device: Any) -> list[Any]:
    """Return what one poll gives as a list, empty where there is no news."""
    polled = device.poll()
    if polled is None:
        return []
    return polled if isinstance(polled, list) else [polled]


class SensorChecks:
    """Hold what the contracts below need; `patience_s` is how long news may take to come."""

    patience_s: ClassVar[float] = 1.0
    lost_bytes_every: ClassVar[int] = 200

    def check(self, value: Any) -> None:
        """Assert that one value is sound; each kind has its own idea of that."""
        raise NotImplementedError

    def collect(self, bench: Any, device: Any, seconds: float) -> list[Any]:
        """Return what comes within `seconds`."""
        values: list[Any] = []
        for _ in range(round(seconds / POLL_S)):
            bench.let(POLL_S)
            values += values_of(device)
        return values


class SensorContract(SensorChecks):
    """Hold for any form: hardware, a driver on an emulated wire, a file."""

    def test_sound_values_arrive(self, bench: Any) -> None:
        """Values come in time and each is sound."""
        device = bench.open()
        values = self.collect(bench, device, self.patience_s)
        device.close()
        assert values
        for value in values:
            self.check(value)

    def test_stamps_grow_and_never_lie_in_the_future(self, bench: Any) -> None:
        """A value was taken after the one before it, and before now."""
        device = bench.open()
        stamps: list[int] = []
        for _ in range(round(self.patience_s / POLL_S)):
            bench.let(POLL_S)
            fresh = [value.stamp_ns for value in values_of(device)]
            assert all(stamp_ns <= bench.clock.now_ns() for stamp_ns in fresh)
            stamps += fresh
        device.close()
        assert len(stamps) > 1
        assert stamps == sorted(set(stamps))

    def test_polling_without_news_gives_nothing_at_once(self, bench: Any) -> None:
        """Nothing is told twice, and nobody waits for the next value."""
        device = bench.open()
        self.collect(bench, device, self.patience_s)
        began_ns = bench.clock.now_ns()
        told = [values_of(device) for _ in range(10)]
        assert [] in told
        assert bench.clock.now_ns() - began_ns < self.patience_s * 1e9
        device.close()

    def test_counters_tell_that_something_came(self, bench: Any) -> None:
        """The counters grow with the values."""
        device = bench.open()
        before = sum(astuple(device.counters))
        self.collect(bench, device, self.patience_s)
        assert sum(astuple(device.counters)) > before
        device.close()

    def test_it_can_be_closed_twice_and_opened_again(self, bench: Any) -> None:
        """An orderly end leaves the device ready for the next driver."""
        device = bench.open()
        device.close()
        device.close()
        device = bench.open()
        assert self.collect(bench, device, self.patience_s)
        device.close()


class UnplugContract(SensorChecks):
    """Hold where the cable can be pulled."""

    def test_a_pulled_cable_is_a_lost_link_that_says_what_to_do(self, bench: Any) -> None:
        """The loss is told at the next poll."""
        device = bench.open()
        self.collect(bench, device, self.patience_s)
        bench.unplug()
        bench.let(POLL_S)
        with pytest.raises(LinkLost, match=r"plug|restart"):
            for _ in range(100):
                values_of(device)
        device.close()

    def test_it_cannot_be_opened_while_the_cable_is_out(self, bench: Any) -> None:
        """A missing device is told as one."""
        bench.unplug()
        with pytest.raises(DeviceMissing):
            bench.open()

    def test_it_comes_back_by_itself_after_the_cable_is_in_again(self, bench: Any) -> None:
        """`Reopening` needs no restart, and its caller goes on meanwhile."""
        device: Reopening[Any] = Reopening("device", bench.open, bench.clock)
        device.open()
        bench.let(self.patience_s)
        none: list[Any] = []
        bench.unplug()
        for _ in range(10):
            bench.let(POLL_S)
            device.poll(values_of, none)
        assert device.failure
        bench.replug()
        back: list[Any] = []
        for _ in range(round((1.0 + self.patience_s) / POLL_S)):
            bench.let(POLL_S)
            back += device.poll(values_of, none)
            if len(back) > 1:
                break
        assert (device.failure, device.reconnects) == ("", 1)
        assert back
        for value in back:
            self.check(value)
        device.close()


class WireFaultContract(SensorChecks):
    """Hold on a line that can be spoiled."""

    def test_silence_gives_nothing_and_ends_well(self, bench: Any) -> None:
        """A silent device is no error of the link, and is heard again afterwards."""
        device = bench.open()
        self.collect(bench, device, self.patience_s)
        with bench.spoiled(Silence()):
            assert self.collect(bench, device, self.patience_s) == []
        assert self.collect(bench, device, 2.0 * self.patience_s)

    def test_garbage_never_passes_and_ends_well(self, bench: Any) -> None:
        """Random bytes are counted, not believed."""
        device = bench.open()
        self.collect(bench, device, self.patience_s)
        before = device.counters.discarded_bytes
        with bench.spoiled(Garbage(seed=1)):
            assert self.collect(bench, device, self.patience_s) == []
        after = self.collect(bench, device, 2.0 * self.patience_s)
        assert device.counters.discarded_bytes > before
        assert after
        for value in after:
            self.check(value)

    def test_lost_bytes_cost_only_what_they_hit(self, bench: Any) -> None:
        """What is told in spite of lost bytes is sound, and all is well afterwards."""
        device = bench.open()
        with bench.spoiled(Truncation(self.lost_bytes_every, seed=2)):
            during = self.collect(bench, device, 2.0 * self.patience_s)
        after = self.collect(bench, device, 2.0 * self.patience_s)
        assert after
        for value in during + after:
            self.check(value)

    def test_late_bytes_still_give_sound_values_with_growing_stamps(self, bench: Any) -> None:
        """A delay shifts values; it neither breaks nor reorders them."""
        device = bench.open()
        self.collect(bench, device, self.patience_s)
        with bench.spoiled(Latency(DELAY_S)):
            values = self.collect(bench, device, self.patience_s + DELAY_S)
        assert values
        for value in values:
            self.check(value)
        stamps = [value.stamp_ns for value in values]
        assert stamps == sorted(set(stamps))
        assert stamps[-1] <= bench.clock.now_ns()
