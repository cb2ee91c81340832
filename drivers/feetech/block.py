"""Read position, velocity, load, voltage, temperature and errors of all servos in one go.

The usual reply, a status of the same length from each servo in turn, is checked and decoded by a
handful of calls. Anything else is framed anew.
"""

from collections.abc import Mapping, Sequence
from struct import Struct
from typing import Final, Literal

import numpy as np

from drivers.feetech.codec import FEETECH_HEADER, OVERHEAD_BYTES, FeetechPacket
from drivers.feetech.link import FeetechLink, sync_read_frame
from drivers.feetech.servo import FeetechServo
from drivers.feetech.table import FEETECH_VOLTAGE_UNIT_V, LOAD_FULL
from drivers.servo.patience import ReplyPatience
from drivers.servo.state import BusState, Floats

BLOCK_START: Final = 56
BLOCK_BYTES: Final = 10
"""present_position .. hardware_error_status, the same in every model."""
_STATUS_BYTES: Final = BLOCK_BYTES + OVERHEAD_BYTES
_STATUS: Final = "IBHHHBBxxB"
"""Head, error byte, position, velocity, load, voltage, temperature, -, -, check sum."""
_FIELDS: Final = 8
_WORD_SIGN: Final = 0x8000
_LOAD_SIGN: Final = 0x0400

Ints = Sequence[int]


class FeetechBlock:
    """Hold the request for the block of some servos, and put their answers into the state.

    `answered` are the bus indices of those that gave values in the last cycle, `errors` their error
    bytes.
    """

    def __init__(
        self,
        members: Sequence[int],
        servos: Sequence[FeetechServo],
        state: BusState,
    ) -> None:
        """Read the servos whose bus indices are `members`."""
        self.members = tuple(members)
        chosen = [servos[index] for index in members]
        self.ids = [servo.id for servo in chosen]
        self.in_one = all(servo.datasheet.has_sync_read for servo in chosen)
        self.request = sync_read_frame(self.ids, BLOCK_START, BLOCK_BYTES)
        self.reply_bytes = len(self.ids) * _STATUS_BYTES
        self.answered: Ints = ()
        self.errors: Ints = ()
        self._servos = chosen
        self._state = state
        self._fills_rows = len(self.members) == len(servos)
        is_big = chosen[0].datasheet.byte_order == "big"
        self._unpack = Struct((">" if is_big else "<") + _STATUS * len(chosen)).unpack
        self._unpack_one = Struct((">" if is_big else "<") + "HHHBBxx").unpack
        order: Literal["little", "big"] = "big" if is_big else "little"
        self._heads = tuple(
            int.from_bytes(FEETECH_HEADER + bytes((one, BLOCK_BYTES + 2)), order)
            for one in self.ids
        )
        step = np.array([servo.joint_per_pulse for servo in chosen])
        load = np.array([servo.sign / LOAD_FULL for servo in chosen])
        volts = np.full(len(chosen), FEETECH_VOLTAGE_UNIT_V)
        self._units = np.stack([step, step, load, volts, np.ones(len(chosen))])
        self._zeros = np.array([servo.to_joint(0) for servo in chosen])

    def take(self, reply: bytes) -> bool:
        """Store a reply of the usual form; False, and nothing is stored, where it is another."""
        if len(reply) != self.reply_bytes:
            return False
        values = self._unpack(reply)
        if values[0::_FIELDS] != self._heads:
            return False
        for end, check in zip(
            range(_STATUS_BYTES - 1, len(reply), _STATUS_BYTES), values[7::_FIELDS], strict=True
        ):
            if (sum(reply[end - 13 : end]) + check) & 0xFF != 0xFF:
                return False
        columns = [values[n::_FIELDS] for n in range(2, 7)]
        readings = self._readings(columns) * self._units
        readings[0] += self._zeros
        if self._fills_rows:
            self._state.readings[:] = readings
        else:
            self._state.readings[:, self.members] = readings
        self.answered = self.members
        self.errors = values[1::_FIELDS]
        return True

    def take_packets(self, packets: Mapping[int, FeetechPacket]) -> None:
        """Store what some of the servos answered."""
        rows = [row for row, servo_id in enumerate(self.ids) if servo_id in packets]
        found = [packets[self.ids[row]] for row in rows]
        self.answered = [self.members[row] for row in rows]
        self.errors = [packet.code for packet in found]
        if not found:
            return
        columns = list(zip(*(self._unpack_one(packet.params) for packet in found), strict=True))
        readings = self._readings(columns) * self._units[:, rows]
        readings[0] += self._zeros[rows]
        self._state.readings[:, self.answered] = readings

    def read_singly(self, link: FeetechLink, margin_s: float) -> Mapping[int, FeetechPacket]:
        """Ask servo after servo, for families without sync read.

        Raises:
            LinkLost: the adapter is gone.
        """
        patience = ReplyPatience(margin_s=margin_s, attempts=1)
        return link.read_spans(self._servos, BLOCK_START, BLOCK_BYTES, patience)

    def _readings(self, columns: Sequence[Ints]) -> Floats:
        """Return position, velocity, load, voltage and temperature with their signs, raw."""
        for row, sign in ((0, _WORD_SIGN), (1, _WORD_SIGN), (2, _LOAD_SIGN)):
            if max(columns[row]) >= sign:
                columns = [*columns[:row], _with_sign(columns[row], sign), *columns[row + 1 :]]
        return np.array(columns, dtype=np.float64)


def _with_sign(values: Ints, sign: int) -> Ints:
    """Read the bit `sign` as minus, what is below as magnitude."""
    return [-(one & sign - 1) if one & sign else one & sign - 1 for one in values]
