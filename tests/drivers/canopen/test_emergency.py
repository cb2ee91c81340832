import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.canopen.emergency import decode_emergency
from drivers.canopen.objects import EMERGENCY_WIRE
from drivers.errors import ProtocolError


def test_a_lost_heartbeat_is_told_in_words() -> None:
    emergency = decode_emergency(bytes.fromhex("3081 11 0000000000"), 5)
    assert emergency.text == "0x8130 heartbeat of the master lost"
    assert (emergency.error_register, emergency.received_ns) == (0x11, 5)
    assert not emergency.is_reset


def test_code_zero_takes_errors_back() -> None:
    assert decode_emergency(bytes(8), 0).is_reset


@given(st.integers(0, 0xFFFF))
def test_every_code_has_a_text(code: int) -> None:
    text = decode_emergency(EMERGENCY_WIRE.pack(code, 0, b""), 0).text
    assert text.startswith(f"0x{code:04X} ")


def test_a_short_emergency_is_refused() -> None:
    with pytest.raises(ProtocolError, match="3 bytes, expected 8"):
        decode_emergency(b"abc", 0)
