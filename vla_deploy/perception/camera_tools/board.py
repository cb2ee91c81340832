"""Describe a ChArUco board, draw it in true size, and find it in images.

ChArUco: a chessboard with a marker in each white square, so that each corner has a number and the
board need not be seen whole. Corners are found to a small part of a pixel.
"""

import struct
import zlib
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from vla_deploy.perception.camera_tools.errors import BadImages

Array = NDArray[np.float64]
Image = NDArray[np.uint8]

# A little more than 200 dots an inch.
PIXELS_PER_M: Final = 8000
MARGIN_RATIO: Final = 0.25
MARKER_RATIO: Final = 0.75
MIN_CORNERS: Final = 8
_POINTS_PER_M: Final = 72 / 0.0254
# A square of fewer pixels blurs into its markers.
_REFINE_PX: Final = 3


@dataclass(frozen=True, kw_only=True)
class CalibrationBoard:
    """Describe a board by its squares; `square_m` must be measured on the print."""

    columns: int = 7
    rows: int = 5
    square_m: float = 0.036

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            ValueError: there are too few squares, too many for the markers, or none of any size.
        """
        squares = self.columns * self.rows
        if min(self.columns, self.rows) < 3 or squares > 98:
            raise ValueError(
                f"a board has 3 or more squares each way and at most 98, got {self.columns} x "
                f"{self.rows}"
            )
        if not 0.002 <= self.square_m <= 0.5:
            raise ValueError(f"a square is 0.002 to 0.5 m wide, got {self.square_m}")

    @cached_property
    def grid(self) -> Any:
        """Return OpenCV's board."""
        markers = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
        size = (self.columns, self.rows)
        return cv2.aruco.CharucoBoard(size, self.square_m, MARKER_RATIO * self.square_m, markers)

    @cached_property
    def corners_m(self) -> Array:
        """Return the inner corners (n, 3) in the board's frame: x right, y down, on z = 0."""
        corners: Array = np.array(self.grid.getChessboardCorners(), dtype=np.float64)
        return corners

    @property
    def pixels_per_m(self) -> float:
        """Return the resolution of `image`: a square has a whole number of pixels."""
        return round(self.square_m * PIXELS_PER_M) / self.square_m

    @property
    def margin_px(self) -> int:
        """Return how wide the white margin of `image` is."""
        return round(MARGIN_RATIO * self.square_m * self.pixels_per_m)

    def image(self) -> Image:
        """Return the board drawn with a white margin, one byte a pixel."""
        drawn: Image = self.grid.generateImage(
            self.image_size, marginSize=self.margin_px, borderBits=1
        )
        return drawn

    @property
    def image_size(self) -> tuple[int, int]:
        """Return width and height of `image` in pixels."""
        square = round(self.square_m * self.pixels_per_m)
        wide, high = (count * square + 2 * self.margin_px for count in (self.columns, self.rows))
        return wide, high


@dataclass(frozen=True, kw_only=True, eq=False)
class BoardView:
    """Hold the corners of one image: where they are in it (n, 2) and on the board (n, 3)."""

    name: str
    pixels: Array
    corners_m: Array


def find_board(image: Image, board: CalibrationBoard, name: str) -> BoardView | None:
    """Return the corners that an image (grey or RGB) shows, None where it shows too few."""
    grey = image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)
    corners, numbers = _detector(board).detectBoard(grey)[:2]
    if numbers is None or len(numbers) < MIN_CORNERS:
        return None
    chosen = np.asarray(numbers, dtype=np.intp).ravel()
    pixels = np.asarray(corners, dtype=np.float64).reshape(-1, 2)
    return BoardView(name=name, pixels=pixels, corners_m=board.corners_m[chosen])


def _detector(board: CalibrationBoard) -> Any:
    markers = cv2.aruco.DetectorParameters()
    markers.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    markers.cornerRefinementWinSize = _REFINE_PX
    # Small markers of small images count, too.
    markers.minMarkerPerimeterRate = 0.01
    return cv2.aruco.CharucoDetector(
        board.grid, cv2.aruco.CharucoParameters(), markers, cv2.aruco.RefineParameters()
    )


def write_board(file: Path, board: CalibrationBoard) -> None:
    """Write a printable board in its true size, as PDF or PNG by the file's ending.

    Raises:
        BadImages: the ending is another.
        OSError: it cannot be written.
    """
    encoders = {".pdf": _as_pdf, ".png": _as_png}
    encode = encoders.get(file.suffix.lower())
    if encode is None:
        raise BadImages(f"{file}: expected a name that ends in .pdf or .png")
    file.write_bytes(encode(board.image(), board.pixels_per_m))


def _as_png(image: Image, pixels_per_m: float) -> bytes:
    """Return a PNG with its resolution, so that programs print it in true size."""
    _, encoded = cv2.imencode(".png", image)
    data = bytes(encoded)
    per_m = round(pixels_per_m)
    body = b"pHYs" + struct.pack(">IIB", per_m, per_m, 1)
    chunk = struct.pack(">I", len(body) - 4) + body + struct.pack(">I", zlib.crc32(body))
    after_header = 8 + 25
    return data[:after_header] + chunk + data[after_header:]


def _as_pdf(image: Image, pixels_per_m: float) -> bytes:
    """Return a PDF page of exactly the board's size; print it without scaling."""
    height, width = image.shape
    points = [f"{size / pixels_per_m * _POINTS_PER_M:.4f}" for size in (width, height)]
    pixels = zlib.compress(image.tobytes(), 9)
    drawing = f"{points[0]} 0 0 {points[1]} 0 0 cm /Board Do".encode()
    objects = (
        b"<< /Type /Catalog /Pages 2 0 R >>",
        b"<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
        (
            f"<< /Type /Page /Parent 2 0 R /MediaBox [0 0 {points[0]} {points[1]}] "
            "/Contents 4 0 R /Resources << /XObject << /Board 5 0 R >> >> >>"
        ).encode(),
        f"<< /Length {len(drawing)} >>\nstream\n".encode() + drawing + b"\nendstream",
        (
            f"<< /Type /XObject /Subtype /Image /Width {width} /Height {height} /ColorSpace "
            f"/DeviceGray /BitsPerComponent 8 /Filter /FlateDecode /Length {len(pixels)} >>\n"
        ).encode()
        + b"stream\n"
        + pixels
        + b"\nendstream",
    )
    return _joined(objects)


def _joined(objects: tuple[bytes, ...]) -> bytes:
    """Return a PDF file of objects, with the table of where each begins."""
    file, starts = bytearray(b"%PDF-1.4\n"), []
    for number, content in enumerate(objects, start=1):
        starts.append(len(file))
        file += f"{number} 0 obj\n".encode() + content + b"\nendobj\n"
    table = len(file)
    file += f"xref\n0 {len(objects) + 1}\n0000000000 65535 f \n".encode()
    file += b"".join(f"{start:010d} 00000 n \n".encode() for start in starts)
    file += f"trailer\n<< /Size {len(objects) + 1} /Root 1 0 R >>\n".encode()
    return bytes(file + f"startxref\n{table}\n%%EOF\n".encode())
