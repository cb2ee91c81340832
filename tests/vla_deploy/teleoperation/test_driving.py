"""A base is driven by hand as long as its keys are pressed, and brakes where nobody asks."""

import argparse
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from drivers.clock import NS_PER_S
from sim_twin.harness.lockstep_stack import LockstepControl
from vla_deploy.cli.errors import CommandFailed, UsageError
from vla_deploy.cli.operation import drive_by_hand
from vla_deploy.cli.session import RobotSession
from vla_deploy.ipc import ClaimBook
from vla_deploy.robots import load_robot
from vla_deploy.teleoperation.driving import HOLDS_S, BaseDriver, DriveWish
from vla_deploy.teleoperation.keyboard import DRIVE_KEYS, SIDEWAYS_KEYS, Keyboard

ARGUMENTS = argparse.Namespace(json=True, keyboard=True, speed=0.4)
NOTHING = DriveWish()


class HandDriven(LockstepControl):
    """An armed LeKiwi whose time passes while a command waits; keys come at their times."""

    def __init__(self, tmp_path: Path) -> None:
        super().__init__(tmp_path, robot="lekiwi")
        self.arm()
        self.acts: dict[float, Callable[[], object]] = {}
        self._table = self.space.cell_writer("process_table")
        ClaimBook(self.space, self.clock).declare({"base": 1})
        self._began_ns = self.now_ns()

    def now_ns(self) -> int:
        return self.clock.now_ns()

    def sleep_until(self, deadline_ns: int) -> None:
        self._table.put_document({"robot": "lekiwi"})
        elapsed_s = (deadline_ns - self._began_ns) / NS_PER_S
        for at_s in [one for one in self.acts if one <= elapsed_s]:
            self.acts.pop(at_s)()
        self.lockstep.run_for((deadline_ns - self.now_ns()) / NS_PER_S)

    def where(self) -> tuple[float, float]:
        """Return how far ahead and to the left it has come, by physics."""
        true = self.lockstep.truth()["robot"]
        return float(true["x_m"]), float(true["y_m"])

    def speed_m_s(self) -> float:
        x_m, y_m = self.where()
        self.lockstep.run_for(0.04)
        later = self.where()
        return float(((later[0] - x_m) ** 2 + (later[1] - y_m) ** 2) ** 0.5 / 0.04)


@pytest.fixture
def base(tmp_path: Path) -> Iterator[HandDriven]:
    made = HandDriven(tmp_path)
    yield made
    made.close()


@pytest.fixture
def keys(base: HandDriven, monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    """The end of the terminal at which a person types."""
    reading, typing = os.pipe()

    @contextmanager
    def drive_input(*_: Any) -> Iterator[Keyboard[DriveWish]]:
        yield Keyboard(reading, base, {**DRIVE_KEYS, **SIDEWAYS_KEYS}, NOTHING)

    monkeypatch.setattr(drive_by_hand, "drive_input", drive_input)
    yield typing
    os.close(reading)
    os.close(typing)


def ctrl_c() -> None:
    raise KeyboardInterrupt


def drive(base: HandDriven) -> int:
    session = RobotSession(base.lockstep.context.run_dir, base)
    return drive_by_hand.drive(ARGUMENTS, session, base.robot)


def test_keys_drive_ahead_and_sideways_and_ctrl_c_leaves_it_at_rest(
    base: HandDriven, keys: int, capsys: pytest.CaptureFixture[str]
) -> None:
    began = base.where()
    for at_s in (0.1, 0.3, 0.5, 0.7):
        base.acts[at_s] = lambda: os.write(keys, b"a")
    base.acts[1.5] = ctrl_c
    assert drive(base) == 0
    moved = [after - before for after, before in zip(base.where(), began, strict=True)]
    assert moved[1] > 0.05, "to the left"
    assert abs(moved[0]) < 0.02
    assert base.speed_m_s() < 0.005
    assert '"ended": "Ctrl-C"' in capsys.readouterr().out
    assert ClaimBook(base.space, base.clock).ask("another", {"base": 1})


def test_an_emergency_stop_ends_it(base: HandDriven, keys: int) -> None:
    base.acts[0.1] = lambda: os.write(keys, b"\x1b[A")
    base.acts[0.3] = lambda: base.operate("estop")
    with pytest.raises(CommandFailed, match="the robot is stopp"):
        drive(base)
    base.pause(0.5)
    assert base.speed_m_s() < 0.005


def test_a_driver_that_is_killed_leaves_a_base_that_brakes(base: HandDriven) -> None:
    class Pressed:
        def wish(self) -> DriveWish:
            return DriveWish(ahead=1.0)

    assert base.robot.parts.base is not None
    command = base.space.cell_writer("hand_base_command")
    driver = BaseDriver(base.robot.parts.base, command, Pressed())
    for _ in range(16):
        driver.step()
        base.pause(0.05)
    assert base.speed_m_s() > 0.05
    base.pause(HOLDS_S + 0.4)
    assert base.speed_m_s() < 0.005


def test_an_arm_on_a_table_has_nothing_to_drive(base: HandDriven) -> None:
    session = RobotSession(base.lockstep.context.run_dir, base)
    with pytest.raises(UsageError, match="so101 has no base"):
        drive_by_hand.drive(ARGUMENTS, session, load_robot("so101"))
