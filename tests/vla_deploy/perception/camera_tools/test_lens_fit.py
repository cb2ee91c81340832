"""A lens is found again from images that it took; what shows too little is refused."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest
from numpy.typing import NDArray

from drivers.camera.protocol import Intrinsics
from vla_deploy.perception.camera_tools.board import BoardView, CalibrationBoard
from vla_deploy.perception.camera_tools.errors import BadImages, ImplausibleResult
from vla_deploy.perception.camera_tools.lens_fit import fit_lens
from vla_deploy.perception.camera_tools.selecting import ViewSelection, select
from vla_deploy.perception.geometry.lens import project, rays_of

if TYPE_CHECKING:
    from conftest import BoardCamera

Images = dict[str, NDArray[np.uint8]]
SIZE = (320, 240)


@pytest.fixture(scope="module")
def chosen(images: Images, board: CalibrationBoard) -> ViewSelection:
    return select(images.items(), board)


def distance_px(lens: Intrinsics, true: Intrinsics) -> float:
    """Return by how much two lenses put the same directions apart, at worst in the image."""
    pixels = np.mgrid[8:312:8, 8:232:8].reshape(2, -1).T.astype(np.float64)
    rays = np.column_stack((rays_of(true, pixels), np.ones(len(pixels))))
    return float(np.linalg.norm(project(lens, rays) - pixels, axis=1).max())


def test_a_known_lens_is_found_again(chosen: ViewSelection, board_camera: "BoardCamera") -> None:
    fit = fit_lens(chosen.views, SIZE)
    assert fit.intrinsics.fx == pytest.approx(board_camera.lens.fx, rel=0.01)
    assert fit.intrinsics.fy == pytest.approx(board_camera.lens.fy, rel=0.01)
    assert fit.error_px < 0.4
    assert distance_px(fit.intrinsics, board_camera.lens) < 4.0
    pinhole = replace(board_camera.lens, distortion=())
    assert distance_px(pinhole, board_camera.lens) > 12.0
    assert set(fit.view_errors_px) == {view.name for view in chosen.views}
    assert abs(fit.intrinsics.fx - board_camera.lens.fx) < 3.0 * fit.sigma_px[0]


def test_the_rational_model_fits_as_well(
    chosen: ViewSelection, board_camera: "BoardCamera"
) -> None:
    fit = fit_lens(chosen.views, SIZE, "rational_polynomial")
    assert len(fit.intrinsics.distortion) == 8
    assert fit.error_px < 0.4


def test_one_view_with_wrong_corners_is_left_out(chosen: ViewSelection) -> None:
    wrong = replace(chosen.views[3], name="bent")
    wrong.pixels[:] = wrong.pixels + np.random.default_rng(0).normal(0.0, 6.0, wrong.pixels.shape)
    fit = fit_lens([*chosen.views[:3], wrong, *chosen.views[4:]], SIZE)
    assert set(fit.outliers) == {"bent"}
    assert fit.error_px < 0.4


def test_a_board_of_another_form_is_refused(chosen: ViewSelection) -> None:
    # Squares half as high as wide: as a print that was stretched.
    stretched = [
        replace(view, corners_m=view.corners_m * (1.0, 0.5 + 0.03 * number, 1.0))
        for number, view in enumerate(chosen.views)
    ]
    with pytest.raises((ImplausibleResult, BadImages)):
        fit_lens(stretched, SIZE)


def test_too_few_views_are_refused(chosen: ViewSelection) -> None:
    with pytest.raises(BadImages, match="5 usable views, expected 8"):
        fit_lens(chosen.views[:5], SIZE)


def test_views_of_one_corner_of_the_image_are_refused(chosen: ViewSelection) -> None:
    def moved(view: BoardView) -> BoardView:
        return replace(view, pixels=view.pixels * 0.45)

    with pytest.raises(BadImages, match="show it in the corners"):
        fit_lens([moved(view) for view in chosen.views], SIZE)


def test_boards_that_all_face_the_camera_are_refused(board: CalibrationBoard) -> None:
    camera = Intrinsics(width=320, height=240, fx=220.0, fy=220.0, cx=160.0, cy=120.0)
    flat = [
        BoardView(
            name=f"{x} {y}",
            pixels=project(camera, board.corners_m + np.array((x, y, 0.3))),
            corners_m=board.corners_m,
        )
        for x in (-0.2, -0.12, -0.05)
        for y in (-0.15, -0.09, -0.03)
    ]
    with pytest.raises(BadImages, match="tilt it"):
        fit_lens(flat, SIZE)


def test_images_without_board_blurred_or_alike_are_left_out_with_the_reason(
    images: Images, board: CalibrationBoard, board_camera: "BoardCamera"
) -> None:
    name, good = next(iter(images.items()))
    blurred = np.clip(
        np.mean([np.roll(good, shift, axis=1) for shift in range(-1, 2)], axis=0), 0, 255
    ).astype(np.uint8)
    offered = {name: good, "again": good, "empty": np.zeros_like(good), "shaken": blurred}
    selection = select(offered.items(), board)
    assert [view.name for view in selection.views] == [name]
    assert selection.left_out["empty"] == "the board is not seen"
    assert f"like {name}" in selection.left_out["again"]
    assert "shaken" in selection.left_out


def test_no_more_images_are_taken_than_are_needed(images: Images, board: CalibrationBoard) -> None:
    offered = iter(images.items())
    told: list[str] = []
    selection = select(offered, board, enough=2, on_view=lambda view: told.append(view.name))
    assert [view.name for view in selection.views] == told
    assert len(told) == 2
    assert len(list(offered)) == len(images) - 2 - len(selection.left_out)
