"""Switch torque on without a bump and never without a watchdog; switch it off whatever happens.

All servos are addressed at once and then asked what they made of it. That takes some ten
transactions however many servos there are, short enough to do between two control ticks; and a sync
read or write, being a broadcast, feeds the Bus Watchdog of every servo meanwhile.
"""

from collections.abc import Mapping, Sequence
from typing import Final

from drivers.dynamixel.errors import WatchdogTripped
from drivers.dynamixel.servo import ServoSpec
from drivers.dynamixel.tables.control_table import WATCHDOG_TRIPPED
from drivers.dynamixel.tables.registers import Registers, decode
from drivers.errors import DriverError, LinkLost
from drivers.servo.errors import NotKept, ServoFault, ServoSilent
from drivers.servo.patience import ReplyPatience
from drivers.servo.state import hardware_error_text

HOLD_GAINS: Final = {"position_p_gain": 1600, "position_i_gain": 0, "position_d_gain": 8000}
"""Written whenever a servo is powered, since a reboot forgets them.

P is what the gravity offset reckons with. With the factory's 800 and no D a loaded elbow rings for
half a second after a stop; with these it stands in half of that, and trails its setpoint half as
far.
"""
_ATTEMPTS: Final = 3
_URGENT: Final = ReplyPatience(margin_s=0.005, attempts=2)
_FITNESS_START: Final = 63  # shutdown .. bus_watchdog
_FITNESS_BYTES: Final = 36


def enable_torque(registers: Registers, servos: Sequence[ServoSpec], watchdog_units: int) -> None:
    """Hold the servos where they are; on any failure switch those off again that were off before.

    A servo that holds already goes on holding: what it carries would fall. The others get torque
    only with an armed watchdog.

    Raises:
        ServoFault: a servo reports a hardware error; reboot it once the cause is gone.
        WatchdogTripped: a servo's watchdog has tripped and was not cleared.
        ServoSilent: a servo does not answer.
        NotKept: a servo refuses a step, for instance a pose outside its position limits.
        LinkLost: the adapter is gone; the watchdogs stop the servos.
    """
    holding = _check_fitness(registers, servos)
    try:
        write_kept(registers, "bus_watchdog", servos, dict.fromkeys(_ids(servos), watchdog_units))
        present = _read_all(registers, "present_position", servos)
        write_kept(registers, "goal_position", servos, present)
        write_kept(registers, "torque_enable", servos, dict.fromkeys(_ids(servos), 1))
    except LinkLost:
        raise
    except DriverError:
        disable_torque(registers, [servo for servo in servos if servo.id not in holding])
        raise


def disable_torque(registers: Registers, servos: Sequence[ServoSpec]) -> dict[int, DriverError]:
    """Switch torque off everywhere at once and return the servos that did not obey.

    Raises:
        LinkLost: the adapter is gone; the watchdogs stop the servos.
    """
    registers.write_many("torque_enable", servos, 0)
    torque = registers.read_many("torque_enable", servos, _URGENT)
    failures: dict[int, DriverError] = {}
    for servo in servos:
        if torque.get(servo.id) == 0:
            continue
        try:
            registers.write(servo, "torque_enable", 0, _URGENT)
        except LinkLost:
            raise
        except DriverError as error:
            failures[servo.id] = error
    return failures


def write_kept(
    registers: Registers, name: str, servos: Sequence[ServoSpec], values: Mapping[int, int]
) -> None:
    """Write a register of many servos, by id, and read back until all have kept it.

    Raises:
        ServoSilent: a servo does not answer.
        NotKept: a servo holds another value after three attempts.
        LinkLost: the adapter is gone.
    """
    wrong: list[str] = []
    for _ in range(_ATTEMPTS):
        registers.write_each(name, servos, values)
        got = _read_all(registers, name, servos)
        wrong = [
            f"{servo}: {name} expected {values[servo.id]}, got {got[servo.id]}"
            for servo in servos
            if got[servo.id] != values[servo.id]
        ]
        if not wrong:
            return
    raise NotKept(
        "; ".join(wrong) + "; check the servo's limit registers, hardware error and watchdog"
    )


def _ids(servos: Sequence[ServoSpec]) -> list[int]:
    return [servo.id for servo in servos]


def _read_all(registers: Registers, name: str, servos: Sequence[ServoSpec]) -> dict[int, int]:
    values = registers.read_many(name, servos)
    _require_all(values, servos)
    return values


def _require_all(answers: Mapping[int, object], servos: Sequence[ServoSpec]) -> None:
    silent = [str(servo) for servo in servos if servo.id not in answers]
    if silent:
        raise ServoSilent(f"no answer from {', '.join(silent)}; check power and cable")


def _check_fitness(registers: Registers, servos: Sequence[ServoSpec]) -> frozenset[int]:
    """Return the ids of those that hold torque already."""
    spans = registers.read_span_many(servos, _FITNESS_START, _FITNESS_BYTES)
    _require_all(spans, servos)
    for servo in servos:
        span = spans[servo.id]
        error = decode(servo, span, _FITNESS_START, "hardware_error_status")
        if error & decode(servo, span, _FITNESS_START, "shutdown"):
            raise ServoFault(
                f"{servo}: hardware error: {hardware_error_text(error)}; remove the cause, "
                "then reboot the servo"
            )
        if decode(servo, span, _FITNESS_START, "bus_watchdog") == WATCHDOG_TRIPPED:
            raise WatchdogTripped(
                f"{servo}: the Bus Watchdog has tripped because the bus was silent; "
                "clear the watchdog, then enable torque again"
            )
    return frozenset(
        servo.id
        for servo in servos
        if decode(servo, spans[servo.id], _FITNESS_START, "torque_enable")
    )
