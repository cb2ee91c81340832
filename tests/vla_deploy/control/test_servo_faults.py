from collections.abc import Callable

import pytest

from drivers.clock import NS_PER_S
from drivers.dynamixel import DynamixelBus, ServoSpec
from drivers.servo.fault_policy import DEFAULT_RULES, FaultAction, FaultRule
from drivers.servo.hardware_error import HardwareError
from sim_twin.ports.lines import MemoryLine
from sim_twin.servos import EmulatedServoSpec
from sim_twin.servos.server import FreeServos
from vla_deploy.control.output.servo_faults import RULES, ServoFaults


class Servos:
    """Three powered servos whose bus a set of faults looks after."""

    def __init__(self, faults: ServoFaults, **eeprom: int) -> None:
        self.time_ns = NS_PER_S
        self.specs = [ServoSpec(id=n, model_name="XM430-W350", joint=f"j{n}") for n in (1, 2, 3)]
        self.free = FreeServos(
            [EmulatedServoSpec(id=n, model_name="XM430-W350", eeprom=eeprom) for n in (1, 2, 3)]
        )
        self.faults = faults
        self.run(0.05)
        self.bus = self.open()
        self.bus.enable_torque()

    def open(self) -> DynamixelBus:
        bus = DynamixelBus(
            MemoryLine(self.free.bank, self),
            self,
            self.specs,
            baud=1_000_000,
            fault_policy=self.faults.policy,
        )
        bus.connect()
        return bus

    def now_ns(self) -> int:
        return self.time_ns

    def sleep_until(self, deadline_ns: int) -> None:
        self.run((deadline_ns - self.time_ns) / NS_PER_S)

    def run(self, seconds: float) -> None:
        self.time_ns += round(seconds * NS_PER_S)
        self.free.advance_to(self.time_ns)

    def cycle(self, count: int) -> None:
        for _ in range(count):
            self.run(0.004)
            self.bus.read_state()
            self.faults.carry_out(self.bus)

    def torque(self) -> list[int]:
        return [self.free.bank.register(n, "torque_enable") for n in (1, 2, 3)]


def with_rule(bit: HardwareError, action: FaultAction) -> ServoFaults:
    return ServoFaults({**DEFAULT_RULES, bit: FaultRule(action=action, reason="for this test")})


def test_a_hot_servo_goes_limp_even_if_its_own_shutdown_does_not_do_it() -> None:
    servos = Servos(ServoFaults(), shutdown=0)
    servos.free.bank.set_alert(2, HardwareError.OVERHEATING)
    assert servos.torque() == [1, 1, 1]
    servos.cycle(20)
    assert servos.torque() == [1, 0, 1]
    assert servos.faults.newest == [
        "servo 2 (j2): overheating: limp; the motor must cool down before it may hold a load again"
    ]


@pytest.mark.parametrize("bit", [HardwareError.INPUT_VOLTAGE, HardwareError.ENCODER])
def test_what_is_logged_or_left_to_safety_is_told_and_nothing_else(bit: HardwareError) -> None:
    servos = Servos(ServoFaults(), shutdown=0)
    servos.free.bank.set_alert(2, bit)
    servos.cycle(20)
    assert servos.torque() == [1, 1, 1]
    assert len(servos.faults.newest) == 1


def reboots(servos: Servos) -> Callable[[], bool]:
    def fail_and_look() -> bool:
        servos.free.bank.set_alert(2, HardwareError.OVERLOAD)
        servos.cycle(200)
        return servos.free.bank.register(2, "hardware_error_status") == 0

    return fail_and_look


def test_a_servo_is_rebooted_once_even_if_the_bus_is_opened_anew() -> None:
    servos = Servos(with_rule(HardwareError.OVERLOAD, FaultAction.REBOOT_ONCE))
    fails_and_is_rebooted = reboots(servos)
    assert fails_and_is_rebooted()
    assert servos.torque()[1] == 0, "it does not resume by itself"
    assert not fails_and_is_rebooted()
    servos.bus.reboot(2)
    servos.cycle(100)
    servos.bus = servos.open()
    assert not fails_and_is_rebooted()
    assert servos.faults.newest[-1].endswith(
        "it was rebooted once and failed again; look at it, then reset"
    )
    servos.bus.reboot(2)
    servos.cycle(100)
    servos.faults.policy.acknowledge()
    assert fails_and_is_rebooted()


def test_on_a_robot_an_overloaded_servo_waits_for_the_operator() -> None:
    servos = Servos(ServoFaults())
    assert RULES[HardwareError.OVERLOAD].action is FaultAction.LIMP
    assert not reboots(servos)()
    assert servos.torque() == [1, 0, 1]


def test_only_the_newest_decisions_are_kept() -> None:
    servos = Servos(ServoFaults())
    for servo_id in (1, 2, 3):
        servos.free.bank.set_alert(servo_id, HardwareError.INPUT_VOLTAGE)
        servos.cycle(20)
        servos.free.bank.set_alert(servo_id, HardwareError.ENCODER)
        servos.cycle(20)
    assert [line[:12] for line in servos.faults.newest] == [
        "servo 2 (j2)",
        "servo 3 (j3)",
        "servo 3 (j3)",
    ]
