"""Switch torque on without a bump and never without a watchdog; switch it off whatever happens."""

from collections.abc import Sequence
from typing import Final

from drivers.dynamixel.control_table import WATCHDOG_TRIPPED
from drivers.dynamixel.errors import ServoFault, ServoSilent, WatchdogTripped
from drivers.dynamixel.link import Patience
from drivers.dynamixel.registers import Registers
from drivers.dynamixel.servo import ServoSpec
from drivers.dynamixel.state import hardware_error_text
from drivers.errors import DeviceFault, DriverError, LinkLost

_URGENT: Final = Patience(margin_s=0.005, attempts=2)


def enable_torque(registers: Registers, servos: Sequence[ServoSpec], watchdog_units: int) -> None:
    """Hold the servos where they are; on any failure switch all of them off again.

    The watchdog is armed before torque comes on. It runs only with torque on, so the host has no
    moment with powered motors and no watchdog.

    Raises:
        ServoFault: a servo reports a hardware error; reboot it once the cause is gone.
        WatchdogTripped: a servo's watchdog has tripped and was not cleared.
        ServoSilent: a servo does not answer.
        Rejected: a servo refuses a step, for instance a pose outside its position limits.
        LinkLost: the adapter is gone; the watchdogs stop the servos.
    """
    for servo in servos:
        _check_fit(registers, servo)
    try:
        for servo in servos:
            registers.write(servo, "bus_watchdog", watchdog_units)
        for servo in servos:
            _hold_present_pose(registers, servo)
        _verify(registers, servos)
    except LinkLost:
        raise
    except DriverError:
        disable_torque(registers, servos)
        raise


def disable_torque(registers: Registers, servos: Sequence[ServoSpec]) -> dict[int, DriverError]:
    """Switch torque off everywhere at once, then ask each servo; return those that did not obey.

    Raises:
        LinkLost: the adapter is gone; the watchdogs stop the servos.
    """
    registers.write_many("torque_enable", servos, 0)
    failures: dict[int, DriverError] = {}
    for servo in servos:
        try:
            registers.write(servo, "torque_enable", 0, _URGENT)
        except LinkLost:
            raise
        except DriverError as error:
            failures[servo.id] = error
    return failures


def _check_fit(registers: Registers, servo: ServoSpec) -> None:
    error = registers.read(servo, "hardware_error_status")
    if error & registers.read(servo, "shutdown"):
        raise ServoFault(
            f"{servo}: hardware error: {hardware_error_text(error)}; remove the cause, "
            "then reboot the servo"
        )
    if registers.read(servo, "bus_watchdog") == WATCHDOG_TRIPPED:
        raise WatchdogTripped(
            f"{servo}: the Bus Watchdog has tripped because the bus was silent; "
            "clear the watchdog, then enable torque again"
        )


def _hold_present_pose(registers: Registers, servo: ServoSpec) -> None:
    # by sync read: being a broadcast it feeds the watchdogs of the servos that are on already
    present = registers.read_many("present_position", [servo])
    if servo.id not in present:
        raise ServoSilent(f"{servo}: no answer while torque was being enabled; check its cable")
    registers.write(servo, "goal_position", present[servo.id])
    registers.write(servo, "torque_enable", 1)


def _verify(registers: Registers, servos: Sequence[ServoSpec]) -> None:
    torque = registers.read_many("torque_enable", servos)
    watchdog = registers.read_many("bus_watchdog", servos)
    bad = [str(servo) for servo in servos if torque.get(servo.id) != 1]
    if bad:
        raise DeviceFault(f"expected torque on, got off: {', '.join(bad)}; look for faults")
    unarmed = [str(servo) for servo in servos if watchdog.get(servo.id, 0) <= 0]
    if unarmed:
        raise WatchdogTripped(
            f"expected the Bus Watchdog armed, got it off or tripped: {', '.join(unarmed)}; "
            "clear the watchdog, then enable torque again"
        )
