"""Name the sounds of English alike for all engines, whatever each calls them.

The names are those of the Carnegie Mellon dictionary, which flite and festival use; eSpeak's many
vowels of eight accents fall onto them.
"""

from collections.abc import Mapping
from typing import Final

SILENCE: Final = "pau"
PHONES: Final = (
    SILENCE, "aa", "ae", "ah", "ao", "aw", "ax", "ay", "b", "ch", "d", "dh", "eh", "er", "ey",
    "f", "g", "hh", "ih", "iy", "jh", "k", "l", "m", "n", "ng", "ow", "oy", "p", "r", "s", "sh",
    "t", "th", "uh", "uw", "v", "w", "y", "z", "zh",
)  # fmt: skip
NUMBERS: Final[Mapping[str, int]] = {phone: number for number, phone in enumerate(PHONES)}

STRESS: Final = "',%="
"""eSpeak NG, docs/phonemes.md: primary, secondary, diminished, and of the word before."""
ESPEAK: Final[Mapping[str, str]] = {
    "_": SILENCE, "_:": SILENCE, "_|": SILENCE, "_!": SILENCE,
    "0": "aa", "A:": "aa", "A@": "aa", "aa": "ae", "a": "ae", "a#": "ax", "V": "ah", "VR": "er",
    "O:": "ao", "O@": "ao", "o@": "ao", "O2": "ao", "O": "ao", "aU": "aw", "@": "ax", "@2": "ax",
    "@5": "ax", "@L": "l", "aI": "ay", "aI2": "ay", "aI3": "ay", "aI@": "ay", "E": "eh", "e@": "eh",
    "3": "er", "3:": "er", "eI": "ey", "I": "ih", "I2": "ih", "I#": "ih", "IR": "er", "i": "iy",
    "i:": "iy", "i@": "iy", "i@3": "iy", "oU": "ow", "OI": "oy", "U": "uh", "U@": "uh", "u:": "uw",
    "b": "b", "tS": "ch", "d": "d", "D": "dh", "f": "f", "g": "g", "h": "hh", "dZ": "jh", "k": "k",
    "x": "k", "l": "l", "L": "l", "m": "m", "n": "n", "n-": "n", "N": "ng", "p": "p", "r": "r",
    "r-": "r", "s": "s", "S": "sh", "t": "t", "t#": "t", "t[": "t", "t2": "t", "?": "t",
    "T": "th", "v": "v", "w": "w", "w#": "w", "j": "y", ";": "y", "z": "z", "z#": "z", "Z": "zh",
}  # fmt: skip


def from_espeak(name: str) -> str | None:
    """Return the phone for a mnemonic of eSpeak, None for marks that are no sound.

    From 1.52 on a vowel's stress stands before it.
    """
    return ESPEAK.get(name.lstrip(STRESS))


def from_dictionary(name: str) -> str | None:
    """Return the phone for a name as flite and festival give it."""
    name = {"h#": SILENCE, "axr": "er", "em": "m", "en": "n", "el": "l", "nx": "n", "dx": "t"}.get(
        name, name
    )
    return name if name in NUMBERS else None
