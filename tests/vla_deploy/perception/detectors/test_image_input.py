import dataclasses

import cv2
import numpy as np
import pytest

from vla_deploy.inference.manifest import Fit, TensorLayout
from vla_deploy.perception.detectors.boxes import Boxes
from vla_deploy.perception.detectors.image_input import fit_image


@pytest.fixture
def image(blob_manifest):
    def image(**changes):
        return dataclasses.replace(blob_manifest.detection.image, **changes)

    return image


@pytest.fixture
def rgb():
    return np.random.default_rng(3).integers(0, 256, (64, 96, 3), dtype=np.uint8)


def boxes(*corners: tuple[float, ...]) -> Boxes:
    return Boxes(
        corners_px=np.array(corners, dtype=np.float32),
        scores=np.ones(len(corners), dtype=np.float32),
        classes=np.zeros(len(corners), dtype=np.intp),
    )


def test_an_image_of_the_right_size_is_only_scaled_and_ordered(image, rgb):
    tensor, _ = fit_image(rgb, image(), "float32")
    assert (tensor.shape, tensor.dtype) == ((1, 3, 64, 96), np.float32)
    for channel in range(3):
        assert tensor[0, channel] == pytest.approx(rgb[..., channel] / 255.0, abs=1e-6)


@pytest.mark.parametrize(
    ("changes", "dtype", "expected"),
    [
        ({"layout": TensorLayout.NHWC}, "float32", lambda rgb: rgb / 255.0),
        (
            {"colour": "bgr", "layout": TensorLayout.NHWC},
            "float32",
            lambda rgb: rgb[..., ::-1] / 255.0,
        ),
        ({"scale": 1.0, "layout": TensorLayout.NHWC}, "uint8", lambda rgb: rgb),
        (
            {"mean": (0.1, 0.2, 0.3), "std": (0.5, 0.25, 2.0), "layout": TensorLayout.NHWC},
            "float32",
            lambda rgb: (rgb / 255.0 - np.array([0.1, 0.2, 0.3])) / np.array([0.5, 0.25, 2.0]),
        ),
        (
            # Means are of the network's channels, in its order.
            {"mean": (0.5, 0.0, 0.0), "colour": "bgr", "layout": TensorLayout.NHWC},
            "float32",
            lambda rgb: rgb[..., ::-1] / 255.0 - np.array([0.5, 0.0, 0.0]),
        ),
    ],
)
def test_order_of_colours_and_dimensions_and_values_are_as_declared(
    image, rgb, changes, dtype, expected
):
    tensor, _ = fit_image(rgb, image(**changes), dtype)
    assert (tensor.shape, tensor.dtype) == ((1, 64, 96, 3), np.dtype(dtype))
    assert tensor[0] == pytest.approx(expected(rgb), abs=1e-5)


@pytest.mark.parametrize(
    ("height", "width", "top", "left"), [(128, 96, 0, 24), (64, 192, 16, 0), (32, 48, 0, 0)]
)
def test_a_letterbox_keeps_proportions_and_pads_evenly(image, height, width, top, left):
    rgb = np.full((height, width, 3), 200, dtype=np.uint8)
    tensor, placement = fit_image(rgb, image(scale=1.0), "float32")
    inner = tensor[0, 0, top : 64 - top, left : 96 - left]
    assert (inner == 200).all()
    assert (tensor == 114).sum() == tensor.size - 3 * inner.size
    whole = placement.to_image(boxes((left, top, 96 - left, 64 - top)))
    assert whole.corners_px.tolist() == [[0, 0, width, height]]


def test_a_stretched_image_fills_the_input(image):
    rgb = np.random.default_rng(4).integers(0, 256, (128, 96, 3), dtype=np.uint8)
    tensor, placement = fit_image(rgb, image(fit=Fit.STRETCH, scale=1.0), "float32")
    expected = cv2.resize(rgb, (96, 64), interpolation=cv2.INTER_LINEAR)
    assert (tensor[0].transpose(1, 2, 0) == expected).all()
    moved = placement.to_image(boxes((10, 10, 20, 20)))
    assert moved.corners_px.tolist() == [[10, 20, 20, 40]]


def test_boxes_are_cut_off_at_the_border_and_left_out_in_the_padding(image):
    rgb = np.zeros((128, 96, 3), dtype=np.uint8)  # 24 px of padding on the left and the right
    _, placement = fit_image(rgb, image(), "float32")
    found = placement.to_image(boxes((0, 0, 20, 64), (20, -5, 30, 10), (70, 60, 99, 70)))
    assert found.corners_px.tolist() == [[0, 0, 12, 20], [92, 120, 96, 128]]
