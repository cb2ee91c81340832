"""Reduce an RGB-D image to the grid on which geometry is measured, whatever the camera's size.

The detector gets every pixel. The cost of clouds, masks and clusters grows with their points, and
their bounds (noise, least number of pixels) hold for one density. Smaller images stay as they are.
"""

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final, TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from drivers.camera.base import RgbdFrame
from drivers.camera.protocol import Intrinsics
from vla_deploy.perception.images.network_view import NetworkView

GRID_PIXELS: Final = 320 * 240
EDGE_RATIO: Final = 0.015
"""Steps in depth between neighbours, over the depth, that are an edge or a hole and no surface."""
SIZES_KEPT: Final = 8
DepthT = TypeVar("DepthT", np.uint16, np.float32)
Places = slice | NDArray[np.intp]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Between:
    """Hold for each of a row's wanted places the pixels around it, and how far along it lies."""

    before: Places
    behind: Places
    nearest: Places
    share: NDArray[np.float32]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GeometryGrid:
    """Hold a camera, and the one that sees the same on the geometry's grid."""

    source: Intrinsics
    camera: Intrinsics

    @property
    def is_whole(self) -> bool:
        """Return whether the grid is the image itself."""
        return self.camera == self.source

    def frame(self, frame: RgbdFrame) -> RgbdFrame:
        """Return a frame of the source as the grid's camera would have taken it."""
        return replace(
            frame,
            intrinsics=self.camera,
            rgb=self.colours(frame.rgb),
            depth=self.depth(frame.depth),
        )

    def colours(self, rgb: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return the colour image on the grid, each pixel the mean of what it covers."""
        if self.is_whole:
            return rgb
        size = (self.camera.width, self.camera.height)
        return np.asarray(cv2.resize(rgb, size, interpolation=cv2.INTER_AREA), np.uint8)

    def depth(self, depth: NDArray[DepthT]) -> NDArray[DepthT]:
        """Return the depth image at the grid's places, in its own unit; 0 stays no depth.

        On a surface it is the mean of the four pixels around; across an edge, where a mean would
        lie on neither side, and beside a hole it is that of the nearest pixel.
        """
        if self.is_whole:
            return depth
        rows = _between(self.source.height, self.camera.height)
        columns = _between(self.source.width, self.camera.width)
        around = [
            depth[row][:, column].astype(np.float32)
            for row in (rows.before, rows.behind)
            for column in (columns.before, columns.behind)
        ]
        down, across = rows.share[:, None], columns.share
        upper = around[0] + across * (around[1] - around[0])
        lower = around[2] + across * (around[3] - around[2])
        mean = upper + down * (lower - upper)
        nearest = depth[rows.nearest][:, columns.nearest]
        low, high = np.minimum.reduce(around), np.maximum.reduce(around)
        found = np.where(high - low <= EDGE_RATIO * low, mean, nearest)
        return (np.rint(found) if depth.dtype == np.uint16 else found).astype(depth.dtype)

    def view(self, network: NetworkView | None) -> NetworkView | None:
        """Return what was found in the source's image, its boxes in the grid's pixels."""
        if network is None or self.is_whole:
            return network
        across = self.camera.width / self.source.width
        down = self.camera.height / self.source.height
        scale = np.array((across, down) * 2, dtype=np.float32)
        return network.at(network.boxes.corners_px * scale)


def geometry_grid(source: Intrinsics) -> GeometryGrid:
    """Return the grid of a camera: all of its view in about `GRID_PIXELS` pixels at most."""
    shrink = min(1.0, math.sqrt(GRID_PIXELS / (source.width * source.height)))
    width, height = max(1, round(shrink * source.width)), max(1, round(shrink * source.height))
    across, down = width / source.width, height / source.height
    camera = replace(
        source,
        width=width,
        height=height,
        fx=source.fx * across,
        fy=source.fy * down,
        cx=(source.cx + 0.5) * across - 0.5,
        cy=(source.cy + 0.5) * down - 0.5,
    )
    # Of an image that is small enough nothing is changed, not even by rounding.
    return GeometryGrid(source=source, camera=camera if shrink < 1.0 else source)


@lru_cache(maxsize=SIZES_KEPT)
def _between(pixels: int, wanted: int) -> _Between:
    # Pixel k covers the image from k - 0.5 to k + 0.5.
    places = (np.arange(wanted) + 0.5) * pixels / wanted - 0.5
    before = np.floor(places).astype(np.intp)
    return _Between(
        before=_evenly(before),
        behind=_evenly(np.minimum(before + 1, pixels - 1)),
        nearest=_evenly(np.floor(places + 0.5).astype(np.intp)),
        share=(places - before).astype(np.float32),
    )


def _evenly(places: NDArray[np.intp]) -> Places:
    """Return places at equal steps as a slice, which costs a tenth of an index; others as given."""
    steps = np.unique(np.diff(places))
    if steps.size != 1 or steps[0] < 1:
        return places
    return slice(int(places[0]), int(places[-1]) + 1, int(steps[0]))
