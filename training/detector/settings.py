"""Say how much data, how long a training: two sizes, one for a check that all works."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """Hold what decides the result besides the code; shards per split hold 20 images each."""

    seed: int = 0
    shards: tuple[tuple[str, int], ...]
    epochs: int
    batch: int = 24
    learning_rate: float = 2.5e-3
    calibration_images: int = 200

    def shard_count(self, split: str) -> int:
        """Return how many shards a split has."""
        return dict(self.shards)[split]


FULL = Settings(shards=(("heldout", 50), ("check", 20), ("flat", 20), ("train", 800)), epochs=12)
TINY = Settings(
    shards=(("heldout", 1), ("check", 1), ("flat", 1), ("train", 2)),
    epochs=1, batch=4, calibration_images=4,
)  # fmt: skip
SIZES = {"full": FULL, "tiny": TINY}
