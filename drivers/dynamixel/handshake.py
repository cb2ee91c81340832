"""Make sure that the servos on the bus are those of the robot file, set up for this driver."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from drivers.dynamixel.checks import identity_troubles, image_troubles, position_limits
from drivers.dynamixel.servo import ServoSpec
from drivers.dynamixel.tables.control_table import (
    BAUD_RATES,
    WATCHDOG_TRIPPED,
    StatusReturnLevel,
)
from drivers.dynamixel.tables.layout import Block, BlockLayout, block_of
from drivers.dynamixel.tables.registers import Registers, decode
from drivers.dynamixel.tables.settings import IMAGE_BYTES, write_differences, write_map
from drivers.errors import NoReply
from drivers.servo.baud_search import speed_remedy, where_they_answer
from drivers.servo.errors import ServoSilent, SlowAdapter, WrongServo
from drivers.servo.patience import ReplyPatience
from drivers.servo.trouble import ServoTrouble, refusals

_ECHO_MARGIN_S = 0.02
_ONCE = ReplyPatience(margin_s=0.02, attempts=1)


@dataclass(frozen=True, slots=True, kw_only=True)
class ServoSetup:
    """Hold what the handshake learned of one servo, and what it has written there."""

    firmware: int
    minimum_pulse: int
    maximum_pulse: int
    pwm_limit: int
    torque_on: bool
    error: int
    watchdog: int
    block: Block
    fast_sync: bool
    written: tuple[str, ...] = ()
    """The settings that were changed: name, old value -> new value."""

    @property
    def watchdog_tripped(self) -> bool:
        """Return whether the servo stopped by itself when its last host fell silent."""
        return self.watchdog == WATCHDOG_TRIPPED


def shake_hands(
    registers: Registers,
    servos: Sequence[ServoSpec],
    *,
    fast_sync: bool | None,
    layout: BlockLayout,
    thorough: bool,
) -> list[ServoSetup]:
    """Check adapter and servos, write settings that differ, and return what was learned.

    Torque is left as it is. `fast_sync` None uses the fast sync read wherever a servo has it.

    Raises:
        SlowAdapter: the adapter holds back what it receives.
        ServoSilent: names all servos that do not answer, and the speed at which they would; the
            first one only, unless `thorough`.
        WrongServo: names all that are not as declared, with expected and got.
        Rejected: a servo refuses a setting.
        LinkLost: the adapter is gone.
    """
    link = registers.link
    if fault := link.adapter_fault:
        raise SlowAdapter(fault)
    link.detect_echo(servos[0].id, _ECHO_MARGIN_S)
    identities = _ping_all(registers, servos, thorough=thorough)
    firmwares = [firmware for _, firmware in identities]
    _raise_refused(
        trouble
        for servo, (number, firmware) in zip(servos, identities, strict=True)
        for trouble in identity_troubles(
            servo, number, firmware, fast_sync=fast_sync, layout=layout
        )
    )
    registers.write_many("status_return_level", servos, StatusReturnLevel.ALL)
    images = [registers.read_span(servo, 0, IMAGE_BYTES) for servo in servos]
    _raise_refused(
        trouble
        for servo, image in zip(servos, images, strict=True)
        for trouble in image_troubles(servo, image)
    )
    return [
        _set_up(registers, servo, image, firmware, fast_sync=fast_sync, layout=layout)
        for servo, image, firmware in zip(servos, images, firmwares, strict=True)
    ]


def _ping_all(
    registers: Registers, servos: Sequence[ServoSpec], *, thorough: bool
) -> list[tuple[int, int]]:
    found: list[tuple[int, int]] = []
    silent: list[ServoSpec] = []
    for servo in servos:
        try:
            found.append(registers.ping(servo))
        except NoReply:
            if not thorough:
                raise
            silent.append(servo)
    if silent:
        names = ", ".join(str(servo) for servo in silent)
        raise ServoSilent(
            f"{len(silent)} of {len(servos)} servos do not answer at "
            f"{registers.link.baud} baud: {names}; " + _remedy(registers, silent)
        )
    return found


def _remedy(registers: Registers, silent: Sequence[ServoSpec]) -> str:
    found = where_they_answer(
        registers.link, silent, BAUD_RATES.values(), lambda servo: registers.ping(servo, _ONCE)
    )
    if not found:
        return "check motor power, the cable before the first of them, ids and baud rate"
    return speed_remedy(found, registers.link.baud)


def _set_up(
    registers: Registers,
    servo: ServoSpec,
    image: bytes,
    firmware: int,
    *,
    fast_sync: bool | None,
    layout: BlockLayout,
) -> ServoSetup:
    block = block_of(servo.model, firmware, layout)
    written = [*write_differences(registers, servo, image), *write_map(registers, servo, block)]
    minimum, maximum = position_limits(servo, image)
    return ServoSetup(
        firmware=firmware,
        minimum_pulse=minimum,
        maximum_pulse=maximum,
        pwm_limit=decode(servo, image, 0, "pwm_limit"),
        torque_on=bool(decode(servo, image, 0, "torque_enable")),
        error=decode(servo, image, 0, "hardware_error_status"),
        watchdog=registers.read(servo, "bus_watchdog"),
        block=block,
        fast_sync=servo.model.has_fast_sync(firmware) if fast_sync is None else fast_sync,
        written=tuple(text for text in written if text),
    )


def _raise_refused(troubles: Iterable[ServoTrouble]) -> None:
    if faults := refusals(troubles):
        raise WrongServo("\n".join(faults))
