"""What a network is shown of a lens that bends, and where its boxes belong."""

from dataclasses import replace

import numpy as np
import pytest

from drivers.camera.base import RgbdFrame
from drivers.camera.protocol import Intrinsics
from vla_deploy.perception.detectors.boxes import Boxes
from vla_deploy.perception.images.network_view import NetworkView
from vla_deploy.perception.images.pinhole_view import as_pinhole, in_image
from vla_deploy.perception.naming.class_weighting import Voice

CAMERA = Intrinsics(
    width=320, height=240, fx=216.5, fy=216.5, cx=159.5, cy=119.5, distortion=(-0.3, 0.1, 0, 0, 0)
)
SQUARE = (20, 180, 60, 220)


def frame_of(camera: Intrinsics) -> RgbdFrame:
    rgb = np.zeros((240, 320, 3), np.uint8)
    left, top, right, bottom = SQUARE
    rgb[top:bottom, left:right] = 255
    depth = np.ones((240, 320), np.uint16)
    return RgbdFrame(
        stamp_ns=0, sequence=0, intrinsics=camera, depth_unit_m=0.001, rgb=rgb, depth=depth
    )


def test_a_box_that_a_network_draws_lies_on_the_thing_in_the_cameras_image() -> None:
    shown = as_pinhole(frame_of(CAMERA))
    rows, columns = np.nonzero(shown[..., 0] > 127)
    box = np.array([[columns.min(), rows.min(), columns.max(), rows.max()]], np.float32)
    boxes = Boxes(corners_px=box, scores=np.array([0.9], np.float32), classes=np.array([0]))
    view = in_image(NetworkView(boxes=boxes, voices=(Voice(class_name="cup"),)), CAMERA)
    assert view is not None
    assert view.words_for(SQUARE)
    assert view.boxes.corners_px[0] == pytest.approx(SQUARE, abs=6.0)


def test_a_pinholes_image_is_shown_as_it_is() -> None:
    frame = frame_of(replace(CAMERA, distortion=()))
    assert as_pinhole(frame) is frame.rgb
    assert in_image(None, CAMERA) is None
