import cv2
import numpy as np
import pytest

from vla_deploy.model_servers.calls.picture import LONGEST_PX, MOST_BYTES, small_jpeg


@pytest.mark.parametrize("shape", [(480, 640), (1080, 1920), (900, 300), (1, 1)])
def test_an_image_fits_its_bounds_and_keeps_its_shape(shape):
    noise = np.random.default_rng(1).integers(0, 256, (*shape, 3), dtype=np.uint8)
    jpeg = small_jpeg(noise)
    height, width = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR).shape[:2]
    assert len(jpeg) <= MOST_BYTES
    assert max(height, width) <= LONGEST_PX
    assert max(1, round(shape[0] * width / shape[1])) == pytest.approx(height, abs=2)


def test_what_cannot_fit_becomes_coarser_and_smaller_until_it_does():
    noise = np.random.default_rng(1).integers(0, 256, (480, 640, 3), dtype=np.uint8)
    assert len(small_jpeg(noise, 3000)) <= 3000


def test_colours_stay_what_they_are():
    red = np.zeros((64, 64, 3), np.uint8)
    red[..., 0] = 250
    decoded = cv2.imdecode(np.frombuffer(small_jpeg(red), np.uint8), cv2.IMREAD_COLOR)
    assert decoded.mean(axis=(0, 1)) == pytest.approx([0, 0, 250], abs=8)
