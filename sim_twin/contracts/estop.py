"""State what every emergency-stop input must do; a person or the twin works the button."""

from typing import Any, Protocol

import pytest

from drivers.errors import DeviceMissing
from drivers.estop.base import ButtonState, EstopInput, EstopReading
from drivers.estop.reopening import ReopeningEstop
from sim_twin.contracts.bench import Bench, PluggedBench

SETTLE_S = 0.2
TICK_S = 0.004


class EstopBench(Bench[EstopInput], Protocol):
    """Hold a button that can be worked."""

    def press(self) -> None:
        """Push the button down."""
        ...

    def release(self) -> None:
        """Let the button spring up."""
        ...


class PluggedEstopBench(EstopBench, PluggedBench[EstopInput], Protocol):
    """Hold a button whose cable, chip or wire can be pulled."""


def settled(bench: Bench[Any], button: EstopInput) -> EstopReading:
    """Return what the button says when it has had time to say it."""
    reading = button.poll()
    for _ in range(round(SETTLE_S / TICK_S)):
        bench.let(TICK_S)
        reading = button.poll()
    return reading


class EstopContract:
    """Hold for any form of the input."""

    def test_a_released_button_reads_as_released_without_a_reason(self, bench: EstopBench) -> None:
        """The robot can be armed."""
        button = bench.open()
        reading = settled(bench, button)
        assert (reading.state, reading.pressed) == (ButtonState.RELEASED, False)
        assert reading.reason == ""
        button.close()

    def test_a_press_is_read_at_the_next_poll(self, bench: EstopBench) -> None:
        """Nothing smooths a press."""
        button = bench.open()
        settled(bench, button)
        bench.press()
        bench.let(TICK_S)
        reading = button.poll()
        assert (reading.state, reading.pressed) == (ButtonState.PRESSED, True)
        assert reading.reason
        assert reading.stamp_ns <= bench.clock.now_ns()
        button.close()

    def test_it_stays_pressed_until_it_is_released(self, bench: EstopBench) -> None:
        """Silence of the button changes nothing."""
        button = bench.open()
        bench.press()
        assert settled(bench, button).state is ButtonState.PRESSED
        assert settled(bench, button).state is ButtonState.PRESSED
        bench.release()
        assert settled(bench, button).state is ButtonState.RELEASED
        assert (button.counters.presses, button.counters.releases) == (1, 1)
        button.close()

    def test_a_button_that_is_down_when_it_is_opened_reads_as_pressed(
        self, bench: EstopBench
    ) -> None:
        """A restarted process knows of a press that came before it."""
        bench.press()
        for _ in range(2):
            button = bench.open()
            assert button.poll().pressed
            assert settled(bench, button).state is ButtonState.PRESSED
            button.close()

    def test_nothing_told_yet_reads_as_pressed(self, bench: EstopBench) -> None:
        """Only a button that says that it is released lets the robot move."""
        button = bench.open()
        reading = button.poll()
        assert reading.pressed or reading.state is ButtonState.RELEASED
        assert bool(reading.reason) is reading.pressed
        button.close()

    def test_it_can_be_closed_twice_and_opened_again(self, bench: EstopBench) -> None:
        """An orderly end leaves the button ready for the next driver."""
        button = bench.open()
        button.close()
        button.close()
        button = bench.open()
        assert settled(bench, button).state is ButtonState.RELEASED
        button.close()


class EstopUnplugContract:
    """Hold where the cable, the chip or the wire can be pulled."""

    def test_a_lost_button_reads_as_pressed_and_stays_lost(self, bench: PluggedEstopBench) -> None:
        """The loss is a reading, not an exception, and says what to do."""
        button = bench.open()
        settled(bench, button)
        bench.unplug()
        bench.let(TICK_S)
        for _ in range(3):
            reading = button.poll()
            assert (reading.state, reading.pressed) == (ButtonState.LOST, True)
            assert "plug" in reading.reason or "restart" in reading.reason
        assert button.counters.losses == 1
        button.close()

    def test_it_cannot_be_opened_while_it_is_away(self, bench: PluggedEstopBench) -> None:
        """A missing button is told as one."""
        bench.unplug()
        with pytest.raises(DeviceMissing):
            bench.open()

    def test_it_comes_back_by_itself_and_reads_as_pressed_until_then(
        self, bench: PluggedEstopBench
    ) -> None:
        """`ReopeningEstop` needs no restart."""
        button = ReopeningEstop(bench.open, bench.clock)
        assert settled(bench, button).state is ButtonState.RELEASED
        bench.unplug()
        bench.let(TICK_S)
        assert button.poll().state is ButtonState.LOST
        assert settled(bench, button).pressed
        bench.replug()
        assert self._back(bench, button).state is ButtonState.RELEASED
        button.close()

    def test_a_press_while_it_was_away_is_known_when_it_is_back(
        self, bench: PluggedEstopBench
    ) -> None:
        """What counts is the state, not the events."""
        button = ReopeningEstop(bench.open, bench.clock)
        settled(bench, button)
        bench.unplug()
        settled(bench, button)
        bench.press()
        bench.replug()
        assert self._back(bench, button).state is ButtonState.PRESSED
        button.close()

    def _back(self, bench: PluggedEstopBench, button: EstopInput) -> EstopReading:
        """Return what the button says once it is back, which takes a second at most."""
        reading = button.poll()
        while reading.state is ButtonState.LOST:
            bench.let(TICK_S)
            reading = button.poll()
        return settled(bench, button)
