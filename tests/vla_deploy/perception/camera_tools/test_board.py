import re
import struct
from pathlib import Path

import cv2
import numpy as np
import pytest

from vla_deploy.perception.camera_tools.board import CalibrationBoard, find_board, write_board
from vla_deploy.perception.camera_tools.errors import BadImages


def test_a_board_is_found_in_its_own_print_corner_for_corner(board: CalibrationBoard) -> None:
    view = find_board(board.image(), board, "print")
    assert view is not None
    assert len(view.pixels) == (board.columns - 1) * (board.rows - 1)
    expected = view.corners_m[:, :2] * board.pixels_per_m + board.margin_px - 0.5
    assert np.abs(view.pixels - expected).max() < 0.6


def test_the_pdf_has_the_boards_true_size(tmp_path: Path) -> None:
    board = CalibrationBoard(columns=6, rows=4, square_m=0.0417)
    write_board(tmp_path / "board.pdf", board)
    data = (tmp_path / "board.pdf").read_bytes()
    found = re.search(rb"MediaBox \[0 0 ([\d.]+) ([\d.]+)\]", data)
    assert found is not None
    margin_m = 2 * board.margin_px / board.pixels_per_m
    for told, squares in zip(found.groups(), (6, 4), strict=True):
        assert float(told) / 72 * 0.0254 == pytest.approx(squares * 0.0417 + margin_m, abs=1e-6)
    start = int(data.rsplit(b"startxref\n", 1)[1].split()[0])
    assert data[start : start + 4] == b"xref"
    table = data[start:].splitlines()
    for number in range(1, 6):
        at = int(table[2 + number].split()[0])
        assert data[at:].startswith(f"{number} 0 obj".encode())


def test_the_png_tells_its_resolution(tmp_path: Path, board: CalibrationBoard) -> None:
    write_board(tmp_path / "board.png", board)
    data = (tmp_path / "board.png").read_bytes()
    at = data.index(b"pHYs") + 4
    across, down, unit = struct.unpack(">IIB", data[at : at + 9])
    assert across == down == pytest.approx(board.pixels_per_m, abs=0.5)
    assert unit == 1
    drawn = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_GRAYSCALE)
    assert np.array_equal(drawn, board.image())


def test_another_ending_is_refused(tmp_path: Path, board: CalibrationBoard) -> None:
    with pytest.raises(BadImages, match=r"\.pdf or \.png"):
        write_board(tmp_path / "board.svg", board)


@pytest.mark.parametrize(
    ("values", "told"),
    [
        ({"columns": 2}, "3 or more"),
        ({"columns": 20, "rows": 20}, "at most 98"),
        ({"square_m": float("nan")}, "0.002 to 0.5"),
        ({"square_m": 36.0}, "0.002 to 0.5"),
    ],
)
def test_no_board_of_nonsense(values: dict[str, float], told: str) -> None:
    with pytest.raises(ValueError, match=told):
        CalibrationBoard(**values)


@pytest.mark.parametrize("level", [0, 128, 255])
def test_an_empty_image_shows_no_board(board: CalibrationBoard, level: int) -> None:
    assert find_board(np.full((240, 320), level, np.uint8), board, "empty") is None


def test_noise_shows_no_board(board: CalibrationBoard) -> None:
    noise = np.random.default_rng(0).integers(0, 256, (240, 320, 3), dtype=np.uint8)
    assert find_board(noise, board, "noise") is None
