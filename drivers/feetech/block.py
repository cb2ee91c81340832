"""Read position, velocity, load, voltage, temperature and errors of all servos in one go.

The usual reply, a status of the same length from each servo in turn, is checked and decoded for all
of them at once. Anything else is framed anew.
"""

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from drivers.feetech.codec import FEETECH_HEADER, OVERHEAD_BYTES, FeetechPacket
from drivers.feetech.link import FeetechLink, sync_read_frame
from drivers.feetech.servo import FeetechServo
from drivers.feetech.table import FEETECH_VOLTAGE_UNIT_V, LOAD_FULL
from drivers.servo.patience import ReplyPatience
from drivers.servo.state import BusState

BLOCK_START: Final = 56
BLOCK_BYTES: Final = 10
"""present_position .. hardware_error_status, the same in every model."""
_STATUS_BYTES: Final = BLOCK_BYTES + OVERHEAD_BYTES
_DATA_AT: Final = 5
_SIGN_BITS: Final = np.array([[15], [15], [10]])
"""Of position, velocity and load."""

Bytes = NDArray[np.uint8]


class FeetechBlock:
    """Hold the request for the block of some servos, and put their answers into the state."""

    def __init__(
        self,
        members: Sequence[int],
        servos: Sequence[FeetechServo],
        offsets: Sequence[int],
        state: BusState,
    ) -> None:
        """Read the servos whose bus indices are `members`; `offsets` are their homing offsets."""
        self.members = tuple(members)
        chosen = [servos[index] for index in members]
        self.ids = [servo.id for servo in chosen]
        self.in_one = all(servo.datasheet.has_sync_read for servo in chosen)
        self.request = sync_read_frame(self.ids, BLOCK_START, BLOCK_BYTES)
        self.reply_bytes = len(self.ids) * _STATUS_BYTES
        self._servos = chosen
        self._state = state
        count = len(chosen)
        self._heads = np.zeros((count, 4), np.uint8)
        for row, servo in enumerate(chosen):
            self._heads[row] = (*FEETECH_HEADER, servo.id, BLOCK_BYTES + 2)
        self._big = np.array([servo.datasheet.byte_order == "big" for servo in chosen])
        step = np.array([servo.joint_per_pulse for servo in chosen])
        sign = np.array([float(servo.sign) for servo in chosen])
        self._units = np.stack([step, step, sign / LOAD_FULL])
        self._zeros = np.array([servos[index].to_joint(offsets[index]) for index in members])
        self.answered: Sequence[int] = ()
        self.errors: Bytes = np.zeros(count, np.uint8)

    def take(self, reply: bytes) -> bool:
        """Store a reply of the usual form; False, and nothing is stored, where it is another."""
        if len(reply) != self.reply_bytes:
            return False
        block = np.frombuffer(reply, np.uint8).reshape(len(self.ids), _STATUS_BYTES)
        if not np.array_equal(block[:, :4], self._heads):
            return False
        sums = block[:, 2:-1].sum(axis=1, dtype=np.uint32)
        if not np.array_equal((~sums & 0xFF).astype(np.uint8), block[:, -1]):
            return False
        self._store(range(len(self.ids)), block[:, _DATA_AT:-1], block[:, 4])
        return True

    def take_packets(self, packets: Mapping[int, FeetechPacket]) -> None:
        """Store what some of the servos answered."""
        rows = [row for row, servo_id in enumerate(self.ids) if servo_id in packets]
        found = [packets[self.ids[row]] for row in rows]
        data = np.frombuffer(b"".join(p.params for p in found), np.uint8)
        codes = np.array([packet.code for packet in found], np.uint8)
        self._store(rows, data.reshape(len(rows), BLOCK_BYTES), codes)

    def read_singly(self, link: FeetechLink, margin_s: float) -> Mapping[int, FeetechPacket]:
        """Ask servo after servo, for families without sync read.

        Raises:
            LinkLost: the adapter is gone.
        """
        patience = ReplyPatience(margin_s=margin_s, attempts=1)
        return link.read_spans(self._servos, BLOCK_START, BLOCK_BYTES, patience)

    def _store(self, rows: Sequence[int], data: Bytes, codes: Bytes) -> None:
        chosen = list(rows)
        self.answered = [self.members[row] for row in chosen]
        self.errors = codes
        if not chosen:
            return
        low, high = data[:, 0:6:2].astype(np.int32), data[:, 1:6:2].astype(np.int32)
        words = np.where(self._big[chosen, None], low << 8 | high, high << 8 | low).T
        negative = words >> _SIGN_BITS & 1
        magnitude = words & ((1 << _SIGN_BITS) - 1)
        values = np.where(negative, -magnitude, magnitude) * self._units[:, chosen]
        values[0] += self._zeros[chosen]
        readings = self._state.readings
        readings[:3, self.answered] = values
        readings[3, self.answered] = data[:, 6] * FEETECH_VOLTAGE_UNIT_V
        readings[4, self.answered] = data[:, 7]
