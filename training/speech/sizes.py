"""Say how large the recogniser is and how it learns, by name."""

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True, slots=True, kw_only=True)
class TrainingSize:
    """Hold the sizes of a training; `batch_s` is sound per step, padding counted."""

    name: str
    width: int
    heads: int
    encoder_layers: int
    decoder_layers: int
    shards: int
    clips_per_shard: int = 1000
    text_tokens: int = 640
    texts_for_tokens: int = 30_000
    batch_s: float = 120.0
    seed: int = 7


SIZES: Final = {
    size.name: size
    for size in (
        TrainingSize(
            name="full", width=256, heads=8, encoder_layers=4, decoder_layers=2, shards=40
        ),
        TrainingSize(
            name="smoke", width=32, heads=2, encoder_layers=1, decoder_layers=1, shards=1,
            clips_per_shard=24, text_tokens=300, texts_for_tokens=300,
            batch_s=20.0,
        ),
    )
}  # fmt: skip
