"""Run the block reads of each cycle and keep the age of every servo's values.

Servos whose block lies at the same address share one sync read; a bus of one layout needs one.
"""

from collections.abc import Callable, Iterator, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from drivers.clock import NS_PER_S
from drivers.dynamixel.group import Group, News, ServoRead
from drivers.dynamixel.wire.completion import complete
from drivers.dynamixel.wire.link import PacketLink
from drivers.servo.journal import BusJournal
from drivers.servo.roster import Roster
from drivers.servo.state import BusState

_NEVER_NS: Final = -1


class StateReader:
    """Read the blocks of all polled servos; what one servo does costs the others nothing."""

    def __init__(
        self,
        link: PacketLink,
        reads: Sequence[ServoRead],
        roster: Roster,
        state: BusState,
        journal: BusJournal,
        *,
        margin_s: float,
        on_lost_map: Callable[[int], None],
    ) -> None:
        """Read as `reads` says, servo by servo.

        `on_lost_map` is told the index of a servo that has forgotten its indirect addresses.
        """
        self._link = link
        self._reads = tuple(reads)
        self._roster = roster
        self._state = state
        self._journal = journal
        self._margin_ns = round(margin_s * NS_PER_S)
        self._on_lost_map = on_lost_map
        self._stamps_ns: NDArray[np.int64] = np.full(len(reads), _NEVER_NS, dtype=np.int64)
        self._all_fresh = False
        self._deadline_ns = 0
        self._unusual = 0
        self._lost: list[int] = []
        self.news = News()
        self.groups: tuple[Group, ...] = ()
        self.rebuild()

    def rebuild(self) -> None:
        """Prepare the requests for the servos that are polled now."""
        polled = self._roster.polled
        keys = {index: self._reads[index].key for index in polled}
        self.groups = tuple(
            Group([n for n in polled if keys[n] == key], self._reads, self._state, self.news)
            for key in dict.fromkeys(keys.values())
        )

    def read(self) -> None:
        """Run one cycle's reads and update the state's first group.

        Raises:
            LinkLost: the adapter is gone.
        """
        for group in self.groups:
            self._send(group)
            self._collect(group)
        self._finish()

    def read_in_turns(self) -> Iterator[None]:
        """Do as `read`, but pause whenever a request is on its way.

        Raises:
            LinkLost: the adapter is gone.
        """
        for group in self.groups:
            self._send(group)
            yield
            self._collect(group)
        self._finish()

    def note_silence(self) -> None:
        """Let all values grow old: the link is lost."""
        self._forget_freshness(self._state.stamp_ns)
        self._state.valid[:] = False
        self._state.stamp_ns = self._link.now_ns()
        self._update_ages()

    def forget_status(self) -> None:
        """Take the next status of every servo for news: the state was changed meanwhile."""
        for group in self.groups:
            group.forget_status()

    def _send(self, group: Group) -> None:
        request = group.read.sync_read
        self._deadline_ns = self._link.ask(request.request, request.reply_bytes, self._margin_ns)

    def _collect(self, group: Group) -> None:
        read = group.read
        if read.fast:
            reply = self._link.receive_chained(read.sync_read, self._deadline_ns, self._margin_ns)
        else:
            reply = self._link.receive_all(read.sync_read.reply_bytes, self._deadline_ns)
        if not (read.take(reply) and group.store()):
            self._collect_anew(group, reply)

    def _finish(self) -> None:
        state = self._state
        link = self._link
        before_ns, state.stamp_ns = state.stamp_ns, link.now_ns()
        link.counters.cycles += 1
        self._journal.answer_times_ns.append(state.stamp_ns - link.last_sent_ns)
        if self._unusual or len(self._roster.polled) < len(self._reads):
            self._finish_partial(before_ns)
            self._journal.note_gaps()
            self._unusual = 0
            return
        if not self._all_fresh:
            self._all_fresh = True
            state.valid.fill(True)
            state.age_s.fill(0.0)
            self._roster.note_complete()

    def _collect_anew(self, group: Group, reply: bytes) -> None:
        self._unusual += 1
        request = group.read.sync_read
        entries, blamed = complete(self._link, request, reply, self._deadline_ns, self._margin_ns)
        group.blamed = [group.members[group.ids.index(servo_id)] for servo_id in blamed]
        self._lost += group.store_entries(entries)

    def _finish_partial(self, before_ns: int) -> None:
        self._forget_freshness(before_ns)
        answered = [index for group in self.groups for index in group.answered]
        state, counters = self._state, self._link.counters
        state.valid[:] = False
        state.valid[answered] = True
        self._stamps_ns[answered] = state.stamp_ns
        self._update_ages()
        asked = sum(len(group.members) for group in self.groups)
        if len(answered) == asked:
            counters.stuffed += bool(self._unusual)
            self._roster.note_complete()
            return
        counters.partial_cycles += 1
        self._review_roster(answered)

    def _review_roster(self, answered: Sequence[int]) -> None:
        """Suspend who keeps silent; when nobody answers, nobody is to blame."""
        blamed = [index for group in self.groups for index in group.blamed]
        if answered and (dropped := self._roster.note_missing(blamed)):
            self._link.counters.suspensions += len(dropped)
            self.rebuild()
        lost, self._lost = self._lost, []
        for index in lost:
            self._on_lost_map(index)

    def _forget_freshness(self, since_ns: int) -> None:
        if self._all_fresh:
            self._stamps_ns.fill(since_ns)
        self._all_fresh = False

    def _update_ages(self) -> None:
        age_s = (self._state.stamp_ns - self._stamps_ns) / NS_PER_S
        self._state.age_s[:] = np.where(self._stamps_ns == _NEVER_NS, np.inf, age_s)
