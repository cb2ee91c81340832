"""State what every bus of wheel drives must do that can be asked of real ones: no wheel turns."""

from typing import Final

import numpy as np
import pytest

from drivers.wheel_drives.bus import DriveBus, DriveState
from sim_twin.contracts.bench import Bench

TICK_S: Final = 0.01
STILL_RAD_S: Final = 0.05
ENABLE_S: Final = 1.0


def cycle(bench: Bench[DriveBus], bus: DriveBus, seconds: float) -> DriveState:
    """Run cycles that ask for no motion and return the last state."""
    state = bus.cycle(None)
    for _ in range(round(seconds / TICK_S)):
        bench.let(TICK_S)
        state = bus.cycle(None)
    return state


class DriveBusContract:
    """Hold for any form; no drive is given power."""

    def test_connecting_leaves_healthy_drives_without_power(self, bench: Bench[DriveBus]) -> None:
        """All drives are there, sound and off."""
        bus = bench.open()
        state = cycle(bench, bus, 0.3)
        bus.close()
        assert state.healthy, (state.lost, state.fault)
        assert not state.enabled

    def test_values_are_young_and_finite(self, bench: Bench[DriveBus]) -> None:
        """Every drive tells where it stands in every cycle."""
        bus = bench.open()
        state = cycle(bench, bus, 0.3)
        bus.close()
        assert np.isfinite(state.position_rad).all()
        assert np.abs(state.velocity_rad_s).max() < STILL_RAD_S
        assert state.age_s.max() < 0.1

    def test_nothing_turns_without_enable(self, bench: Bench[DriveBus]) -> None:
        """A velocity alone moves no wheel."""
        bus = bench.open()
        before = cycle(bench, bus, 0.1).position_rad
        for _ in range(20):
            bench.let(TICK_S)
            state = bus.cycle(np.full(len(before), 1.0))
        bus.close()
        assert np.abs(state.position_rad - before).max() < STILL_RAD_S

    def test_a_velocity_that_is_no_number_is_refused(self, bench: Bench[DriveBus]) -> None:
        """Nonsense does not reach the wire."""
        bus = bench.open()
        drives = len(cycle(bench, bus, 0.1).lost)
        with pytest.raises(ValueError, match="NaN"):
            bus.cycle(np.full(drives, np.nan))
        bus.close()

    def test_it_can_be_closed_twice_and_opened_again(self, bench: Bench[DriveBus]) -> None:
        """An orderly end leaves the drives ready for the next driver."""
        bus = bench.open()
        cycle(bench, bus, 0.1)
        bus.close()
        bus.close()
        bus = bench.open()
        assert cycle(bench, bus, 0.3).healthy
        bus.close()


class DrivePowerContract:
    """Hold where the drives may be given power; no wheel is told to turn."""

    def test_enabling_turns_no_wheel_and_disabling_ends_it(self, bench: Bench[DriveBus]) -> None:
        """The target is zero until a velocity comes."""
        bus = bench.open()
        before = cycle(bench, bus, 0.2).position_rad
        bus.enable()
        state = cycle(bench, bus, ENABLE_S)
        assert state.enabled
        assert np.abs(state.position_rad - before).max() < STILL_RAD_S
        bus.disable()
        assert not cycle(bench, bus, ENABLE_S).enabled
        bus.close()
