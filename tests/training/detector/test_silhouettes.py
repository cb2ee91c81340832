import mujoco
import numpy as np
import pytest

from training.detector.scenes.drawing import HEIGHT_PX
from training.detector.scenes.silhouettes import extent

WORLD = """
<mujoco>
  <worldbody>
    <camera name="butler_head_camera" pos="0 0 1" fovy="60"/>
    <body name="thing" pos="0 0 0" euler="0 {tilt} 30">
      <geom type="{kind}" size="{size}"/>
    </body>
  </worldbody>
</mujoco>
"""
FOCAL_PX = HEIGHT_PX / 2 / np.tan(np.radians(30))


def seen(kind: str, size: str, tilt: float = 0.0) -> np.ndarray:
    """Return the extent of one geom a metre below the camera."""
    model = mujoco.MjModel.from_xml_string(WORLD.format(kind=kind, size=size, tilt=tilt))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    box = extent(model, data, [0])
    assert box is not None
    return box


@pytest.mark.parametrize("tilt", [0, 35, 80])
def test_a_ball_is_as_wide_as_it_is_however_it_is_turned(tilt: float) -> None:
    left, top, right, bottom = seen("sphere", "0.05", tilt)

    assert right - left == pytest.approx(2 * 0.05 * FOCAL_PX, rel=0.05)
    assert bottom - top == pytest.approx(2 * 0.05 * FOCAL_PX, rel=0.05)


@pytest.mark.parametrize(
    ("kind", "size", "long_m"),
    [("cylinder", "0.03 0.1", 0.2), ("capsule", "0.03 0.1", 0.26), ("box", "0.03 0.03 0.1", 0.2)],
)
def test_a_lying_thing_is_as_long_as_it_is(kind: str, size: str, long_m: float) -> None:
    left, top, right, bottom = seen(kind, size, 90)

    assert np.hypot(right - left, bottom - top) >= long_m * FOCAL_PX
    assert np.hypot(right - left, bottom - top) <= 1.25 * long_m * FOCAL_PX


def test_what_reaches_behind_the_camera_has_no_extent() -> None:
    model = mujoco.MjModel.from_xml_string(WORLD.format(kind="sphere", size="0.99", tilt=0))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)

    assert extent(model, data, [0]) is None
