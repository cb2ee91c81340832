"""Read the example sentences of WordNet: what people say of anything at all, forty thousand.

The Debian package wordnet-base has them. Those in which something sounds like a stop word come as
often as all the others.
"""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import numpy as np

from training.stop_words.picking import pick
from training.stop_words.texts import Other, is_clean

FOLDER: Final = Path("/usr/share/wordnet")
_PARTS: Final = ("adj", "adv", "noun", "verb")
_COMMENT: Final = "  "
_QUOTED: Final = re.compile(r'"([^"]+)"')
_SPEAKABLE: Final = re.compile(r"[A-Za-z' ,;?!.-]+")
_WORDS: Final = range(3, 15)
_ALIKE: Final = re.compile(
    r"\b(?:(?:fr|thr|pl|br|tr|sn|sl|fl|f)(?:ee|ea|ie|ei)\w*|h(?:al|aul|ol)\w*|st[aou]\w*"
    r"|(?:s|sh|ch|t|d)[ou]p\w*|these|keys|cheese|knees)\b|(?:alt|ault|olt|old)\b",
    re.IGNORECASE,
)


class Examples:
    """Hold the sentences, in which nobody says a stop word, and draw from them."""

    def __init__(self, folder: Path = FOLDER) -> None:
        """Read them.

        Raises:
            FileNotFoundError: the package is not installed.
        """
        if not folder.is_dir():
            raise FileNotFoundError(f"{folder}: no WordNet; try: apt-get install wordnet-base")
        sentences = sorted(set(_sentences(folder)))
        self.alike = [one for one in sentences if _ALIKE.search(one)]
        self.others = [one for one in sentences if not _ALIKE.search(one)]

    def draw(self, random: np.random.Generator) -> Other:
        """Return one of them."""
        is_ordinary = random.random() >= 0.5
        return Other(
            text=pick(self.others if is_ordinary else self.alike, random), is_ordinary=is_ordinary
        )


def _sentences(folder: Path) -> Iterator[str]:
    for part in _PARTS:
        for line in (folder / f"data.{part}").read_text(encoding="utf-8").splitlines():
            gloss = "" if line.startswith(_COMMENT) else line.partition(" | ")[2]
            yield from filter(_is_wanted, _QUOTED.findall(gloss))


def _is_wanted(text: str) -> bool:
    is_speakable = _SPEAKABLE.fullmatch(text) and len(text.split()) in _WORDS
    return bool(is_speakable) and is_clean(text)
