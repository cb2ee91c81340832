"""Name colours by one table over hue, saturation and brightness."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class ColourRange:
    """Bound one colour name; hue is in OpenCV's 0..179, the others 0..255, bounds included."""

    name: str
    hue: tuple[int, int]
    saturation: tuple[int, int]
    value: tuple[int, int]


ANY_HUE = (0, 179)
# The first row that holds wins; the last rows catch what is left of the hue circle.
COLOURS: tuple[ColourRange, ...] = (
    ColourRange("black", ANY_HUE, (0, 255), (0, 38)),
    ColourRange("black", ANY_HUE, (0, 140), (39, 66)),
    ColourRange("white", ANY_HUE, (0, 38), (175, 255)),
    ColourRange("grey", ANY_HUE, (0, 48), (39, 255)),
    ColourRange("pink", (145, 179), (49, 150), (150, 255)),
    ColourRange("pink", (0, 7), (49, 130), (190, 255)),
    ColourRange("pink", (150, 168), (49, 255), (150, 255)),
    ColourRange("brown", (6, 24), (49, 255), (39, 150)),
    ColourRange("brown", (6, 20), (49, 150), (151, 205)),
    ColourRange("red", (0, 6), (49, 255), (39, 255)),
    ColourRange("orange", (7, 20), (49, 255), (151, 255)),
    ColourRange("yellow", (21, 34), (49, 255), (39, 255)),
    ColourRange("green", (35, 86), (49, 255), (39, 255)),
    ColourRange("blue", (87, 127), (49, 255), (39, 255)),
    ColourRange("purple", (128, 160), (49, 255), (39, 255)),
    ColourRange("red", (161, 179), (49, 255), (39, 255)),
)
UNNAMED = "grey"
NAMES: tuple[str, ...] = tuple(dict.fromkeys(row.name for row in COLOURS))


Rows = NDArray[np.uint16]


def _rows_by_level(bounds: list[tuple[int, int]]) -> Rows:
    """Return for each level of a channel the set, one bit each, of the rows that allow it."""
    levels = np.arange(256)
    sets = np.zeros(256, np.uint16)
    for row, (low, high) in enumerate(bounds):
        sets[(levels >= low) & (levels <= high)] |= 1 << row
    return sets


def _name_by_rows() -> NDArray[np.intp]:
    """Return for each set of rows the name of the first one in it."""
    sets = np.arange(1 << len(COLOURS))
    names = np.full(len(sets), NAMES.index(UNNAMED), dtype=np.intp)
    for row in reversed(range(len(COLOURS))):
        names[sets & 1 << row > 0] = NAMES.index(COLOURS[row].name)
    return names


_HUE_ROWS = _rows_by_level([row.hue for row in COLOURS])
_SATURATION_ROWS = _rows_by_level([row.saturation for row in COLOURS])
_VALUE_ROWS = _rows_by_level([row.value for row in COLOURS])
_NAME_OF_ROWS = _name_by_rows()


def colour_names(rgb: NDArray[np.uint8]) -> NDArray[np.intp]:
    """Return for each of (n, 3) pixels the index of its colour's name in `NAMES`."""
    hsv = cv2.cvtColor(np.ascontiguousarray(rgb).reshape(-1, 1, 3), cv2.COLOR_RGB2HSV)
    rows = _HUE_ROWS[hsv[:, 0, 0]] & _SATURATION_ROWS[hsv[:, 0, 1]] & _VALUE_ROWS[hsv[:, 0, 2]]
    names: NDArray[np.intp] = _NAME_OF_ROWS[rows]
    return names


def dominant_colour(rgb: NDArray[np.uint8]) -> tuple[str, float]:
    """Return the commonest colour name of (n, 3) pixels and the share of pixels it has."""
    counts = np.bincount(colour_names(rgb), minlength=len(NAMES))
    best = int(np.argmax(counts))
    return NAMES[best], float(counts[best] / max(1, len(rgb)))
