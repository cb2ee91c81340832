"""Find what answers on a bus at one speed: servos, ids that clash, another family, noise.

All servos are asked at once first. Where that gives damaged answers, each id is asked by itself:
of two servos with one id neither is understood.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass

from drivers.errors import NoReply, ProtocolError
from drivers.servo.errors import CorruptReply, ServoSilent, WrongServo
from drivers.servo.patience import ReplyPatience
from drivers.servo.tools.bench import ONE_TRY, THREE_TRIES, FoundServo, ServoBench

Progress = Callable[[str], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class SpeedReport:
    """Hold what was found at one speed."""

    baud: int
    servos: tuple[FoundServo, ...] = ()
    clashes: tuple[int, ...] = ()
    """Ids that more than one servo has; the cable may be at fault where it spoils every answer."""
    other_family_ids: tuple[int, ...] = ()
    """Ids that answer in the language of another family."""
    noise_bytes: int = 0
    """Received bytes that made no packet, as from servos at another speed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ServoScan:
    """Hold what was found on a port at several speeds, the bus' own first.

    `declared` has joint and model of the servos that a robot file puts on the bus, by id;
    `is_complete` says that all ids were asked.
    """

    port: str
    reports: Sequence[SpeedReport]
    declared: Mapping[int, tuple[str, str]]
    is_complete: bool

    @property
    def missing(self) -> list[int]:
        """Return the declared servos that do not answer at the bus' own speed."""
        if not self.is_complete:
            return []
        own = self.reports[0]
        answered = {one.servo_id for one in own.servos} | set(own.clashes)
        return sorted(self.declared.keys() - answered)

    def fault(self) -> str:
        """Return what is wrong with the bus and what to try; "" where nothing is."""
        for report in self.reports:
            if report.clashes:
                ids = ", ".join(map(str, report.clashes))
                return (
                    f"{self.port} at {report.baud} baud: the answers of id {ids} are damaged: more "
                    "than one servo has it, or the cable is bad. Connect one of them alone and "
                    "give it a free id: vla-deploy servo set-id"
                )
        if not any(report.servos for report in self.reports):
            return self._nothing_found()
        if self.missing:
            names = ", ".join(map(self._label, self.missing))
            return (
                f"{self.port} at {self.reports[0].baud} baud: no answer from {names}; check power, "
                "cable and speed (see the table for servos at another speed)"
            )
        wrong = [
            f"{self._label(one.servo_id)} is {one.model_name}, the robot file says "
            f"{self.declared[one.servo_id][1]}"
            for one in self.reports[0].servos
            if one.servo_id in self.declared
            and not is_model(one.model_name, self.declared[one.servo_id][1])
        ]
        return f"{'; '.join(wrong)}; correct the robot file or the wiring" if wrong else ""

    def _label(self, servo_id: int) -> str:
        return f"servo {servo_id} ({self.declared[servo_id][0]})"

    def _nothing_found(self) -> str:
        for report in self.reports:
            if report.other_family_ids:
                ids = ", ".join(map(str, report.other_family_ids))
                return (
                    f"{self.port} at {report.baud} baud: id {ids} answers in another protocol: a "
                    "servo of another make (try --family), or one whose protocol_type is not 2"
                )
        for report in self.reports:
            if report.noise_bytes:
                return (
                    f"{self.port}: bytes came at {report.baud} baud, but no packet: another speed, "
                    "an adapter that echoes, or another device; check the adapter's mode"
                )
        asked = ", ".join(str(report.baud) for report in self.reports)
        return f"{self.port}: no servo answers at {asked} baud; check power, cable and port"


def is_model(found: str, declared: str) -> bool:
    """Return whether a servo is the declared one, as far as its number tells motor and gear."""
    return declared == found or declared.startswith(f"{found}-")


def scan_speed(
    link: ServoBench, ids: Sequence[int] | None = None, progress: Progress = lambda text: None
) -> SpeedReport:
    """Return what answers at the link's speed: of all ids, or of the given ones.

    Raises:
        LinkLost: the adapter is gone.
    """
    noise_bytes, doubtful = 0, True
    if ids is None:
        progress(f"{link.baud} baud: all ids at once")
        servos, noise_bytes = link.ask_everyone()
        doubtful = noise_bytes > 0 or len({one.servo_id for one in servos}) < len(servos)
        ids = link.all_ids if doubtful else sorted(one.servo_id for one in servos)
    patience = ONE_TRY if doubtful else THREE_TRIES
    found, clashes = _ask_each(link, ids, patience, progress)
    return SpeedReport(
        baud=link.baud,
        servos=tuple(found),
        clashes=tuple(clashes),
        other_family_ids=() if found or clashes else tuple(link.other_family_ids()),
        noise_bytes=0 if found or clashes else noise_bytes,
    )


def read_voltages(link: ServoBench, ids: Iterable[int]) -> dict[int, float]:
    """Return what servos measure of their supply, by id; those that do not answer are left out.

    Raises:
        LinkLost: the adapter is gone.
    """
    servos = []
    for servo_id in ids:
        with suppress(NoReply, ProtocolError, WrongServo):
            servos.append(link.servo(servo_id))
    readings = link.read_servos(servos, {}) if servos else ()
    return {reading.id: reading.voltage_v for reading in readings}


def is_taken(link: ServoBench, servo_id: int) -> bool:
    """Return whether anything answers to an id; a damaged answer counts.

    Raises:
        LinkLost: the adapter is gone.
    """
    try:
        link.ping(servo_id)
    except NoReply:
        return False
    except ProtocolError:
        return True
    return True


def _ask_each(
    link: ServoBench, ids: Iterable[int], patience: ReplyPatience, progress: Progress
) -> tuple[list[FoundServo], list[int]]:
    found, clashes = [], []
    for servo_id in ids:
        progress(f"{link.baud} baud: id {servo_id}")
        try:
            servo = link.ping(servo_id, patience)
        except ServoSilent:
            continue
        except CorruptReply:  # something answers; what it is shows next
            servo = None
        if link.is_clash(servo_id):
            clashes.append(servo_id)
        else:
            found.append(servo or link.ping(servo_id))
    return found, clashes
