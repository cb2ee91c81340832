"""Emulate an emergency-stop button at the kernel's input interface: real events, no kernel."""

from drivers.estop.input_event import key_report

MAX_WAITING_BYTES = 4096


class EstopButtonDevice:
    """Send the key's events as it is pressed and released, and its state to each new client."""

    def __init__(self, key_code: int) -> None:
        self._key_code = key_code
        self._down = False
        self._now_ns = 0
        self._out = bytearray()
        self.announce()

    def press(self) -> None:
        """Push the button down; it stays there."""
        self._move(down=True)

    def release(self) -> None:
        """Turn the button until it springs up."""
        self._move(down=False)

    def announce(self) -> None:
        """Forget what nobody has read, and begin with the present state for the next host."""
        self._out.clear()
        self._report()

    def receive(self, data: bytes) -> None:
        """Ignore what the host sends: a button only talks."""

    def transmit(self) -> bytes:
        """Return and forget the events that are ready."""
        data = bytes(self._out)
        self._out.clear()
        return data

    def step(self, now_ns: int) -> None:
        """Keep the time for the events' stamps."""
        self._now_ns = now_ns

    def _move(self, *, down: bool) -> None:
        if down is self._down:
            return
        self._down = down
        if len(self._out) > MAX_WAITING_BYTES:
            self._out.clear()  # nobody reads: the newest state is what counts
        self._report()

    def _report(self) -> None:
        self._out += key_report(self._key_code, down=self._down, now_ns=self._now_ns)
