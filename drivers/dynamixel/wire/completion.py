"""Get, in the same cycle, what a sync read's reply lacks.

In a fast sync read each servo waits for the one before it, so a silent servo also mutes those
behind it. Only that one is to blame; the ones behind it are asked again at once.
"""

from typing import Final

from drivers.dynamixel.wire.link import PacketLink
from drivers.dynamixel.wire.sync_read import Entry, SyncRead

_LEAST_MARGIN_RATIO: Final = 0.1
"""What of the margin must be left for the second question, or it is not asked."""


def complete(
    link: PacketLink, read: SyncRead, reply: bytes, deadline_ns: int, margin_ns: int
) -> tuple[dict[int, Entry], list[int]]:
    """Frame a reply anew, wait for the rest of it, and return entries and blamed servos by id.

    Raises:
        LinkLost: the adapter is gone.
    """
    stalled = read.fast and len(reply) < read.reply_bytes
    entries = link.collect(read, reply, link.now_ns() if stalled else deadline_ns)
    missing = [servo_id for servo_id in read.ids if servo_id not in entries]
    if not read.fast or len(missing) < 2:
        return entries, missing
    again = SyncRead(missing[1:], read.address, read.size, fast=True)
    spare_ns = round(margin_ns * _LEAST_MARGIN_RATIO)
    if link.now_ns() + link.wire_ns(again) + spare_ns > deadline_ns:
        return entries, missing[:1]
    link.ask(again.request, again.reply_bytes, margin_ns)
    answer = link.receive_chained(again, deadline_ns, margin_ns)
    more = link.collect(again, answer, deadline_ns)
    still = [servo_id for servo_id in again.ids if servo_id not in more]
    return entries | more, missing[:1] + still[:1]
