"""Read and write Linux input events, the kernel's one record of keys and buttons.

Layout: `struct input_event` of linux/input.h on the machine at hand: seconds and microseconds as C
longs, then type (uint16), code (uint16) and value (int32).
"""

import struct
from dataclasses import dataclass
from enum import IntEnum

EVENT = struct.Struct("@llHHi")
MAX_EVENT_TYPE = 0x1F
MAX_CODE = 0x2FF
SYN_DROPPED = 3
_US_PER_S = 1_000_000
_NS_PER_US = 1_000


class EventType(IntEnum):
    """Name the event types that a button uses."""

    SYN = 0x00
    KEY = 0x01


class KeyValue(IntEnum):
    """Name what an event says of a key."""

    UP = 0
    DOWN = 1
    REPEAT = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class InputEvent:
    """Hold one event; `time_us` is on the clock that the device was asked to use."""

    time_us: int
    type: int
    code: int
    value: int

    @property
    def is_dropped(self) -> bool:
        """Return whether the kernel lost events before this one."""
        return self.type == EventType.SYN and self.code == SYN_DROPPED


def encode_event(event: InputEvent) -> bytes:
    """Return an event's bytes."""
    seconds, microseconds = divmod(event.time_us, _US_PER_S)
    return EVENT.pack(seconds, microseconds, event.type, event.code, event.value)


def key_report(code: int, *, down: bool, now_ns: int) -> bytes:
    """Return what a device sends for one key: its event and the mark that ends a report."""
    time_us = now_ns // _NS_PER_US
    value = KeyValue.DOWN if down else KeyValue.UP
    key = InputEvent(time_us=time_us, type=EventType.KEY, code=code, value=value)
    end = InputEvent(time_us=time_us, type=EventType.SYN, code=0, value=0)
    return encode_event(key) + encode_event(end)


def decode_event(data: bytes) -> InputEvent | None:
    """Return the event, or None where no kernel would have written these bytes."""
    seconds, microseconds, kind, code, value = EVENT.unpack(data)
    if seconds < 0 or not 0 <= microseconds < _US_PER_S:
        return None
    if kind > MAX_EVENT_TYPE or code > MAX_CODE:
        return None
    if kind == EventType.KEY and value not in tuple(KeyValue):
        return None
    return InputEvent(time_us=seconds * _US_PER_S + microseconds, type=kind, code=code, value=value)
