"""Own a bus' transport: know when what was sent has left and until when to wait for an answer."""

from typing import Final

from drivers.base import BurstTransport, ByteTransport, CheckedTransport, TunableTransport
from drivers.clock import NS_PER_S, Clock
from drivers.errors import LinkLost
from drivers.servo.counters import BusCounters

_BITS_PER_BYTE: Final = 10
_STALE_BYTES: Final = 4096
_STALE_READS: Final = 16
_ECHO_PATIENCE_NS: Final = 5_000_000
_WATCHFUL_SENDS: Final = 8
"""How many transactions after a missing answer look for it before they ask anew."""


class Wire:
    """Pass on every byte to and from the servos, and never wait for one without a bound.

    Once the transport is lost, every call raises LinkLost at once, without touching it again.
    """

    def __init__(
        self, transport: ByteTransport, clock: Clock, baud: int, counters: BusCounters
    ) -> None:
        self.counters = counters
        self.last_sent_ns = clock.now_ns()
        self._transport = transport
        self._clock = clock
        self._burst = transport if isinstance(transport, BurstTransport) else None
        self.baud = baud
        self.ns_per_byte = _BITS_PER_BYTE * NS_PER_S // baud
        self._sent_ns = 0
        """When the last byte handed over has left, unless an answer shows that it has."""
        self._due_ns = 0
        """When the last byte of the answer is there, if nothing is late."""
        self._answered = True
        self.echoes = False
        """The adapter hears itself; what comes back of it is taken off the line."""
        self._watchful = _WATCHFUL_SENDS
        self._lost: LinkLost | None = None

    def now_ns(self) -> int:
        """Return the time of the wire's clock."""
        return self._clock.now_ns()

    def close(self) -> None:
        """Release the transport."""
        self._transport.close()

    def set_baud(self, baud: int) -> None:
        """Go on at another speed, where the transport can; see `other_bauds`.

        Raises:
            LinkLost: the adapter is gone.
        """
        if isinstance(self._transport, TunableTransport):
            self._transport.set_baud(baud)
            self.baud = baud
            self.ns_per_byte = _BITS_PER_BYTE * NS_PER_S // baud

    @property
    def other_bauds(self) -> tuple[int, ...]:
        """Return the speeds to which the transport can be set, but for the present one."""
        if not isinstance(self._transport, TunableTransport):
            return ()
        return tuple(baud for baud in self._transport.bauds if baud != self.baud)

    @property
    def adapter_fault(self) -> str:
        """Return what slows the adapter down and how to mend it, or ""."""
        transport = self._transport
        return transport.adapter_fault() if isinstance(transport, CheckedTransport) else ""

    def send(self, frame: bytes) -> None:
        """Send a packet that nobody answers.

        Raises:
            LinkLost: the adapter is gone.
        """
        if self._lost is not None:
            raise LinkLost(f"{self._lost} (lost before)")
        if self._watchful:
            self._drop_stale_input()
        try:
            self._transport.write(frame)
        except LinkLost as error:
            raise self._note_loss(error) from error
        start_ns = self.last_sent_ns = self._clock.now_ns()
        if self._sent_ns > start_ns and not self._answered:
            start_ns = self._sent_ns
        self._sent_ns = self._due_ns = start_ns + len(frame) * self.ns_per_byte
        self._answered = False
        if self.echoes:
            self._hear_echo(frame)

    def ask(self, frame: bytes, reply_bytes: int, margin_ns: int) -> int:
        """Send a request and return until when its answer is waited for.

        Raises:
            LinkLost: the adapter is gone.
        """
        self.send(frame)
        due_ns = self._due_ns = self._sent_ns + reply_bytes * self.ns_per_byte
        return due_ns + margin_ns

    def receive_all(self, count: int, deadline_ns: int) -> bytes:
        """Return `count` bytes, or what of them came by the deadline.

        Raises:
            LinkLost: the adapter is gone.
        """
        if self._burst is None:
            data = self._receive_in_parts(count, deadline_ns)
        else:
            try:
                due_ns = self._due_ns if self._due_ns < deadline_ns else deadline_ns
                data = self._burst.read_burst(count, due_ns, deadline_ns)
            except LinkLost as error:
                raise self._note_loss(error) from error
        if len(data) == count:
            self._answered = True
        else:
            self._answered = False
            self._watchful = _WATCHFUL_SENDS
        return data

    def receive(self, max_bytes: int, deadline_ns: int) -> bytes:
        """Return what arrives by the deadline; nothing means that later bytes would be stale.

        Raises:
            LinkLost: the adapter is gone.
        """
        try:
            data = self._transport.read(max_bytes, deadline_ns)
        except LinkLost as error:
            raise self._note_loss(error) from error
        if not data:
            self._watchful = _WATCHFUL_SENDS
        return data

    def _receive_in_parts(self, count: int, deadline_ns: int) -> bytes:
        data = self.receive(count, deadline_ns)
        while len(data) < count:
            more = self.receive(count - len(data), deadline_ns)
            if not more:
                break
            data += more
        return data

    def _hear_echo(self, frame: bytes) -> None:
        wire_ns = len(frame) * self.ns_per_byte
        echo = self.receive_all(len(frame), self._clock.now_ns() + wire_ns + _ECHO_PATIENCE_NS)
        if echo != frame:  # two talked at once: what follows is framed anew
            self.counters.discarded_bytes += len(echo)
            self._watchful = _WATCHFUL_SENDS

    def _drop_stale_input(self) -> None:
        """Forget answers that came too late, or the next reply would be read one cycle old."""
        self._watchful -= 1
        try:
            for _ in range(_STALE_READS):
                stale = self._transport.read(_STALE_BYTES, self._clock.now_ns())
                if not stale:
                    return
                self._watchful = _WATCHFUL_SENDS
                self.counters.late += 1
                self.counters.discarded_bytes += len(stale)
        except LinkLost as error:
            raise self._note_loss(error) from error

    def _note_loss(self, error: LinkLost) -> LinkLost:
        self.counters.link_lost += 1
        self._lost = error
        return error
