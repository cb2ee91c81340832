import pytest

from drivers.framing import align

HEADER = b"\x54\x2c"


@pytest.mark.parametrize(
    ("stream", "found", "left"),
    [
        (b"", False, b""),
        (b"noise", False, b""),
        (b"noise\x54", False, b"\x54"),
        (b"\x2c\x54\x2crest", True, b"\x54\x2crest"),
        (b"\x54\x2crest", True, b"\x54\x2crest"),
        (b"\x54\x54\x2c", True, b"\x54\x2c"),
    ],
)
def test_what_precedes_a_header_is_dropped_and_counted(
    stream: bytes, found: bool, left: bytes
) -> None:
    buffer = bytearray(stream)
    assert align(buffer, HEADER) == (found, len(stream) - len(left))
    assert buffer == left
