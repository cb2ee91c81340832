"""Take sentences of other talk from CLINC150 (Larson et al. 2019, CC BY 3.0), as plain words.

What is near a command of ours, or near what this robot is asked and cannot do, is left out.
"""

import json
from pathlib import Path
from typing import Final

from training.planner.sentences.lists import read_lists
from vla_deploy.planning.command_parser.wording import plain_words

_LEFT_OUT: Final = frozenset(read_lists("chatter")["left_out"])
_MOST_WORDS: Final = 24


def read_chatter(file: Path, splits: tuple[str, ...] = ("train", "oos_train")) -> tuple[str, ...]:
    """Return the sentences of `data_full.json`.

    Raises:
        OSError: the file cannot be read.
        KeyError: it lacks a split.
    """
    document = json.loads(file.read_text(encoding="utf-8"))
    sentences = [
        " ".join(plain_words(text))
        for split in splits
        for text, intent in document[split]
        if intent not in _LEFT_OUT
    ]
    return tuple(one for one in sentences if 0 < len(one.split()) <= _MOST_WORDS)
