"""Switch torque on without a jump to an old goal; switch it off whatever happens."""

from collections.abc import Mapping, Sequence
from typing import Final

from drivers.errors import DriverError, LinkLost
from drivers.feetech.link import SETUP_PATIENCE, FeetechLink, register_of
from drivers.feetech.servo import FeetechServo
from drivers.feetech.table import TorqueSwitch, hardware_errors
from drivers.servo.errors import NotKept, ServoFault, ServoSilent
from drivers.servo.patience import ReplyPatience
from drivers.servo.state import hardware_error_text

_ATTEMPTS: Final = 3
_URGENT: Final = ReplyPatience(margin_s=0.005, attempts=2)


def switch_torque_on(
    link: FeetechLink,
    servos: Sequence[FeetechServo],
    shutdown: Mapping[int, int],
    registers: Mapping[str, int],
) -> None:
    """Hold the servos where they are; on any failure switch them off again.

    A servo goes to the goal that it was given last as soon as it has torque, however old that is:
    so the present position is written first. `shutdown` says by id which errors forbid it, and
    `registers` what else each servo gets before.

    Raises:
        ServoFault: a servo reports an error that takes its torque away.
        ServoSilent: a servo does not answer.
        NotKept: a servo refuses a step.
        LinkLost: the adapter is gone.
    """
    _check_fitness(link, servos, shutdown)
    try:
        for name, value in registers.items():
            _write_kept(link, servos, name, dict.fromkeys(_ids(servos), value))
        present = _read_each(link, servos, "present_position")
        _write_kept(link, servos, "goal_position", present)
        _write_kept(link, servos, "torque_enable", dict.fromkeys(_ids(servos), TorqueSwitch.ON))
    except LinkLost:
        raise
    except DriverError:
        switch_torque_off(link, servos)
        raise


def switch_torque_off(link: FeetechLink, servos: Sequence[FeetechServo]) -> dict[int, DriverError]:
    """Switch torque off everywhere at once and return the servos that did not obey.

    Raises:
        LinkLost: the adapter is gone; the servos keep their torque and their goals.
    """
    link.write_each(servos, "torque_enable", [TorqueSwitch.FREE] * len(servos))
    torque = _read_register(link, servos, "torque_enable", _URGENT)
    failures: dict[int, DriverError] = {}
    for servo in servos:
        if torque.get(servo.id) == TorqueSwitch.FREE:
            continue
        try:
            link.write(servo, "torque_enable", TorqueSwitch.FREE, _URGENT)
        except LinkLost:
            raise
        except DriverError as error:
            failures[servo.id] = error
    return failures


def _write_kept(
    link: FeetechLink, servos: Sequence[FeetechServo], name: str, values: Mapping[int, int]
) -> None:
    wrong: list[str] = []
    for _ in range(_ATTEMPTS):
        link.write_each(servos, name, [values[servo.id] for servo in servos])
        got = _read_each(link, servos, name)
        wrong = [
            f"{servo}: {name} expected {values[servo.id]}, got {got[servo.id]}"
            for servo in servos
            if got[servo.id] != values[servo.id]
        ]
        if not wrong:
            return
    raise NotKept("; ".join(wrong) + "; check the servo's position limits and errors")


def _check_fitness(
    link: FeetechLink, servos: Sequence[FeetechServo], shutdown: Mapping[int, int]
) -> None:
    errors = _read_each(link, servos, "hardware_error_status")
    for servo in servos:
        error = hardware_errors(errors[servo.id])
        if error & shutdown[servo.id]:
            raise ServoFault(
                f"{servo}: hardware error: {hardware_error_text(error)}; remove the cause, then "
                "reboot the servo; an overload may need its power to be cut"
            )


def _ids(servos: Sequence[FeetechServo]) -> list[int]:
    return [servo.id for servo in servos]


def _read_register(
    link: FeetechLink, servos: Sequence[FeetechServo], name: str, patience: ReplyPatience
) -> dict[int, int]:
    register = register_of(servos[0], name)
    spans = link.read_spans(servos, register.address, register.size, patience)
    return {
        servo.id: register_of(servo, name).from_bytes(spans[servo.id].params)
        for servo in servos
        if servo.id in spans
    }


def _read_each(link: FeetechLink, servos: Sequence[FeetechServo], name: str) -> dict[int, int]:
    values = _read_register(link, servos, name, SETUP_PATIENCE)
    silent = [str(servo) for servo in servos if servo.id not in values]
    if silent:
        raise ServoSilent(f"no answer from {', '.join(silent)}; check power and cable")
    return values
