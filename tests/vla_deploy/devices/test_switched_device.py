"""A device beside the steps of a node: nothing waits, tasks go in turn, faults are backed off."""

from collections.abc import Callable
from concurrent.futures import Executor, Future
from typing import Any

import pytest

from drivers.clock import NS_PER_S
from tests.vla_deploy.skills.conftest import StepClock
from vla_deploy.devices import DeviceAway, DeviceReading, SwitchedDevice
from vla_deploy.devices.switched_device import LONGEST_BACK_OFF_S
from vla_deploy.robots.home_devices import DeviceKind, HomeDevice


class Later(Executor):
    """Do what was handed in when a test says so."""

    def __init__(self) -> None:
        self.work: list[tuple[Future[Any], Callable[[], Any]]] = []

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        self.work.append((future, lambda: fn(*args, **kwargs)))
        return future

    def do(self) -> None:
        future, act = self.work.pop(0)
        try:
            future.set_result(act())
        except DeviceAway as error:
            future.set_exception(error)


class Wire:
    """One lamp on a wire that can be cut; it keeps what was asked of it."""

    where, called, look_period_s = "the wire", "", 2.0

    def __init__(self) -> None:
        self.asked: list[str] = []
        self.is_on = False
        self.is_cut = False

    def switch(self, on: bool) -> DeviceReading:
        self.asked.append("on" if on else "off")
        self.is_on = on
        return self._told()

    def read(self) -> DeviceReading:
        self.asked.append("look")
        return self._told()

    def interrupt(self) -> None:
        self.asked.append("interrupted")

    def close(self) -> None:
        self.asked.append("closed")

    def _told(self) -> DeviceReading:
        if self.is_cut:
            raise DeviceAway("the wire is cut")
        return DeviceReading(is_on=self.is_on)


class Bench:
    def __init__(self) -> None:
        self.clock, self.wire, self.executor = StepClock(), Wire(), Later()
        lamp = HomeDevice(name="lamp", kind=DeviceKind.LAMP)
        self.device = SwitchedDevice(lamp, self.wire, self.executor, self.clock)

    def step(self) -> None:
        self.device.refresh()
        while self.executor.work:
            self.executor.do()
            self.device.refresh()

    def looks_after_s(self, most_s: float) -> float:
        """Return how long it takes until the device is asked again."""
        before = len(self.wire.asked)
        for tenths in range(round(most_s * 10)):
            self.step()
            if len(self.wire.asked) > before:
                return tenths / 10
            self.clock.ns += NS_PER_S // 10
        return most_s


@pytest.fixture
def bench() -> Bench:
    return Bench()


def test_tasks_go_in_turn_and_the_state_is_what_was_read(bench: Bench) -> None:
    on, off = bench.device.switch(True), bench.device.switch(False)
    assert bench.device.state.is_on is None
    assert len(bench.executor.work) == 1, "one at a time"
    bench.executor.do()
    bench.device.refresh()
    assert on.done
    assert bench.device.state.is_on
    assert not off.done
    bench.executor.do()
    bench.device.refresh()
    assert off.reading == DeviceReading(is_on=False)
    bench.clock.ns += NS_PER_S
    assert bench.device.state.age_s(bench.clock.ns) == 1.0


def test_it_is_looked_at_by_itself_and_more_and_more_seldom_while_it_is_away(bench: Bench) -> None:
    bench.step()
    assert bench.looks_after_s(5.0) == bench.wire.look_period_s
    bench.wire.is_cut = True
    bench.looks_after_s(5.0)
    waits_s = [bench.looks_after_s(100.0) for _ in range(8)]
    assert waits_s == [1.0, 2.0, 4.0, 8.0, 16.0, 32.0, LONGEST_BACK_OFF_S, LONGEST_BACK_OFF_S]
    assert bench.device.state.fault == "the wire is cut"
    assert bench.device.state.is_on is None
    bench.wire.is_cut = False
    bench.device.switch(True)
    bench.step()
    assert bench.device.state.is_on, "who asks does not wait for the next look"
    assert bench.looks_after_s(5.0) == bench.wire.look_period_s


def test_what_was_withdrawn_is_not_begun(bench: Bench) -> None:
    begun, waiting = bench.device.switch(True), bench.device.switch(False)
    bench.device.withdraw(begun)
    bench.device.withdraw(waiting)
    bench.step()
    assert bench.wire.asked[0] == "on"
    assert "off" not in bench.wire.asked
    assert begun.reading is not None
    assert waiting.is_withdrawn


def test_it_is_let_go_without_waiting(bench: Bench) -> None:
    bench.device.look()
    bench.device.close()
    assert bench.wire.asked == ["interrupted"]
    while bench.executor.work:
        bench.executor.do()
    assert bench.wire.asked[-1] == "closed"
