"""Declare how single servos of any family are worked on at the bench, without a robot file."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Final, Protocol

from drivers.clock import NS_PER_S, Clock
from drivers.servo.counters import BusCounters
from drivers.servo.errors import ServoSilent
from drivers.servo.joint_servo import JointServo
from drivers.servo.patience import ReplyPatience
from drivers.servo.tools.gentle_drive import GentleDrive
from drivers.servo.trouble import ServoTrouble

ONE_TRY: Final = ReplyPatience(margin_s=0.02, attempts=1)
THREE_TRIES: Final = ReplyPatience(margin_s=0.02, attempts=3)
FACTORY_ID: Final = 1
"""The id of a new servo, of all families."""
_BOOT_PATIENCE_S: Final = 3.0
_BOOT_POLL_S: Final = 0.05


class Keep(Enum):
    """Name what a factory reset leaves as it is."""

    NOTHING = "nothing"
    ID = "id"
    ID_AND_BAUD = "id-and-baud"


@dataclass(frozen=True, slots=True, kw_only=True)
class FoundServo:
    """Hold what a servo says of itself; `model_name` is its number in words where it is unknown.

    Where one number stands for several motors, `model_name` is what they have in common.
    """

    servo_id: int
    model_number: int
    model_name: str
    firmware: str


@dataclass(frozen=True, slots=True, kw_only=True)
class ServoReading:
    """Hold what one servo sensed; angles are of the servo, 0 at its centre."""

    id: int
    joint: str
    model: str
    position_rad: float
    velocity_rad_s: float
    effort: float
    effort_unit: str
    voltage_v: float
    temperature_c: int
    torque_on: bool
    errors: str


@dataclass(frozen=True, slots=True, kw_only=True)
class RegisterValue:
    """Hold a register and what it holds; `initial` is the factory's, None where there is none."""

    name: str
    address: int
    size: int
    access: str
    eeprom: bool
    initial: int | None
    value: int


class ServoBench(Protocol):
    """Own the transport of a bus whose servos are not known beforehand.

    Every method may raise LinkLost, and those that ask one servo ServoSilent and CorruptReply.
    """

    @property
    def baud(self) -> int:
        """Return the speed of the line."""
        ...

    @property
    def counters(self) -> BusCounters:
        """Return what is counted on the wire."""
        ...

    @property
    def all_ids(self) -> Sequence[int]:
        """Return the ids that a servo can have."""
        ...

    @property
    def factory_baud(self) -> int:
        """Return the speed of a new servo."""
        ...

    @property
    def keeps(self) -> Collection[Keep]:
        """Return what a factory reset can leave as it is."""
        ...

    def close(self) -> None:
        """Release the transport; closing twice is allowed."""
        ...

    def detect_echo(self) -> None:
        """Find out whether the adapter hears what it sends; then its echo is left out."""
        ...

    def ping(self, servo_id: int, patience: ReplyPatience = THREE_TRIES) -> FoundServo:
        """Return what a servo says of itself."""
        ...

    def servo(self, servo_id: int, joint: str = "") -> JointServo:
        """Ask a servo for its model and return its description; `joint` is only for messages.

        Raises:
            WrongServo: the model is not known, and so its registers are not.
        """
        ...

    def ask_everyone(self) -> tuple[list[FoundServo], int]:
        """Return what answers when all are asked at once, and how many bytes were no answer."""
        ...

    def is_clash(self, servo_id: int) -> bool:
        """Return whether more than one servo answers to an id."""
        ...

    def other_family_ids(self) -> Sequence[int]:
        """Return ids that answer in the language of another family."""
        ...

    def torque_is_on(self, servo: JointServo) -> bool:
        """Return whether a servo has torque."""
        ...

    def release(self, servo: JointServo) -> None:
        """Take a servo's torque away."""
        ...

    def drive(self, servo: JointServo, torque_ratio: float) -> GentleDrive:
        """Make ready to drive a servo with a share of its torque; nothing is written yet.

        Raises:
            WrongServo: it is in no position mode, or its torque cannot be bounded.
        """
        ...

    def set_id(self, servo: JointServo, new_id: int) -> None:
        """Give a servo without torque another id, for good."""
        ...

    def set_limits(self, servo: JointServo, least: int, most: int) -> None:
        """Give a servo without torque other position limits, in pulses, for good."""
        ...

    def bauds(self, servo: JointServo) -> Collection[int]:
        """Return the speeds that a servo can be set to."""
        ...

    def set_baud(self, servo: JointServo, baud: int) -> None:
        """Give a servo without torque another speed, for good; it answers at that from now on."""
        ...

    def present_baud(self, servo: JointServo) -> int:
        """Return the speed that a servo says it is set to."""
        ...

    def hardware_error(self, servo: JointServo) -> int:
        """Return what a servo reports, as bits of `HardwareError`."""
        ...

    def reboot(self, servo: JointServo) -> None:
        """Restart a servo and wait until it answers again."""
        ...

    def factory_reset(self, servo: JointServo, keep: Keep) -> None:
        """Give a servo without torque its factory settings; `keep` is one of `keeps`."""
        ...

    def await_boot(self, servo_id: int) -> FoundServo:
        """Ping until a restarted servo answers."""
        ...

    def registers(self, servo: JointServo) -> Sequence[RegisterValue]:
        """Return every register of a servo, by address."""
        ...

    def positions(self, servos: Sequence[JointServo]) -> dict[int, int]:
        """Return the pulses of the encoders of the servos that answer, by id."""
        ...

    def examine(self, servos: Sequence[JointServo]) -> list[ServoTrouble]:
        """Compare servos with their declarations; silent ones are left out, nothing is written."""
        ...

    def homing_offsets(self, servos: Sequence[JointServo]) -> dict[int, int]:
        """Return the homing offsets that servos hold, by id, of those that answer and have one."""
        ...

    def read_servos(
        self, servos: Sequence[JointServo], joints: Mapping[int, str]
    ) -> list[ServoReading]:
        """Return the readings of the servos that answer; `joints` names joints by servo id."""
        ...


def await_boot(bench: ServoBench, clock: Clock, servo_id: int) -> FoundServo:
    """Ping until a restarted servo answers.

    Raises:
        ServoSilent: it does not come back within 3 s.
        LinkLost: the adapter is gone.
    """
    end_ns = clock.now_ns() + round(_BOOT_PATIENCE_S * NS_PER_S)
    while True:
        clock.sleep_until(clock.now_ns() + round(_BOOT_POLL_S * NS_PER_S))
        try:
            return bench.ping(servo_id, ONE_TRY)
        except ServoSilent:
            if clock.now_ns() > end_ns:
                raise
