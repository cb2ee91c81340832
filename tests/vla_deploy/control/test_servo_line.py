"""The servo line over a real terminal: unplugged, plugged in again, without a restart."""

import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from drivers.clock import NS_PER_S, MonotonicClock
from drivers.opener import DeviceLink, PathOpener
from platforms import load_profile
from sim_twin.ports.pty_line import PtyLine
from sim_twin.servos import EmulatedServoSpec
from sim_twin.servos.server import FreeServos
from vla_deploy.control.output.servos import ServoLine
from vla_deploy.robots import load_robot

pytestmark = pytest.mark.stack
CLOCK = MonotonicClock()


class ServedServos:
    """Serve the robot's servos on a terminal from a thread, until closed."""

    def __init__(self, link_path: Path) -> None:
        robot = load_robot("butler")
        self.servos = FreeServos(
            [EmulatedServoSpec(id=s.id, model_name=s.model) for s in robot.servo_bus.servos]
        )
        self.servos.advance_to(CLOCK.now_ns())
        self.line = PtyLine(self.servos.bank, link_path)
        self._lock = threading.Lock()
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._serve)
        self._thread.start()

    def unplug(self) -> None:
        with self._lock:
            self.line.unplug()

    def replug(self) -> None:
        with self._lock:
            self.line.replug()

    def close(self) -> None:
        self._closed.set()
        self._thread.join()
        self.line.close()

    def _serve(self) -> None:
        while not self._closed.wait(0.0002):
            with self._lock:
                self.servos.advance_to(CLOCK.now_ns())
                if self.line.is_plugged:
                    self.line.poll_once()


@pytest.fixture
def served(tmp_path: Path) -> Iterator[ServedServos]:
    served = ServedServos(tmp_path / "servos")
    yield served
    served.close()


def open_line(path: Path) -> ServoLine:
    robot = load_robot("butler")
    links = {robot.servo_bus.device: DeviceLink(path=str(path), baud=robot.servo_bus.baud)}
    line = ServoLine(robot, load_profile("desktop"), PathOpener(links, CLOCK), CLOCK)
    line.open()
    return line


def test_an_unplugged_line_is_lost_in_one_cycle_and_comes_back_unarmed(
    served: ServedServos,
) -> None:
    line = open_line(served.line.link_path)
    assert all(line.energise(servo) for servo in range(len(line.state.valid)))
    served.unplug()
    line.read()
    assert line.lost
    assert "plug it in again" in line.failure
    assert not line.state.valid.any()
    assert not line.try_reopen()
    served.replug()
    deadline_ns = CLOCK.now_ns() + 20 * NS_PER_S
    while not line.try_reopen():
        assert CLOCK.now_ns() < deadline_ns, line.failure
        CLOCK.sleep_until(CLOCK.now_ns() + NS_PER_S // 50)
    assert not line.lost
    everyone = np.arange(len(line.state.valid))
    assert line.unguarded.tolist() == everyone.tolist()  # all must be armed anew
    assert line.remove_power(everyone)
    bank = served.servos.bank
    ids = [servo.id for servo in load_robot("butler").servo_bus.servos]
    assert [bank.register(servo_id, "torque_enable") for servo_id in ids] == [0] * len(ids)
    line.read()
    assert np.isfinite(line.state.position_rad).all()
    line.close()
