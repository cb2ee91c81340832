"""Give driver tests a clock and a line that do exactly what the test says."""

from dataclasses import dataclass, field


@dataclass(slots=True)
class ManualClock:
    """Stand still until the test sets `ns`, or a driver waits."""

    ns: int = 0

    def now_ns(self) -> int:
        """Return what the test has set."""
        return self.ns

    def sleep_until(self, deadline_ns: int) -> None:
        """Jump to the deadline."""
        self.ns = max(self.ns, deadline_ns)


@dataclass(slots=True)
class ScriptedLine:
    """Deliver `pending` in pieces as asked and record what is `sent`."""

    pending: bytearray = field(default_factory=bytearray)
    sent: bytearray = field(default_factory=bytearray)
    closed: int = 0

    def write(self, data: bytes) -> None:
        """Record what the driver sends."""
        self.sent += data

    def read(self, max_bytes: int, deadline_ns: int) -> bytes:
        """Return what is pending, at most `max_bytes`; nothing else will come while one waits."""
        data = bytes(self.pending[:max_bytes])
        del self.pending[:max_bytes]
        return data

    def discard_input(self) -> None:
        """Drop what is pending."""
        self.pending.clear()

    def close(self) -> None:
        """Count how often the driver let go."""
        self.closed += 1
