"""Count the bits of a classic CAN frame on the wire, stuff bits included (ISO 11898-1)."""

from typing import Final

import can

CRC_BITS: Final = 15
_CRC_POLYNOMIAL: Final = 0x4599
_CRC_MASK: Final = (1 << CRC_BITS) - 1
STUFF_AFTER: Final = 5

# After the CRC sequence nothing is stuffed: CRC delimiter, ACK slot, ACK delimiter, end of frame.
TRAILER_BITS: Final = 10
INTERMISSION_BITS: Final = 3
# Error flag, its echo by the others, error delimiter.
ERROR_FRAME_BITS: Final = 6 + 6 + 8
# What is lost of a frame that fails in its arbitration field.
HEADER_BITS: Final = 19
SUSPEND_BITS: Final = 8
RECOVERY_BITS: Final = 128 * 11


def _crc_table() -> tuple[int, ...]:
    table = []
    for value in range(256):
        crc = value << CRC_BITS - 8
        for _ in range(8):
            crc = crc << 1 ^ (_CRC_POLYNOMIAL if crc & 1 << CRC_BITS - 1 else 0)
        table.append(crc & _CRC_MASK)
    return tuple(table)


def _stuff_tables() -> tuple[tuple[tuple[int, int], ...], ...]:
    """Return, for each (last bit, its run length 1..4), what a byte adds and where it leads."""
    return tuple(
        tuple(_stuff_byte(state, value) for value in range(256))
        for state in range(2 * (STUFF_AFTER - 1))
    )


def _stuff_byte(state: int, value: int) -> tuple[int, int]:
    last, run = state & 1, (state >> 1) + 1
    added = 0
    for shift in range(7, -1, -1):
        bit = value >> shift & 1
        run = run + 1 if bit == last else 1
        last = bit
        if run == STUFF_AFTER:
            added += 1
            last, run = 1 - bit, 1
    return added, run - 1 << 1 | last


_CRC_TABLE: Final = _crc_table()
_STUFF_TABLES: Final = _stuff_tables()
_RECESSIVE: Final = 1  # the state of the idle wire: one recessive bit
_ALTERNATING: Final = 0x55  # ends recessive and has no runs, so it adds nothing in front of a frame


def crc15(bits: int, length: int) -> int:
    """Return the CRC of the `length` lowest bits of `bits`, the highest of them first."""
    crc = 0
    # Leading zeros do not change a CRC that starts at zero.
    for byte in bits.to_bytes((length + 7) // 8, "big"):
        crc = (crc << 8 ^ _CRC_TABLE[crc >> CRC_BITS - 8 ^ byte]) & _CRC_MASK
    return crc


def stuff_bits(bits: int, length: int) -> int:
    """Return how many bits are stuffed into the `length` lowest bits of `bits`."""
    padding = -length % 8
    padded = (_ALTERNATING & (1 << padding) - 1) << length | bits
    state, count = _RECESSIVE, 0
    for byte in padded.to_bytes((length + padding) // 8, "big"):
        added, state = _STUFF_TABLES[state][byte]
        count += added
    return count


def _unstuffed(frame: can.Message) -> tuple[int, int]:
    """Return start of frame to the end of the data, and its length."""
    remote = int(frame.is_remote_frame)
    if frame.is_extended_id:
        can_id = frame.arbitration_id
        # base id, SRR and IDE recessive, the other 18 bits, RTR, r1 and r0 dominant
        head = (can_id >> 18) << 23 | 0b11 << 21 | (can_id & 0x3FFFF) << 3 | remote << 2
        length = 1 + 11 + 2 + 18 + 3
    else:
        head, length = frame.arbitration_id << 3 | remote << 2, 1 + 11 + 3
    bits, length = head << 4 | min(frame.dlc, 15), length + 4
    if not remote:
        data = bytes(frame.data)
        bits, length = bits << 8 * len(data) | int.from_bytes(data, "big"), length + 8 * len(data)
    return bits, length


def frame_bits(frame: can.Message) -> int:
    """Return the bits from start of frame to end of frame as they go over the wire."""
    bits, length = _unstuffed(frame)
    bits, length = bits << CRC_BITS | crc15(bits, length), length + CRC_BITS
    return length + stuff_bits(bits, length) + TRAILER_BITS


def arbitration_key(frame: can.Message) -> int:
    """Return the bits of the arbitration field as they are compared: the lowest wins."""
    can_id: int = frame.arbitration_id
    remote: bool = frame.is_remote_frame
    if frame.is_extended_id:
        return can_id >> 18 << 21 | 0b11 << 19 | (can_id & 0x3FFFF) << 1 | remote
    return can_id << 21 | remote << 20
