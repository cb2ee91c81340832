"""Draw the commands that the command parser learns from, in the recogniser's spelling."""

import re
from functools import cache
from random import Random
from typing import Final

import numpy as np

from training.planner.sentences.composing import Composer

_SPELT: Final = re.compile(r"[a-z' ]+")
_BRITISH: Final = re.compile(r"met(re)")
_SHORT: Final = frozenset({"m", "cm", "mm", "km", "kg", "sec", "secs"})
"""Nobody says these; an engine spells them out letter by letter."""


def draw_planner_command(random: np.random.Generator) -> str:
    """Return a command of words alone: no digits, nothing shortened."""
    while True:
        text = _composer().spoken(Random(int(random.integers(1 << 32))))
        text = _BRITISH.sub("meter", text.lower().replace(",", "")).replace("gray", "grey")
        if _SPELT.fullmatch(text) and _SHORT.isdisjoint(text.split()):
            return " ".join(text.split())


@cache
def _composer() -> Composer:
    return Composer()
