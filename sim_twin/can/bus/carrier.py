"""Carry frames over a wire one after the other: arbitration, timing, errors, retransmission."""

from collections import deque
from dataclasses import dataclass
from typing import Final

import can

from drivers.clock import NS_PER_S
from sim_twin.can.bus.error_frames import BUS_ERROR, NO_ACKNOWLEDGEMENT, PROTOCOL
from sim_twin.can.bus.frame_bits import (
    ERROR_FRAME_BITS,
    HEADER_BITS,
    INTERMISSION_BITS,
    RECOVERY_BITS,
    SUSPEND_BITS,
    frame_bits,
)
from sim_twin.can.bus.frame_tamper import FrameTamper
from sim_twin.can.bus.station import Station
from sim_twin.can.bus.stations import Stations, arbitrate, clash

# An error passive controller whom nobody hears tries for ever; that it does so often shows nowhere.
UNHEARD_RETRY_NS: Final = 1_000_000


@dataclass(slots=True)
class _Attempt:
    """Be one attempt to send a frame; an error class of 0 goes well."""

    frame: can.Message
    senders: list[Station]
    error_class: int
    flagging: Station | None
    end_ns: int = 0
    free_ns: int = 0

    @property
    def fails_early(self) -> bool:
        """Return whether the error is found in the frame's head and not by its CRC or ACK."""
        return bool(self.error_class) and (self.flagging is not None or len(self.senders) > 1)


class FrameCarrier:
    """Hold the state of one wire.

    While it is sound, it is not timed or cut, nobody has met an error, nothing is tampered with and
    no frame waits: each frame then reaches all others at once, and most of the model is not needed.
    """

    def __init__(self, *, bitrate: int, timed: bool, restart_s: float | None) -> None:
        self.bitrate = bitrate
        self._timed = timed
        self.frames_carried = 0
        self.frames_destroyed = 0
        self.frames_lost = 0
        self._restart_s = restart_s
        self._stations = Stations()
        self._tamper = FrameTamper()
        self._babbler: Station | None = None
        self._on_wire: _Attempt | None = None
        self._delayed: deque[tuple[int, _Attempt]] = deque()
        self._now_ns = 0
        self._free_ns = 0
        self._until_ns = 0
        self._sound = not timed
        self._running = False

    @property
    def timed(self) -> bool:
        """Return whether a frame takes the time of its bits."""
        return self._timed

    @timed.setter
    def timed(self, timed: bool) -> None:
        self._timed = timed
        self._sound = False  # the next `poll` finds out whether it is

    @property
    def now_ns(self) -> int:
        """Return the time that the wire has reached."""
        return self._now_ns

    def poll(self, now_ns: int) -> None:
        """Carry what is due at `now_ns`; time never goes back."""
        if self._sound:
            self._now_ns = max(self._now_ns, now_ns)
            return
        self._recover(now_ns)
        self._run(now_ns)
        while self._delayed and self._delayed[0][0] <= now_ns:
            due_ns, attempt = self._delayed.popleft()
            self._now_ns = max(self._now_ns, due_ns)
            self._hand_over(attempt)
        self._now_ns = max(self._now_ns, now_ns)
        self._run(now_ns)
        self._inspect()

    def next_due_ns(self) -> int | None:
        """Return when `poll` has something to do, or None where only a new frame brings work."""
        stations = self._stations.all()
        due = [station.restart_ns for station in stations if station.restart_ns is not None]
        due += [due_ns for due_ns, _ in self._delayed]
        if self._on_wire is not None:
            due.append(self._on_wire.end_ns)
        else:
            due += [max(self._free_ns, station.ready_ns) for station in self._stations.waiting()]
        return min(due, default=None)

    def _run(self, until_ns: int) -> None:
        if self._running:
            return
        self._running = True
        self._until_ns = until_ns
        try:
            self._carry_at_once()
            while not self._sound and self._finish(until_ns) and self._begin(until_ns):
                pass
        finally:
            self._running = False

    def _carry_at_once(self) -> None:
        """Carry all frames while nothing takes time and nobody has met an error.

        Everything else, such as two senders of one identifier, is left to the full model.
        """
        while self._sound and (waiting := self._stations.waiting()):
            senders = arbitrate(waiting) if len(waiting) > 1 else waiting
            sender = senders[0]
            if len(senders) > 1 or not sender.is_heard or sender.queue[0].is_fd:
                self._sound = False
                return
            frame = sender.queue.popleft()
            self.frames_carried += 1
            for station in sender.others:
                station.receive(frame)

    def _inspect(self) -> None:
        """Find out whether the full model is needed any longer."""
        if self._timed or self._stations.cut:
            return
        idle = self._on_wire is None and self._babbler is None and not self._delayed
        self._sound = idle and self._tamper.idle and self._stations.sound()

    def _begin(self, until_ns: int) -> bool:
        waiting = self._stations.waiting()
        if not waiting:
            return False
        start_ns = max(self._free_ns, min([station.ready_ns for station in waiting]))
        if start_ns > until_ns:
            return False
        self._now_ns = max(self._now_ns, start_ns)
        senders = arbitrate([station for station in waiting if station.ready_ns <= start_ns])
        error_class, flagging = self._judge(senders)
        self._on_wire = attempt = _Attempt(senders[0].queue[0], senders, error_class, flagging)
        self._time(attempt, start_ns)
        return True

    def _judge(self, senders: list[Station]) -> tuple[int, Station | None]:
        """Return the class of the error that ends this attempt, and who flags it before all."""
        if len(senders) > 1 and self._clash(senders):
            return PROTOCOL, None
        sender, listeners = senders[0], self._stations.listeners(senders)
        if sender.wrong_bitrate or sender.queue[0].is_fd:
            return PROTOCOL, sender
        misled = [each for each in listeners if each.wrong_bitrate]
        for station in misled:
            if station.error_active:
                return PROTOCOL, station
        if self._tamper.damages():
            return PROTOCOL, None
        heard = len(listeners) > len(misled) or len(senders) > 1
        return (0 if heard else NO_ACKNOWLEDGEMENT), None

    def _clash(self, senders: list[Station]) -> bool:
        rivals = tuple(senders)
        destroyed = clash(senders)
        for station in rivals:
            self._plan_restart(station)
        return destroyed

    def _time(self, attempt: _Attempt, start_ns: int) -> None:
        attempt.end_ns = attempt.free_ns = start_ns
        if not self._timed and self._babbler is None:
            return
        bits = HEADER_BITS if attempt.fails_early else frame_bits(attempt.frame)
        bits += ERROR_FRAME_BITS if attempt.error_class else 0
        attempt.end_ns += self._bits_ns(bits)
        attempt.free_ns += self._bits_ns(bits + INTERMISSION_BITS)

    def _finish(self, until_ns: int) -> bool:
        """End the attempt that is on the wire; tell whether the wire is free."""
        attempt = self._on_wire
        if attempt is None:
            return True
        if attempt.end_ns > until_ns:
            return False
        self._on_wire = None
        self._now_ns = max(self._now_ns, attempt.end_ns)
        self._free_ns = attempt.free_ns
        if attempt.error_class:
            self._destroyed(attempt)
        else:
            self._carried(attempt)
        return True

    def _carried(self, attempt: _Attempt) -> None:
        self.frames_carried += 1
        for sender in attempt.senders:
            sender.queue.popleft()
            if sender is self._babbler:
                sender.queue.append(attempt.frame)
            sender.transmitted()
            self._suspend(sender)
        if self._tamper.loses():
            self.frames_lost += 1
        elif self._tamper.delay_ns:
            self._delayed.append((self._now_ns + self._tamper.delay_ns, attempt))
        else:
            self._hand_over(attempt)

    def _hand_over(self, attempt: _Attempt) -> None:
        for station in self._stations.listeners(attempt.senders):
            if not station.wrong_bitrate:
                station.received(attempt.frame)

    def _destroyed(self, attempt: _Attempt) -> None:
        self.frames_destroyed += 1
        if attempt.error_class == NO_ACKNOWLEDGEMENT:
            self._not_acknowledged(attempt.senders[0])
            return
        for station in self._stations.listeners(attempt.senders):
            station.receive_failed(BUS_ERROR, first=station is attempt.flagging)
        for sender in attempt.senders:
            sender.transmit_failed(attempt.error_class)
            self._suspend(sender)
            self._plan_restart(sender)

    def _not_acknowledged(self, sender: Station) -> None:
        sender.not_acknowledged(NO_ACKNOWLEDGEMENT)
        self._suspend(sender)
        if not self._timed or not sender.error_active:
            sender.ready_ns = self._until_ns + UNHEARD_RETRY_NS

    def _suspend(self, sender: Station) -> None:
        """Let an error passive sender wait before its next frame, as the standard asks."""
        pause_ns = self._bits_ns(SUSPEND_BITS) if self._timed and not sender.error_active else 0
        sender.ready_ns = self._free_ns + pause_ns

    def _plan_restart(self, station: Station) -> None:
        if station.bus_off and self._restart_s is not None:
            pause_ns = round(self._restart_s * NS_PER_S)
            station.restart_ns = self._now_ns + pause_ns + self._bits_ns(RECOVERY_BITS)

    def _recover(self, now_ns: int) -> None:
        for station in self._stations.all():
            if station.restart_ns is not None and station.restart_ns <= now_ns:
                self._now_ns = max(self._now_ns, station.restart_ns)
                station.come_back()

    def _abandon(self, station: Station) -> None:
        attempt = self._on_wire
        if attempt is not None and station in attempt.senders:
            self._on_wire = None
        station.queue.clear()

    def _bits_ns(self, bits: int) -> int:
        return bits * NS_PER_S // self.bitrate
