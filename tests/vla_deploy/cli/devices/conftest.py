"""Put emulated servos behind pseudo-terminals."""

import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from drivers.clock import NS_PER_S, MonotonicClock
from sim_twin.servos import EmulatedServoSpec
from sim_twin.servos.feetech import EmulatedFeetechSpec
from sim_twin.servos.server import FreeBank, FreeFeetechServos, FreeServos, serve

CLOCK = MonotonicClock()


class Bus:
    """Servos behind a pseudo-terminal, served by a thread."""

    def __init__(self, link: Path, free: FreeBank) -> None:
        self.port = str(link)
        self.free = free
        self.bank = self.free.bank
        self._stop = threading.Event()
        self._thread = threading.Thread(
            target=serve, args=(self.free, link, CLOCK, self._stop.is_set)
        )
        self._thread.start()
        end_ns = CLOCK.now_ns() + 10 * NS_PER_S
        while not link.exists() and CLOCK.now_ns() < end_ns:
            CLOCK.sleep_until(CLOCK.now_ns() + NS_PER_S // 1000)

    def turn(self, row: int, angle_rad: float) -> None:
        """Put a shaft somewhere, again if the serving thread was just writing its own value."""
        while self.free.rotors.position_rad[row] != angle_rad:
            self.free.rotors.position_rad[row] = angle_rad
            CLOCK.sleep_until(CLOCK.now_ns() + NS_PER_S // 100)

    def close(self) -> None:
        self._stop.set()
        self._thread.join()


@pytest.fixture
def make_bus(tmp_path: Path) -> Iterator[Callable[..., Bus]]:
    buses = []

    def make(*ids: int, model: str = "XM430-W350", **eeprom: int) -> Bus:
        servos = [EmulatedServoSpec(id=one, model_name=model, eeprom=eeprom) for one in ids]
        return serve_bus(FreeServos(servos))

    def serve_bus(free: FreeBank) -> Bus:
        buses.append(Bus(tmp_path / f"bus{len(buses)}", free))
        return buses[-1]

    make.feetech = lambda *ids, **eeprom: serve_bus(
        FreeFeetechServos(
            [EmulatedFeetechSpec(id=one, model_name="STS3215-C018", eeprom=eeprom) for one in ids]
        )
    )

    yield make
    for bus in buses:
        bus.close()
