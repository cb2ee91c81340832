"""Say how much data and how long a training; the smallest size only checks that all works."""

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True, kw_only=True)
class DetectorSettings:
    """Hold what decides the result besides the code; shards per split hold 20 images each.

    First come `epochs` mostly on pieces of the images, which show a thing each for a quarter of
    the work, then `settling_epochs` on whole images. Large things do not fit into a piece:
    `whole_share` of the steps before see whole images too. An epoch sees `epoch_shards` of the
    training shards, others each time, or all where there are fewer.
    """

    name: str
    seed: int = 0
    shards: tuple[tuple[str, int], ...]
    epochs: int
    settling_epochs: int
    piece_px: tuple[int, int] = (192, 256)
    epoch_shards: int = 800
    batch: int = 16
    whole_share: float = 0.3
    whole_batch: int = 8
    learning_rate: float = 0.02
    """Of the weights of convolutions, in steps of Muon; a tenth of it of all else."""
    calibration_images: int = 200
    threads: int = 1
    start_from: Path | None = None
    """The exported model to go on from, else from random weights."""

    def shard_count(self, split: str) -> int:
        """Return how many shards a split has."""
        return dict(self.shards)[split]


FULL = DetectorSettings(
    name="full",
    shards=(("heldout", 50), ("flat", 20), ("train", 540)),
    epochs=10,
    settling_epochs=1,
)
"""About an hour on two idle cores."""
LONG = DetectorSettings(
    name="long",
    shards=(("heldout", 50), ("flat", 20), ("train", 4800)),
    epochs=48,
    settling_epochs=2,
)
"""About seven hours on two idle cores."""
MORE = DetectorSettings(
    name="more",
    shards=(("heldout", 50), ("flat", 20), ("train", 1800)),
    epochs=34,
    settling_epochs=1,
    epoch_shards=150,
    whole_share=0.5,
    learning_rate=0.01,
)
"""Goes on from the shipped model, best with a seed that no training had yet: somewhat longer."""
SHORT = DetectorSettings(
    name="short",
    shards=(("heldout", 50), ("flat", 20), ("train", 200)),
    epochs=5,
    settling_epochs=1,
)
"""About fifteen minutes on two idle cores."""
TINY = DetectorSettings(
    name="tiny",
    shards=(("heldout", 1), ("flat", 1), ("train", 2)),
    epochs=1,
    settling_epochs=1,
    batch=4,
    whole_batch=4,
    calibration_images=4,
)
SIZES = {settings.name: settings for settings in (LONG, FULL, MORE, SHORT, TINY)}
