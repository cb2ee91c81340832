"""State what every servo bus must do; with torque off no servo moves, with torque on each holds."""

from typing import ClassVar, Final, Protocol

import numpy as np
import pytest

from drivers.dynamixel import DynamixelBus
from drivers.dynamixel.errors import RejectedRange
from drivers.errors import DeviceMissing, LinkLost
from drivers.servo.state import BusState
from sim_twin.contracts.bench import Bench, PluggedBench

TICK_S: Final = 0.01
CYCLES: Final = 25
LEAST_GOOD_SHARE: Final = 0.98
VOLTS: Final = (4.0, 26.0)
CELSIUS: Final = (-5.0, 80.0)
TURNS_RAD: Final = 256 * 2 * np.pi
"""Farther than any servo counts its turns."""
SAG_RAD: Final = 0.1
"""How far a servo may give way under the load it holds."""


class PacketBench(PluggedBench[DynamixelBus], Protocol):
    """Hold a bus whose cable can be pulled."""


def cycle(bench: Bench[DynamixelBus], bus: DynamixelBus, cycles: int = CYCLES) -> BusState:
    """Read `cycles` times in the rhythm of a control loop and return the last state."""
    for _ in range(cycles):
        bench.let(TICK_S)
        bus.read_state()
    return bus.state


class ServoBusContract:
    """Hold for any form, and move nothing: no test of this class switches torque on."""

    def test_every_servo_is_the_declared_one(self, bench: Bench[DynamixelBus]) -> None:
        """Model numbers are those of the robot file."""
        bus = bench.open()
        numbers = [bus.read_register(servo.id, "model_number") for servo in bus.servos]
        bus.close()
        assert numbers == [servo.model.number for servo in bus.servos]

    def test_sound_values_of_all_servos_come_in_nearly_every_cycle(
        self, bench: Bench[DynamixelBus]
    ) -> None:
        """Whoever answers does so whole; a damaged packet now and then is life."""
        bus = bench.open()
        valid = 0
        for _ in range(CYCLES):
            state = cycle(bench, bus, 1)
            valid += int(state.valid.sum())
            assert np.isfinite(state.position_rad).all()
            assert np.abs(state.position_rad[state.valid]).max(initial=0.0) < TURNS_RAD
            assert state.age_s[state.valid].max(initial=0.0) < TICK_S
        bus.close()
        assert valid >= LEAST_GOOD_SHARE * CYCLES * len(bus.servos)

    def test_voltage_and_temperature_become_known(self, bench: Bench[DynamixelBus]) -> None:
        """Slow registers are all told within a few turns of the round."""
        bus = bench.open()
        state = cycle(bench, bus, 12 * len(bus.servos))
        bus.close()
        assert ((state.voltage_v > VOLTS[0]) & (state.voltage_v < VOLTS[1])).all()
        assert ((state.temperature_c > CELSIUS[0]) & (state.temperature_c < CELSIUS[1])).all()

    def test_stamps_grow_and_never_lie_in_the_future(self, bench: Bench[DynamixelBus]) -> None:
        """Each cycle is later than the one before, and not later than now."""
        bus = bench.open()
        stamps = [cycle(bench, bus, 1).stamp_ns for _ in range(CYCLES)]
        bus.close()
        assert stamps == sorted(set(stamps))
        assert stamps[-1] <= bench.clock.now_ns()

    def test_it_can_be_closed_twice_and_opened_again(self, bench: Bench[DynamixelBus]) -> None:
        """An orderly end leaves the bus ready for the next driver."""
        bus = bench.open()
        bus.close()
        bus.close()
        bus = bench.open()
        assert np.isfinite(cycle(bench, bus).position_rad).all()
        bus.close()


class ServoTorqueContract:
    """Hold where the servos may be energised; none is sent anywhere but to where it stands."""

    watchdog_s: ClassVar[float] = 0.1

    def test_torque_comes_on_where_the_servos_stand(self, bench: Bench[DynamixelBus]) -> None:
        """Nothing jumps, and every watchdog is armed."""
        bus = bench.open()
        try:
            before = cycle(bench, bus).position_rad.copy()
            bus.enable_torque()
            for _ in range(CYCLES):
                state = cycle(bench, bus, 1)
                bus.write_goals(before)
            assert state.torque_on.all()
            assert (state.watchdog > 0).all()
            travel = [servo.travel_per_rad for servo in bus.servos]
            assert (np.abs(state.position_rad - before) / travel).max() < SAG_RAD
        finally:
            bus.disable_torque()
            bus.close()

    def test_silence_trips_every_watchdog_and_goals_wait_for_clearing(
        self, bench: Bench[DynamixelBus]
    ) -> None:
        """A host that hangs leaves servos that hold and listen to no old goal."""
        bus = bench.open()
        try:
            cycle(bench, bus)
            bus.enable_torque()
            cycle(bench, bus)
            bench.let(self.watchdog_s + 0.1)
            cycle(bench, bus)
            assert bus.watchdog_tripped == tuple(servo.joint for servo in bus.servos)
            with pytest.raises(RejectedRange):
                bus.write_register(bus.servos[0].id, "goal_position", 2048)
            bus.clear_watchdog()
            assert bus.watchdog_tripped == ()
        finally:
            bus.disable_torque()
            bus.close()


class ServoUnplugContract:
    """Hold where the cable can be pulled."""

    def test_a_pulled_cable_is_seen_within_one_cycle(self, bench: PacketBench) -> None:
        """The loss is told at once, and says what to do."""
        bus = bench.open()
        cycle(bench, bus)
        bench.unplug()
        with pytest.raises(LinkLost, match="plug"):
            bus.read_state()
        bus.close()

    def test_it_cannot_be_opened_while_the_cable_is_out(self, bench: PacketBench) -> None:
        """A missing adapter is told as one."""
        bench.unplug()
        with pytest.raises(DeviceMissing):
            bench.open()

    def test_servos_come_back_with_the_cable(self, bench: PacketBench) -> None:
        """No restart is needed."""
        bench.open().close()
        bench.unplug()
        bench.let(TICK_S)
        bench.replug()
        bus = bench.open()
        assert cycle(bench, bus).valid.all()
        bus.close()
