"""Count what happens on a servo bus."""

from dataclasses import asdict, dataclass


@dataclass(slots=True)
class BusCounters:
    """Count since the bus was made; control publishes them with its status."""

    cycles: int = 0
    partial_cycles: int = 0
    """Cycles in which at least one polled servo gave no value."""
    timeouts: int = 0
    """Servo answers that did not come in time."""
    crc_errors: int = 0
    stuffed: int = 0
    """Cycles whose reply held byte stuffing (or noise) and was framed anew."""
    retries: int = 0
    late: int = 0
    """Times that bytes came in after their transaction had been given up."""
    discarded_bytes: int = 0
    suspensions: int = 0
    """Times that a silent servo was taken out of the block read."""
    returns: int = 0
    """Times that a servo was set up again after it had been away."""
    link_lost: int = 0

    def as_dict(self) -> dict[str, int]:
        """Return the counters by name."""
        return asdict(self)
