"""Set up new servos that are connected one after another, each behind its own port."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest

from vla_deploy.cli.devices.servo_bus import bus_of
from vla_deploy.cli.devices.servo_setup import set_up
from vla_deploy.cli.errors import CommandFailed, UsageError
from vla_deploy.cli.main import parser
from vla_deploy.robots import load_robot

from .conftest import Bus

JOINTS = ("gripper", "wrist_roll", "wrist_flex", "elbow_flex", "shoulder_lift", "shoulder_pan")


class Builder:
    """Connect what the next of `buses` has each time something is to be connected."""

    def __init__(self, port: Path, buses: Sequence[Bus | None]) -> None:
        self.port = port
        self.left = list(buses)
        self.asked: list[str] = []
        self.told: list[str] = []

    def tell(self, text: str) -> None:
        self.told.append(text)

    def wait(self, text: str, meanwhile: Callable[[], None]) -> None:
        meanwhile()
        self.asked.append(text)
        self.port.unlink(missing_ok=True)
        if (bus := self.left.pop(0)) is not None:
            self.port.symlink_to(bus.port)


@pytest.fixture
def build(tmp_path: Path) -> Callable[..., Builder]:
    def run(buses: Sequence[Bus | None], *words: str, robot: str = "so101") -> Builder:
        builder = Builder(tmp_path / "adapter", buses)
        arguments = parser().parse_args(
            ["servo", "setup", "--robot", robot, "--port", str(builder.port), "--json", *words]
        )
        try:
            set_up(arguments, bus_of(arguments), load_robot(robot), builder)
        except CommandFailed as error:
            builder.told.append(str(error))
        return builder

    return run


def test_six_new_servos_become_an_arm(make_bus: Callable[..., Any], build: Any) -> None:
    buses = [make_bus.feetech(1) for _ in JOINTS]
    builder = build(buses)
    assert [one.partition(":")[0] for one in builder.asked] == list(JOINTS)
    assert builder.told[0] == (
        "gripper: id 6 (was 1), 1000000 baud (as before); write it on the servo"
    )
    assert builder.told[-1] == "connect them all, then: vla-deploy servo scan --robot so101"
    for servo_id, bus in zip(range(6, 0, -1), buses, strict=True):
        assert bus.bank.register(servo_id, "lock") == 1


def test_a_dynamixel_gets_the_speed_of_the_bus_too(make_bus: Any, build: Any) -> None:
    bus = make_bus(1, model="XL430-W250")
    builder = build([bus], "--joint", "head_pan", robot="butler")
    assert "head_pan: id 21 (was 1), 3000000 baud (was 57600)" in builder.told[0]
    assert bus.bank.register(21, "baud_rate") == 5


def test_what_cannot_be_the_servo_is_refused_and_asked_for_again(
    make_bus: Callable[..., Any], build: Any
) -> None:
    right = make_bus.feetech(1)
    builder = build([None, make_bus.feetech(1, 2), right], "--joint", "gripper")
    assert "refused:" in builder.told[0] and "adapter" in builder.told[0]
    assert builder.told[1] == "refused: 2 servos answer, ids 1, 2; connect one alone"
    assert "gripper: id 6 (was 1)" in builder.told[2]


def test_a_servo_of_another_model_is_left_as_it_is(make_bus: Any, build: Any) -> None:
    bus = make_bus(1, model="XM430-W350")
    builder = build([bus] * 3, "--joint", "head_pan", robot="butler")
    assert "servo 1 is XM430-W350, the robot file says XL430-W250" in builder.told[0]
    assert builder.told[-1] == "not set up: head_pan; see above, then try again"
    assert bus.bank.register(1, "id") == 1


def test_the_servo_before_is_not_taken_for_the_next(make_bus: Any, build: Any) -> None:
    first, second = make_bus.feetech(1), make_bus.feetech(1)
    words = ("--joint", "gripper", "--joint", "wrist_roll")
    builder = build([first, first, second], *words)
    assert builder.told[1] == (
        "refused: servo 6 (gripper) was set up before; connect the one of wrist_roll"
    )
    assert first.bank.register(6, "id") == 6
    assert second.bank.register(5, "id") == 5


def test_a_joint_that_the_robot_lacks_is_refused(build: Any) -> None:
    with pytest.raises(UsageError, match="so101 has no servo joint tail; it has shoulder_pan"):
        build([], "--joint", "tail")
