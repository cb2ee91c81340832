"""Name the files of the finished model."""

from typing import Final

GRAPH: Final = "model.onnx"
CONFIG: Final = "genai_config.json"
TOKENIZER: Final = "tokenizer.json"
TOKENIZER_CONFIG: Final = "tokenizer_config.json"
KNOWN_WORDS: Final = "known_words.txt"
PARTS: Final = (GRAPH, CONFIG, TOKENIZER, TOKENIZER_CONFIG, KNOWN_WORDS)
"""What the manifest lists: all of them are needed."""
MANIFEST: Final = "model.toml"
METRICS: Final = "metrics.json"
CARD: Final = "card.md"
MEAN_OF: Final = "mean_of.txt"
"""Beside weights that are a mean: a sentence on it, for the card."""
NAME: Final = "command_parser"
