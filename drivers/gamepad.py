"""Follow the sticks and buttons of a gamepad that the kernel knows as an input device.

Sticks tell changes only: until one moves it counts as at rest. Codes: linux/input-event-codes.h,
axes as the kernel's gamepad specification (Documentation/input/gamepad.rst) orders them.
"""

from collections.abc import Callable
from enum import IntEnum
from typing import Final

from drivers.base import ByteTransport
from drivers.errors import ProtocolError
from drivers.estop.input_event import EVENT, EventType, InputEvent, KeyValue, decode_event

ABSOLUTE: Final = 0x03
DEAD_ZONE: Final = 0.15
"""Of a stick's way from its middle: sticks do not come back to it exactly."""
_READ_BYTES: Final = 64 * EVENT.size
_MAX_READS: Final = 64


class PadAxis(IntEnum):
    """Name the axes that gamepads have in common; a stick's y grows towards the person."""

    LEFT_X = 0x00
    LEFT_Y = 0x01
    LEFT_TRIGGER = 0x02
    RIGHT_X = 0x03
    RIGHT_Y = 0x04
    RIGHT_TRIGGER = 0x05
    CROSS_X = 0x10
    CROSS_Y = 0x11


class PadButton(IntEnum):
    """Name the buttons above the triggers."""

    LEFT_SHOULDER = 0x136
    RIGHT_SHOULDER = 0x137


class Gamepad:
    """Read events as they come; `axis_range` asks the kernel for the ends of an axis."""

    def __init__(self, line: ByteTransport, axis_range: Callable[[int], tuple[int, int]]) -> None:
        self._line = line
        self._range = axis_range
        self._buffer = bytearray()
        self._held: set[int] = set()
        self._values: dict[int, float] = {}

    def poll(self) -> None:
        """Take in what has arrived; never waits.

        Raises:
            LinkLost: the gamepad is gone.
            ProtocolError: what comes is no input event, or events were lost.
        """
        for _ in range(_MAX_READS):
            chunk = self._line.read(_READ_BYTES, 0)
            if not chunk:
                return
            self._buffer += chunk
            while len(self._buffer) >= EVENT.size:
                event = decode_event(bytes(self._buffer[: EVENT.size]))
                del self._buffer[: EVENT.size]
                self._take(event)
        raise ProtocolError("the gamepad sends without end; unplug it and look what it is")

    def is_held(self, button: PadButton) -> bool:
        """Return whether a button is held down."""
        return button in self._held

    def axis(self, axis: PadAxis) -> float:
        """Return where a stick is, -1 to 1, 0 within its dead zone; a trigger from 0 to 1."""
        value = self._values.get(axis, 0.0)
        if abs(value) <= DEAD_ZONE:
            return 0.0
        sign = 1.0 if value > 0 else -1.0
        return sign * (abs(value) - DEAD_ZONE) / (1.0 - DEAD_ZONE)

    def close(self) -> None:
        """Release the line; closing twice is allowed."""
        self._line.close()

    def _take(self, event: InputEvent | None) -> None:
        if event is None or event.is_dropped:
            raise ProtocolError("the gamepad's events are damaged or lost; plug it in again")
        if event.type == EventType.KEY:
            change = self._held.discard if event.value == KeyValue.UP else self._held.add
            change(event.code)
        elif event.type == ABSOLUTE:
            low, high = self._range(event.code)
            ratio = (event.value - low) / max(high - low, 1)
            is_trigger = event.code in (PadAxis.LEFT_TRIGGER, PadAxis.RIGHT_TRIGGER)
            self._values[event.code] = ratio if is_trigger else 2.0 * ratio - 1.0
