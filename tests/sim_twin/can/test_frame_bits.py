import can
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim_twin.can.bus.frame_bits import arbitration_key, crc15, frame_bits, stuff_bits

FRAMES = st.builds(
    lambda extended, can_id, remote, data: can.Message(
        arbitration_id=can_id & (0x1FFFFFFF if extended else 0x7FF),
        is_extended_id=extended,
        is_remote_frame=remote,
        dlc=len(data),
        data=None if remote else data,
    ),
    st.booleans(),
    st.integers(0, 0x1FFFFFFF),
    st.booleans(),
    st.binary(max_size=8),
)


def naive_crc(bits: list[int]) -> int:
    """Shift bit by bit, as the standard describes the register."""
    crc = 0
    for bit in bits:
        next_bit = bit ^ crc >> 14 & 1
        crc = crc << 1 & 0x7FFF
        if next_bit:
            crc ^= 0x4599
    return crc


def stuffed(bits: list[int]) -> list[int]:
    """Write the bits out with their stuff bits."""
    sent: list[int] = []
    for bit in bits:
        sent.append(bit)
        if len(sent) >= 5 and len(set(sent[-5:])) == 1:
            sent.append(1 - bit)
    return sent


def header(frame: can.Message) -> list[int]:
    remote = int(frame.is_remote_frame)
    if frame.is_extended_id:
        text = f"{frame.arbitration_id:029b}"
        parts = "0" + text[:11] + "11" + text[11:] + f"{remote}00"
    else:
        parts = "0" + f"{frame.arbitration_id:011b}" + f"{remote}00"
    parts += f"{frame.dlc:04b}" + "".join(f"{byte:08b}" for byte in frame.data)
    return [int(bit) for bit in parts]


def number(bits: list[int]) -> int:
    return int("".join(map(str, bits)), 2)


@given(FRAMES)
def test_a_frame_is_as_long_as_written_out_bit_by_bit(frame: can.Message) -> None:
    bits = header(frame)
    crc = naive_crc(bits)
    assert crc15(number(bits), len(bits)) == crc
    bits += [int(bit) for bit in f"{crc:015b}"]
    assert stuff_bits(number(bits), len(bits)) == len(stuffed(bits)) - len(bits)
    assert frame_bits(frame) == len(stuffed(bits)) + 10


@given(FRAMES)
def test_stuffing_stays_within_the_standards_worst_case(frame: can.Message) -> None:
    data_bits = 0 if frame.is_remote_frame else 8 * frame.dlc
    stuffable = (54 if frame.is_extended_id else 34) + data_bits
    assert stuffable + 10 <= frame_bits(frame) <= stuffable + 10 + (stuffable - 1) // 4


@pytest.mark.parametrize(("data", "shortest", "longest"), [(b"", 44, 52), (bytes(8), 108, 132)])
def test_the_textbook_lengths_hold(data: bytes, shortest: int, longest: int) -> None:
    lengths = {
        frame_bits(can.Message(arbitration_id=can_id, is_extended_id=False, data=data))
        for can_id in range(0x800)
    }
    assert shortest <= min(lengths) < max(lengths) <= longest


def test_arbitration_is_won_by_the_first_dominant_bit() -> None:
    data = can.Message(arbitration_id=0x123, is_extended_id=False)
    remote = can.Message(arbitration_id=0x123, is_extended_id=False, is_remote_frame=True)
    extended = can.Message(arbitration_id=0x123 << 18, is_extended_id=True)
    higher = can.Message(arbitration_id=0x124, is_extended_id=False)
    frames = [higher, extended, remote, data]
    assert sorted(frames, key=arbitration_key) == [data, remote, extended, higher]
