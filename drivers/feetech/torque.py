"""Switch torque on without a jump to an old goal; switch it off whatever happens."""

from collections.abc import Mapping, Sequence
from math import ceil
from typing import Final

from drivers.errors import DriverError, LinkLost
from drivers.feetech.link import SETUP_PATIENCE, FeetechLink, register_of
from drivers.feetech.servo import FeetechServo
from drivers.feetech.settings import FeetechSetup
from drivers.feetech.table import ACCELERATION_UNIT_STEP_S2, TorqueSwitch, hardware_errors
from drivers.servo.errors import NotKept, ServoFault, ServoSilent
from drivers.servo.patience import ReplyPatience
from drivers.servo.state import hardware_error_text

HOLD_GAINS: Final[Mapping[str, int]] = {"position_p_gain": 32, "position_d_gain": 32}
"""The factory's gains. With LeRobot's P of 16 an arm rests twice as far below its goal."""
_MOTION: Final = ("acceleration", "goal_position", "goal_time", "goal_velocity", "torque_limit")
"""What a servo forgets with its power, in the order of the addresses; SCS have no torque limit."""
_ATTEMPTS: Final = 3
_MOST_ACCELERATION: Final = 254
_URGENT: Final = ReplyPatience(margin_s=0.005, attempts=2)


def switch_torque_on(
    link: FeetechLink, servos: Sequence[FeetechServo], setups: Sequence[FeetechSetup]
) -> None:
    """Hold the servos where they are; on any failure switch them off again.

    A servo goes to the goal that it was given last as soon as it has torque, however old that is:
    so the present position is written first, and with it all that makes it follow goals as this
    driver expects. The EEPROM is locked before the gains, which it keeps otherwise. A wheel begins
    at rest.

    Raises:
        ServoFault: a servo reports an error that takes its torque away, or stands outside its own
            position limits, into which it would go at full speed.
        ServoSilent: a servo does not answer.
        NotKept: a servo refuses a step.
        LinkLost: the adapter is gone.
    """
    _check_fitness(link, servos, setups)
    try:
        link.write_each(servos, "lock", [1] * len(servos))
        write_kept(link, servos, [HOLD_GAINS] * len(servos))
        present = _read_each(link, servos, "present_position")
        _check_limits(servos, setups, present)
        motion = [
            {
                **dict.fromkeys(_MOTION, 0),
                "acceleration": acceleration_units(servo),
                "goal_position": present[servo.id],
                "torque_limit": setup.torque_limit,
            }
            for servo, setup in zip(servos, setups, strict=True)
        ]
        write_kept(link, servos, motion)
        write_kept(link, servos, [{"torque_enable": TorqueSwitch.ON}] * len(servos))
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
    register = register_of(servos[0], "torque_enable")
    answers = link.read_spans(servos, register.address, register.size, _URGENT)
    failures: dict[int, DriverError] = {}
    for servo in servos:
        answer = answers.get(servo.id)
        if answer is not None and answer.params[0] == TorqueSwitch.FREE:
            continue
        try:
            link.write(servo, "torque_enable", TorqueSwitch.FREE, _URGENT)
        except LinkLost:
            raise
        except DriverError as error:
            failures[servo.id] = error
    return failures


def write_kept(
    link: FeetechLink, servos: Sequence[FeetechServo], values: Sequence[Mapping[str, int]]
) -> None:
    """Write neighbouring registers of many servos at one instant, and read back what they hold.

    Raises:
        NotKept: a servo holds another value.
        ServoSilent: a servo does not answer.
        LinkLost: the adapter is gone.
    """
    spans = [_span(servo, wanted) for servo, wanted in zip(servos, values, strict=True)]
    wrong: list[str] = []
    for _ in range(_ATTEMPTS):
        link.write_spans(servos, spans)
        answers = link.read_spans(servos, spans[0][0], len(spans[0][1]), SETUP_PATIENCE)
        _require_all(servos, answers)
        wrong = [
            f"{servo}: {', '.join(wanted)} expected {data.hex(' ')}, "
            f"got {answers[servo.id].params.hex(' ')}"
            for servo, wanted, (_, data) in zip(servos, values, spans, strict=True)
            if answers[servo.id].params != data
        ]
        if not wrong:
            return
    raise NotKept("; ".join(wrong) + "; check the servo's limits and errors")


def acceleration_units(servo: FeetechServo) -> int:
    """Return what bounds how fast a servo changes its speed; 0 is no bound, as joints have it."""
    if servo.wheel is None:
        return 0
    units = servo.wheel.acceleration_rad_s2 / servo.pulse_rad / ACCELERATION_UNIT_STEP_S2
    return min(max(1, ceil(units)), _MOST_ACCELERATION)


def _span(servo: FeetechServo, values: Mapping[str, int]) -> tuple[int, bytes]:
    """Return where the registers that a servo has begin, and their bytes."""
    registers = [
        servo.datasheet.registers[name] for name in values if name in servo.datasheet.registers
    ]
    data = b"".join(register.to_bytes(values[register.name]) for register in registers)
    return registers[0].address, data


def _check_fitness(
    link: FeetechLink, servos: Sequence[FeetechServo], setups: Sequence[FeetechSetup]
) -> None:
    errors = _read_each(link, servos, "hardware_error_status")
    for servo, setup in zip(servos, setups, strict=True):
        error = hardware_errors(errors[servo.id])
        if error & setup.shutdown:
            raise ServoFault(
                f"{servo}: hardware error: {hardware_error_text(error)}; remove the cause, then "
                "reboot the servo; an overload may need its power to be cut"
            )


def _check_limits(
    servos: Sequence[FeetechServo], setups: Sequence[FeetechSetup], present: Mapping[int, int]
) -> None:
    for servo, setup in zip(servos, setups, strict=True):
        if servo.wheel is not None:
            continue
        if not setup.minimum_pulse <= present[servo.id] <= setup.maximum_pulse:
            raise ServoFault(
                f"{servo}: stands at {present[servo.id]}, outside its own position limits "
                f"{setup.minimum_pulse}..{setup.maximum_pulse}, and would go there at full speed; "
                "move it inside by hand, or write other limits to registers 9 and 11"
            )


def _read_each(link: FeetechLink, servos: Sequence[FeetechServo], name: str) -> dict[int, int]:
    register = register_of(servos[0], name)
    answers = link.read_spans(servos, register.address, register.size, SETUP_PATIENCE)
    _require_all(servos, answers)
    return {
        servo.id: register_of(servo, name).from_bytes(answers[servo.id].params) for servo in servos
    }


def _require_all(servos: Sequence[FeetechServo], answers: Mapping[int, object]) -> None:
    silent = [str(servo) for servo in servos if servo.id not in answers]
    if silent:
        raise ServoSilent(f"no answer from {', '.join(silent)}; check power and cable")
