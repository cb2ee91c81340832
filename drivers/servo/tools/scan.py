"""Find what answers on a bus at one speed: servos, ids that clash, another family, noise.

All servos are asked at once first. Where that gives damaged answers, each id is asked by itself:
of two servos with one id neither is understood.
"""

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from drivers.errors import NoReply, ProtocolError
from drivers.servo.errors import CorruptReply, ServoSilent
from drivers.servo.patience import ReplyPatience
from drivers.servo.tools.bench import (
    FACTORY_ID,
    ONE_TRY,
    THREE_TRIES,
    FoundServo,
    ServoBench,
)
from drivers.servo.trouble import ServoTrouble, TroubleLevel

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
        return "\n".join(map(str, self.troubles()))

    def troubles(self) -> list[ServoTrouble]:
        """Return what is wrong with the bus: who shares an id, is silent, or is another model."""
        if not any(report.servos or report.clashes for report in self.reports):
            return [self._nothing_found()]
        return [*self._clashes(), *self._silent(), *self._other_models()]

    def strays(self) -> list[ServoTrouble]:
        """Return the servos that answer at the bus' own speed and that no joint has."""
        if not self.declared:
            return []
        strays = [one for one in self.reports[0].servos if one.servo_id not in self.declared]
        return [
            ServoTrouble(
                measured=f"servo {one.servo_id}, {one.model_name}, answers, but the robot file has "
                "no servo of this id",
                remedy=self._setup_remedy(one.servo_id) or "name it there, or disconnect it",
                level=TroubleLevel.NOTE,
            )
            for one in strays
        ]

    def _clashes(self) -> Iterator[ServoTrouble]:
        for report in self.reports:
            if report.clashes:
                ids = ", ".join(map(str, report.clashes))
                setup = next(filter(None, map(self._setup_remedy, report.clashes)), "")
                yield ServoTrouble(
                    measured=f"{self.port} at {report.baud} baud: the answers of id {ids} are "
                    "damaged: more than one servo has it, or the cable is bad",
                    remedy="connect one of them alone and give it a free id: `vla-deploy servo "
                    f"set-id`{'; ' * bool(setup)}{setup}",
                )

    def _setup_remedy(self, servo_id: int) -> str:
        """Return what to do about an id that a servo has which was never given its own."""
        if servo_id != FACTORY_ID or not self.missing:
            return ""
        joints = [self.declared[one][0] for one in self.missing]
        return (
            f"id {FACTORY_ID} is the factory's: where it is that of {' or '.join(joints)}, "
            f"connect it alone: `vla-deploy servo setup --joint {joints[0]}`"
        )

    def _silent(self) -> Iterator[ServoTrouble]:
        own = self.reports[0].baud
        elsewhere = {
            one.servo_id: report.baud for report in self.reports[1:] for one in report.servos
        }
        silent = [one for one in self.missing if one not in elsewhere]
        if silent:
            yield ServoTrouble(
                measured=f"{self.port} at {own} baud: no answer from "
                f"{', '.join(map(self._label, silent))}",
                remedy="check power, cable and id (one of another voltage is silent, too)",
            )
        for one in self.missing:
            if one in elsewhere:
                yield ServoTrouble(
                    measured=f"{self.port}: no answer at {own} baud from {self._label(one)}, but "
                    f"at {elsewhere[one]} baud",
                    remedy=f"`vla-deploy servo set-baud {own} {one} --baud {elsewhere[one]}`",
                )

    def _other_models(self) -> Iterator[ServoTrouble]:
        for one in self.reports[0].servos:
            joint, model = self.declared.get(one.servo_id, ("", one.model_name))
            if joint and not is_model(one.model_name, model):
                yield ServoTrouble(
                    measured=f"{self._label(one.servo_id)} is {one.model_name}, the robot file "
                    f"says {model}",
                    remedy="correct the robot file or the wiring",
                )

    def _label(self, servo_id: int) -> str:
        return f"servo {servo_id} ({self.declared[servo_id][0]})"

    def _nothing_found(self) -> ServoTrouble:
        for report in self.reports:
            if report.other_family_ids:
                ids = ", ".join(map(str, report.other_family_ids))
                return ServoTrouble(
                    measured=f"{self.port} at {report.baud} baud: id {ids} answers in another "
                    "protocol: a servo of another make, or one whose protocol_type is not 2",
                    remedy="try --family, or correct the models in the robot file",
                )
        for report in self.reports:
            if report.noise_bytes:
                return ServoTrouble(
                    measured=f"{self.port}: bytes came at {report.baud} baud, but no packet",
                    remedy="another speed, an adapter that echoes, or another device; check the "
                    "adapter's mode",
                )
        asked = ", ".join(str(report.baud) for report in self.reports)
        return ServoTrouble(
            measured=f"{self.port}: no servo answers at {asked} baud",
            remedy="check power, cable and port",
        )


def is_model(found: str, declared: str) -> bool:
    """Return whether a servo is the declared one, as far as its number tells motor and gear."""
    return declared == found or declared.startswith(f"{found}-")


def scan_speed(
    link: ServoBench,
    ids: Sequence[int] | None = None,
    progress: Progress = lambda text: None,
    expected: Collection[int] = (),
) -> SpeedReport:
    """Return what answers at the link's speed: of all ids, or of the given ones.

    The `expected` are asked by themselves, too: not every model answers a question to all.

    Raises:
        LinkLost: the adapter is gone.
    """
    noise_bytes, doubtful = 0, True
    if ids is None:
        progress(f"{link.baud} baud: all ids at once")
        servos, noise_bytes = link.ask_everyone()
        doubtful = noise_bytes > 0 or len({one.servo_id for one in servos}) < len(servos)
        answered = {one.servo_id for one in servos}
        ids = link.all_ids if doubtful else sorted(answered | {*expected})
    patience = ONE_TRY if doubtful else THREE_TRIES
    found, clashes = _ask_each(link, ids, patience, progress)
    return SpeedReport(
        baud=link.baud,
        servos=tuple(found),
        clashes=tuple(clashes),
        other_family_ids=() if found or clashes else tuple(link.other_family_ids()),
        noise_bytes=0 if found or clashes else noise_bytes,
    )


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
