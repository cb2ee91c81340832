"""Select the images that are good for calibration, with the reason why others are not."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from vla_deploy.perception.camera_tools.board import (
    Array,
    BoardView,
    CalibrationBoard,
    Image,
    find_board,
)
from vla_deploy.perception.camera_tools.errors import BadImages

# The brightness step between squares, as a share of it for each pixel: less is out of focus.
SHARP_PER_PX: Final = 0.35
# Corners nearer than this share of the width to those of another image add nothing.
APART_RATIO: Final = 0.03
# The image in cells; corners must have been in this share of them.
COVERED_CELLS: Final = (4, 4)
COVERED_RATIO: Final = 0.6
MIN_VIEWS: Final = 8
_STEP_PX: Final = 6


@dataclass(frozen=True, kw_only=True)
class ViewSelection:
    """Hold the views that are used, and for each image left out the reason."""

    views: tuple[BoardView, ...]
    left_out: dict[str, str]


def select(
    images: Iterable[tuple[str, Image]],
    board: CalibrationBoard,
    *,
    enough: int | None = None,
    on_view: Callable[[BoardView], None] = lambda _: None,
) -> ViewSelection:
    """Return the views that show the board, sharp, each unlike those before.

    It takes no further image once there are `enough`; `on_view` is called with each view used.
    """
    views: list[BoardView] = []
    left_out: dict[str, str] = {}
    for name, image in images:
        view = find_board(image, board, name)
        reason = "the board is not seen" if view is None else why_not(image, view, views)
        if view is None or reason:
            left_out[name] = reason
        else:
            views.append(view)
            on_view(view)
        if len(views) == enough:
            break
    return ViewSelection(views=tuple(views), left_out=left_out)


def why_not(image: Image, view: BoardView, earlier: Sequence[BoardView]) -> str:
    """Return why a view adds nothing to the earlier ones, "" where it does."""
    sharp = sharpness(image, view.pixels)
    if sharp < SHARP_PER_PX:
        return f"blurred: sharpness {sharp:.2f}, expected {SHARP_PER_PX} or more"
    width = image.shape[1]
    for other in earlier:
        if _gap_px(view, other) < APART_RATIO * width:
            return f"too much like {other.name}"
    return ""


def sharpness(image: Image, corners: Array) -> float:
    """Return the slope of edges at the corners, as a share of the contrast there in a pixel."""
    grey = image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)
    found = [_steepness(grey, x, y) for x, y in corners]
    return float(np.median(found))


def _steepness(grey: Image, x: float, y: float) -> float:
    left, top = max(0, round(x) - _STEP_PX), max(0, round(y) - _STEP_PX)
    patch = grey[top : top + 2 * _STEP_PX + 1, left : left + 2 * _STEP_PX + 1].astype(np.float64)
    low, high = np.percentile(patch, (5.0, 95.0))
    across, down = np.abs(np.diff(patch, axis=1)), np.abs(np.diff(patch, axis=0))
    steepest = max(np.percentile(across, 97.0), np.percentile(down, 97.0))
    return float(steepest / max(high - low, 8.0))


def require_variety(views: Sequence[BoardView], size_px: tuple[int, int]) -> None:
    """Check that there are enough views, and that they cover the image.

    Raises:
        BadImages: there are too few, or a part of the image has never shown the board.
    """
    if len(views) < MIN_VIEWS:
        raise BadImages(
            f"{len(views)} usable views, expected {MIN_VIEWS} or more; show the board near and "
            "far, turned and tilted, and in every corner of the image"
        )
    covered = covered_ratio(views, size_px)
    if covered < COVERED_RATIO:
        raise BadImages(
            f"the board was seen in {100 * covered:.0f} % of the image, expected "
            f"{100 * COVERED_RATIO:.0f} %; show it in the corners of the image, too"
        )


def covered_ratio(views: Sequence[BoardView], size_px: tuple[int, int]) -> float:
    """Return in which share of the image's cells corners were seen."""
    cells = np.zeros(COVERED_CELLS, dtype=np.bool_)
    pixels: NDArray[np.float64] = np.vstack([view.pixels for view in views])
    at = (pixels / size_px * COVERED_CELLS).astype(np.intp)
    inside = np.all((at >= 0) & (at < COVERED_CELLS), axis=1)
    cells[at[inside, 0], at[inside, 1]] = True
    return float(cells.mean())


def _gap_px(view: BoardView, other: BoardView) -> float:
    """Return how far apart the corners are that both show; infinite where they share too few."""
    first = {tuple(np.round(corner, 6)): pixel for corner, pixel in _pairs(view)}
    gaps = [
        float(np.linalg.norm(pixel - first[key]))
        for corner, pixel in _pairs(other)
        if (key := tuple(np.round(corner, 6))) in first
    ]
    return float(np.median(gaps)) if len(gaps) >= 4 else float("inf")


def _pairs(view: BoardView) -> Iterable[tuple[Array, Array]]:
    return zip(view.corners_m, view.pixels, strict=True)
