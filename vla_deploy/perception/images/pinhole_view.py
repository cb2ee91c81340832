"""Show a network the image of a pinhole, and put its boxes where the camera's own image has them.

Networks learn from images in which straight lines are straight. Everything else works on the image
as the lens bends it, so that depth and colour of a pixel stay together.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from drivers.camera.base import RgbdFrame
from drivers.camera.protocol import Intrinsics
from vla_deploy.perception.geometry.lens import bent_boxes, flattened, needs_flattening
from vla_deploy.perception.images.network_view import NetworkView


def as_pinhole(frame: RgbdFrame) -> NDArray[np.uint8]:
    """Return the image without the lens' distortion; as it is where that is too small to matter."""
    camera = frame.intrinsics
    return flattened(frame.rgb, camera) if needs_flattening(camera) else frame.rgb


def in_image(network: NetworkView | None, camera: Intrinsics) -> NetworkView | None:
    """Return what a network saw of `as_pinhole`, its boxes as they lie in the camera's image."""
    if network is None or not needs_flattening(camera):
        return network
    corners_px = bent_boxes(camera, network.boxes.corners_px)
    return replace(network, boxes=replace(network.boxes, corners_px=corners_px))
