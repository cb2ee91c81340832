"""Drive an emergency-stop button that is a USB keyboard or joystick to the computer.

Such a button is only as good as its cable and the USB stack: whatever is not surely a released
button - nothing told yet, bytes that are no events, events lost by the kernel, an unplugged cable -
reads as pressed.
"""

from typing import Final

from drivers.base import ByteTransport
from drivers.clock import Clock
from drivers.errors import LinkLost, ProtocolError
from drivers.estop.base import ButtonState, EstopCounters, EstopReading
from drivers.estop.input_event import (
    EVENT,
    EventType,
    InputEvent,
    KeyValue,
    decode_event,
)

_READ_BYTES: Final = 64 * EVENT.size
_MAX_READS: Final = 64


class HidButton:
    """Follow one key; the line's first report tells its present state."""

    def __init__(self, line: ByteTransport, clock: Clock, key_code: int) -> None:
        self.counters = EstopCounters()
        self._line = line
        self._clock = clock
        self._key_code = key_code
        self._buffer = bytearray()
        self._state = ButtonState.UNKNOWN
        self._reason = f"it has not told its key {key_code} yet"

    def poll(self) -> EstopReading:
        """Return what the button says now; once LOST it stays so until it is opened again."""
        if self._state is not ButtonState.LOST:
            try:
                self._listen()
            except (LinkLost, ProtocolError) as error:
                self.counters.losses += 1
                self._become(ButtonState.LOST, str(error))
        return EstopReading(state=self._state, stamp_ns=self._clock.now_ns(), reason=self._reason)

    def close(self) -> None:
        """Release the line; closing twice is allowed."""
        self._line.close()

    def _listen(self) -> None:
        for _ in range(_MAX_READS):
            chunk = self._line.read(_READ_BYTES, 0)
            if not chunk:
                return
            self._buffer += chunk
            while len(self._buffer) >= EVENT.size:
                raw = bytes(self._buffer[: EVENT.size])
                del self._buffer[: EVENT.size]
                self._take(decode_event(raw), raw)
        raise ProtocolError("the button sends without end; unplug it and look what it is")

    def _take(self, event: InputEvent | None, raw: bytes) -> None:
        if event is None:
            raise ProtocolError(
                f"{raw.hex()} is no input event; plug the button in again, "
                "or correct the path in the robot file"
            )
        if event.is_dropped:
            raise ProtocolError("the kernel lost events of the button; it is opened again")
        if event.type != EventType.KEY or event.code != self._key_code:
            return
        if event.value == KeyValue.UP:
            self.counters.releases += self._state is ButtonState.PRESSED
            self._become(ButtonState.RELEASED, "")
        else:
            self.counters.presses += self._state is not ButtonState.PRESSED
            self._become(ButtonState.PRESSED, "pressed")

    def _become(self, state: ButtonState, reason: str) -> None:
        self._state, self._reason = state, reason
