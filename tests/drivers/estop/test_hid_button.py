"""What is not surely a released button reads as pressed."""

import struct

import pytest

from drivers.estop.base import ButtonState
from drivers.estop.hid_button import HidButton
from drivers.estop.input_event import EVENT, decode_event, key_report
from sim_twin.contracts.scripted import ManualClock, ScriptedLine

KEY = 288
PRESS = struct.pack("@llHHi", 12, 345_678, 1, KEY, 1)
RELEASE = struct.pack("@llHHi", 13, 0, 1, KEY, 0)
REPEAT = struct.pack("@llHHi", 13, 0, 1, KEY, 2)
OTHER_KEY = struct.pack("@llHHi", 13, 0, 1, KEY + 1, 1)
SYN = struct.pack("@llHHi", 13, 0, 0, 0, 0)
DROPPED = struct.pack("@llHHi", 13, 0, 0, 3, 0)
SCAN_CODE = struct.pack("@llHHi", 13, 0, 4, 4, 0x90001)


def make(data: bytes = b"") -> tuple[HidButton, ScriptedLine]:
    line = ScriptedLine(pending=bytearray(data))
    return HidButton(line, ManualClock(10**9), KEY), line


def test_an_event_is_read_as_the_kernel_writes_it() -> None:
    event = decode_event(PRESS)
    assert event is not None
    assert (event.time_us, event.type, event.code, event.value) == (12_345_678, 1, KEY, 1)
    assert key_report(KEY, down=True, now_ns=12_345_678_000)[: EVENT.size] == PRESS


@pytest.mark.parametrize(
    ("events", "state"),
    [
        (b"", ButtonState.UNKNOWN),
        (SYN + SCAN_CODE + OTHER_KEY, ButtonState.UNKNOWN),
        (RELEASE, ButtonState.RELEASED),
        (RELEASE + PRESS, ButtonState.PRESSED),
        (RELEASE + PRESS + REPEAT + SYN, ButtonState.PRESSED),
        (RELEASE + PRESS[:-1], ButtonState.RELEASED),
        (PRESS + RELEASE, ButtonState.RELEASED),
        (RELEASE + DROPPED, ButtonState.LOST),
        (RELEASE + b"\xff" * EVENT.size, ButtonState.LOST),
        (RELEASE + b"\xff" * EVENT.size + RELEASE, ButtonState.LOST),
    ],
)
def test_events_in_order_give_the_state(events: bytes, state: ButtonState) -> None:
    button, _ = make(events)
    reading = button.poll()
    assert reading.state is state
    assert reading.pressed is (state is not ButtonState.RELEASED)


def test_a_device_that_sends_without_end_is_lost_and_does_not_block() -> None:
    button, _ = make(RELEASE * 100_000)
    reading = button.poll()
    assert reading.state is ButtonState.LOST
    assert "without end" in reading.reason
