"""Emulate the servos of one bus, whatever their family: bytes, time, shafts and faults.

A family brings its parser, its protocol and its firmware; what those three must offer is declared
here.
"""

from collections.abc import Sequence
from typing import Final, Generic, Protocol, TypeVar

from sim_twin.servos.firmware.profile import Floats
from sim_twin.servos.firmware.rail import SupplyVolts
from sim_twin.servos.protocol.audience import BusAudience
from sim_twin.servos.protocol.timing import Reply, ReplyQueue, WireTiming
from sim_twin.servos.protocol.wire_faults import ReplySpoiler, WireFaults

_PACKET_GAP_NS: Final = 1_500_000
"""A pause within an instruction packet after which a servo looks for a new header."""

RequestT = TypeVar("RequestT")
TakenT = TypeVar("TakenT", contravariant=True)
FoundT = TypeVar("FoundT", covariant=True)


class BankParser(Protocol[FoundT]):
    """Find requests in a stream of bytes."""

    @property
    def pending_bytes(self) -> int:
        """Return how many bytes wait for the rest of their packet."""
        ...

    def feed(self, data: bytes) -> Sequence[FoundT]:
        """Take bytes and return the requests that they complete."""
        ...

    def reset(self) -> None:
        """Drop what is unfinished."""
        ...


class BankProtocol(Protocol[TakenT]):
    """Carry out requests; hold who hears them and which faults the wire has."""

    @property
    def audience(self) -> BusAudience:
        """Return the ids of the bus and who hears nothing."""
        ...

    @property
    def faults(self) -> WireFaults:
        """Return what spoils replies."""
        ...

    def execute(self, packet: TakenT, /) -> Sequence[Reply]:
        """Return what the servos answer to a request."""
        ...

    def freeze(self, row: int, /) -> None:
        """Let a servo show for ever what it senses now."""
        ...


class BankFirmware(Protocol):
    """Run all servos of a bus; a row is a servo's place in the order of the specs."""

    @property
    def supply_w(self) -> float:
        """Return the power that the motors draw."""
        ...

    def set_time(self, now_ns: int) -> None:
        """Take over the time."""
        ...

    def advance(
        self, now_ns: int, joint_motion: Floats, joint_effort: Floats, supply_v: SupplyVolts
    ) -> Floats:
        """Run the control loops and return each motor's duty."""
        ...

    def couple_anew(self) -> None:
        """Take over a change of the coupling."""
        ...

    def present(self, row: int, name: str) -> int:
        """Return a register's value, up to date."""
        ...

    def raise_errors(self, row: int, bits: int) -> None:
        """Set bits of `HardwareError`, with what follows from them."""
        ...

    def heat(self, row: int, celsius: float) -> None:
        """Bring a servo to a temperature."""
        ...

    def force_overload(self, row: int, *, on: bool) -> None:
        """Let a servo count as overloaded, or no longer."""
        ...


class WireBank(Generic[RequestT]):
    """Be the servos of one bus: bytes on the line on one side, shafts on the other.

    `advance` is called once per physics step. `step` only takes over the time, for a bus whose
    shafts nobody moves and for times between two physics steps. With `timing` bytes take their time
    on the wire; without it a reply is there at once.
    """

    def __init__(
        self,
        firmware: BankFirmware,
        protocol: BankProtocol[RequestT],
        parser: BankParser[RequestT],
        timing: WireTiming | None,
    ) -> None:
        self._firmware = firmware
        self._protocol = protocol
        self._audience = protocol.audience
        self._faults = protocol.faults
        self._parser = parser
        self._queue = ReplyQueue(timing)
        self._echo = False
        self._now_ns = 0
        self._received_ns = 0

    @property
    def paced(self) -> bool:
        """Return whether bytes take time on this bus."""
        return self._queue.paced

    @property
    def supply_w(self) -> float:
        """Return the power that the motors draw, as of the firmware's last look."""
        return self._firmware.supply_w

    def receive(self, data: bytes) -> None:
        """Take bytes that the host has put on the bus."""
        now_ns = self._now_ns
        if self._parser.pending_bytes and now_ns - self._received_ns > _PACKET_GAP_NS:
            self._parser.reset()
        self._received_ns = now_ns
        self._queue.hear(data, now_ns, echo=self._echo)
        for packet in self._parser.feed(data):
            self._queue.say(self._protocol.execute(packet), now_ns)

    def transmit(self) -> bytes:
        """Return and forget the replies that have arrived at the host."""
        return self._queue.ready(self._now_ns)

    def next_due_ns(self) -> int | None:
        """Return when the next bytes arrive at the host; None when nothing is under way."""
        return self._queue.next_due_ns()

    def step(self, now_ns: int) -> None:
        """Take over the time, with what the firmware does at times of its own."""
        if now_ns > self._now_ns:
            self._now_ns = now_ns
            self._firmware.set_time(now_ns)

    def set_host_baud(self, baud: int | None) -> None:
        """Take over the rate at which the host talks; a servo set to another one hears nothing.

        With None, which is so at first, every servo understands the host.
        """
        if baud == self._audience.host_baud:
            return
        self._audience.host_baud = baud
        self._audience.tune()
        if baud is not None:
            self._queue.set_baud(baud)

    def advance(
        self,
        now_ns: int,
        joint_motion: Floats,
        joint_effort: Floats,
        supply_v: SupplyVolts = 12.0,
    ) -> Floats:
        """Return what the joints do; return each motor's duty, -1..1, until the next call.

        Arrays are in the order of the servos; a shaft at 0 rad is in the middle of its turn.
        `joint_motion` has a row of positions and one of speeds. They, duty and effort, which is the
        motor's torque in N m, are the joint's, and by default that is the shaft. Duty is zero
        without torque. A supply below `brownout_v` of the options switches its servos off.
        """
        if now_ns > self._now_ns:
            self._now_ns = now_ns
        return self._firmware.advance(now_ns, joint_motion, joint_effort, supply_v)

    def couple_anew(self) -> None:
        """Take over a change of the coupling that was given."""
        self._firmware.couple_anew()

    def register(self, servo_id: int, name: str) -> int:
        """Return a register's present value without using the bus."""
        return self._firmware.present(self._row(servo_id), name)

    # Faults. Each lasts until it is taken back, but for `corrupt_next` and `set_alert`.

    def silence(self, servo_id: int, *, silent: bool = True) -> None:
        """Cut a servo off the bus, as a broken cable does; its motor goes on."""
        self._mark(self._audience.cut_off, servo_id, on=silent)

    def set_wrong_baud(self, servo_id: int, on: bool = True) -> None:
        """Let a servo talk at another rate than the host: it neither understands nor answers."""
        self._mark(self._audience.mistuned, servo_id, on=on)

    def corrupt_next(self, servo_id: int) -> None:
        """Spoil the check sum of this servo's next reply."""
        self._faults.corrupted.add(self._row(servo_id))

    def set_alert(self, servo_id: int, bits: int) -> None:
        """Raise bits of `HardwareError`, with what the shutdown register makes of them."""
        self._firmware.raise_errors(self._row(servo_id), bits)

    def heat(self, servo_id: int, celsius: float) -> None:
        """Bring a servo to a temperature; it cools from there."""
        self._firmware.heat(self._row(servo_id), celsius)

    def overload(self, servo_id: int, on: bool = True) -> None:
        """Let a servo count as overloaded whatever it carries, or no longer."""
        self._firmware.force_overload(self._row(servo_id), on=on)

    def garble(self, servo_id: int, on: bool = True, *, seed: int = 0) -> None:
        """Damage one byte of every reply of this servo."""
        self._spoil(servo_id, ReplySpoiler.GARBLE, on=on, seed=seed)

    def truncate(self, servo_id: int, on: bool = True, *, seed: int = 0) -> None:
        """Lose the end of every reply of this servo."""
        self._spoil(servo_id, ReplySpoiler.TRUNCATE, on=on, seed=seed)

    def duplicate(self, servo_id: int, on: bool = True) -> None:
        """Let this servo say everything twice."""
        self._spoil(servo_id, ReplySpoiler.DUPLICATE, on=on)

    def set_clash(self, servo_id: int, on: bool = True, *, seed: int = 0) -> None:
        """Let a second servo answer to this id at the same time: all of it becomes garbage."""
        self._spoil(servo_id, ReplySpoiler.CLASH, on=on, seed=seed)

    def stick(self, servo_id: int, on: bool = True) -> None:
        """Let this servo show for ever what it senses now."""
        if on:
            self._protocol.freeze(self._row(servo_id))
        else:
            self._faults.frozen.pop(self._row(servo_id), None)

    def answer_as(self, servo_id: int, other_id: int | None) -> None:
        """Let this servo put another id into its replies; None ends it."""
        self._faults.set_alias(self._row(servo_id), other_id)

    def delay(self, servo_id: int, seconds: float) -> None:
        """Let every reply of this servo come later by this time; 0 ends it."""
        self._faults.set_delay(self._row(servo_id), seconds)

    def drop_ratio(self, servo_id: int, ratio: float, seed: int = 0) -> None:
        """Lose this share of the servo's replies; 0 ends it."""
        self._faults.set_loss(self._row(servo_id), ratio, seed)

    def set_echo(self, on: bool = True) -> None:
        """Let the adapter hear its own bytes, as a half-duplex one without a switch does."""
        self._echo = on

    def noise(self, on: bool = True, seed: int = 0) -> None:
        """Put a few random bytes before every reply."""
        self._faults.set_noise(on=on, seed=seed)

    def _spoil(self, servo_id: int, spoiler: ReplySpoiler, *, on: bool, seed: int = 0) -> None:
        self._faults.set_spoiler(self._row(servo_id), spoiler, on=on, seed=seed)

    def _mark(self, rows: set[int], servo_id: int, *, on: bool) -> None:
        (rows.add if on else rows.discard)(self._row(servo_id))
        self._audience.tune()

    def _row(self, servo_id: int) -> int:
        rows = self._audience.rows
        if servo_id not in rows:
            raise KeyError(f"no servo has the id {servo_id}; there are {sorted(rows)}")
        return rows[servo_id]
