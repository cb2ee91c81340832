"""Hold the sizes of the network, which training and export share."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Shape:
    """Hold the sizes of the network."""

    vocabulary: int = 2048
    width: int = 192
    layers: int = 4
    heads: int = 4
    inner: int = 512
    rope_theta: float = 10_000.0
    epsilon: float = 1e-5

    @property
    def head_width(self) -> int:
        """Return the width of one head."""
        return self.width // self.heads
