"""Two servos on one joint: commanded together, read as one, kept from pushing at each other."""

from collections.abc import Iterator

import numpy as np
import pytest

from drivers.clock import NS_PER_S
from drivers.dynamixel import DynamixelBus
from drivers.dynamixel.servo import ServoSpec
from drivers.servo.errors import WrongServo
from drivers.servo.shadowed_bus import ShadowedBus
from sim_twin.ports.lines import MemoryLine
from sim_twin.servos import EmulatedServoSpec
from sim_twin.servos.server import FreeServos

MODEL = "XM430-W350"
LEADER, ALONE, SHADOW = 2, 1, 3
"""Ids; the joints are those of 1 and 2, in this order."""
READY = {"return_delay_time": 0}


class SteppedClock:
    """A clock that servos and driver share; it moves when it is told to."""

    def __init__(self) -> None:
        self.ns = NS_PER_S

    def now_ns(self) -> int:
        return self.ns

    def sleep_until(self, deadline_ns: int) -> None:
        self.ns = max(self.ns, deadline_ns)


class Joints:
    """A joint with one servo and a joint with two, whose shafts here are free of each other."""

    def __init__(self, secondary_id: int = 255) -> None:
        self.clock = SteppedClock()
        eeproms = {ALONE: READY, LEADER: READY, SHADOW: {**READY, "secondary_id": secondary_id}}
        self.free = FreeServos(
            [
                EmulatedServoSpec(id=one, model_name=MODEL, eeprom=eeprom)
                for one, eeprom in eeproms.items()
            ]
        )
        self.free.advance_to(self.clock.ns)
        specs = [
            ServoSpec(id=ALONE, model_name=MODEL, joint="waist"),
            ServoSpec(id=LEADER, model_name=MODEL, joint="shoulder"),
            ServoSpec(id=SHADOW, model_name=MODEL, joint="shoulder_shadow", sign=-1),
        ]
        line = MemoryLine(self.free.bank, self.clock)
        inner = DynamixelBus(line, self.clock, specs, baud=1_000_000, watchdog_s=0.5)
        self.bus = ShadowedBus(inner, [1])

    def turn(self, *shafts_rad: float) -> None:
        self.free.rotors.position_rad[:] = shafts_rad

    def cycle(self, times: int = 1, goals: tuple[float, float] | None = None) -> None:
        for _ in range(times):
            self.clock.ns += 4_000_000
            self.free.advance_to(self.clock.ns)
            self.state = self.bus.read_state()
            if goals is not None:
                self.bus.write_goals(np.array(goals))


@pytest.fixture
def joints() -> Iterator[Joints]:
    made = Joints()
    made.bus.connect()
    yield made
    made.bus.close()


def test_both_servos_turn_the_joint_to_its_goal_each_in_its_own_direction(joints: Joints) -> None:
    joints.turn(0.1, 0.2, -0.23)  # the shadow's horn sits 0.03 rad beside its leader's
    joints.cycle(10)
    joints.bus.enable_torque()
    joints.cycle(200, goals=(0.4, 0.5))
    assert [servo.joint for servo in joints.bus.servos] == ["waist", "shoulder"]
    assert joints.state.position_rad == pytest.approx([0.4, 0.5], abs=0.005)
    assert joints.free.rotors.position_rad == pytest.approx([0.4, 0.5, -0.53], abs=0.005)
    assert joints.state.torque_on.tolist() == [True, True]
    assert joints.bus.disable_torque([LEADER]) == {}
    assert [joints.free.bank.register(one, "torque_enable") for one in (1, 2, 3)] == [1, 0, 0]


def test_servos_that_stand_too_far_apart_are_not_held_together(joints: Joints) -> None:
    joints.turn(0.0, 0.2, -0.35)
    joints.cycle(10)
    with pytest.raises(WrongServo, match=r"servo 3 .*stands \+0\.15.*set its offset .* -0\.15"):
        joints.bus.enable_torque([LEADER])
    assert joints.free.bank.register(SHADOW, "torque_enable") == 0
    joints.bus.enable_torque([ALONE])


def test_the_worse_of_two_servos_counts_for_their_joint(joints: Joints) -> None:
    joints.cycle(30)
    joints.bus.enable_torque()
    joints.free.bank.set_alert(SHADOW, 32)
    joints.cycle(10, goals=(0.0, 0.0))
    assert joints.state.error.tolist() == [0, 32]
    assert joints.state.torque_on.tolist() == [True, False]
    joints.bus.reboot(LEADER)  # only the one that reports an error
    joints.cycle(200, goals=(0.0, 0.0))
    assert joints.state.error.tolist() == [0, 0]
    assert joints.free.bank.register(LEADER, "torque_enable") == 1
    joints.free.bank.silence(SHADOW)
    joints.cycle(3)
    assert joints.state.valid.tolist() == [True, False]


def test_a_servo_that_obeys_another_id_is_refused() -> None:
    joints = Joints(secondary_id=LEADER)
    with pytest.raises(WrongServo, match=r"servo 3 .*expected secondary_id 255, got 2"):
        joints.bus.connect()
