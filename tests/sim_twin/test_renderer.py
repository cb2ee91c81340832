import gc
import subprocess
import sys
from collections.abc import Iterator

import mujoco
import numpy as np
import pytest

from sim_twin.errors import TwinModelMismatch
from sim_twin.physics.engine import Engine
from sim_twin.pictures.renderer import Renderer, fixed_camera

WITHOUT_EGL = """
import ctypes, sys
import OpenGL.platform.ctypesloader as loader
def missing(*arguments, **options):
    raise ImportError("Unable to load EGL library")
loader.loadLibrary = missing
from sim_twin.errors import OpenGLMissing
from sim_twin.pictures.renderer import open_gl_context
try:
    open_gl_context(64, 48)
except OpenGLMissing as error:
    print(error)
"""


@pytest.fixture
def renderer(engine: Engine) -> Iterator[Renderer]:
    renderer = Renderer(engine.model, 160, 120)
    yield renderer
    renderer.close()


@pytest.mark.gl
def test_depth_is_in_metres_along_the_optical_axis(engine: Engine, renderer: Renderer) -> None:
    rgb, depth_m = renderer.render(engine.data, fixed_camera(engine.model, "head_camera"))
    # The wall is flat and faces the camera: the same depth off the axis as on it.
    assert depth_m[60, 80] == pytest.approx(2.0, abs=0.005)
    assert depth_m[60, 20] == pytest.approx(2.0, abs=0.005)
    assert rgb.shape == (120, 160, 3)


@pytest.mark.gl
def test_images_are_upright(engine: Engine, renderer: Renderer) -> None:
    _, depth_m = renderer.render(engine.data, fixed_camera(engine.model, "head_camera"))
    assert depth_m[115, 80] < 1.5 < depth_m[60, 80]


@pytest.mark.gl
def test_the_same_state_gives_the_same_picture(engine: Engine, renderer: Renderer) -> None:
    view = fixed_camera(engine.model, "head_camera")
    first, second = renderer.render(engine.data, view), renderer.render(engine.data, view)
    np.testing.assert_array_equal(first[0], second[0])
    np.testing.assert_array_equal(first[1], second[1])


@pytest.mark.gl
def test_a_forgotten_renderer_leaves_the_others_intact(engine: Engine) -> None:
    view = fixed_camera(engine.model, "head_camera")
    forgotten = Renderer(engine.model, 64, 48)
    kept = Renderer(engine.model, 160, 120)
    before = kept.render(engine.data, view)[0]
    del forgotten
    gc.collect()
    np.testing.assert_array_equal(kept.render(engine.data, view)[0], before)
    kept.close()
    kept.close()


def test_missing_opengl_is_one_line_that_names_the_packages() -> None:
    answer = subprocess.run(
        [sys.executable, "-c", WITHOUT_EGL], capture_output=True, text=True, check=True
    )
    (line,) = answer.stdout.splitlines()
    assert "apt-get install -y libegl1 libgl1-mesa-dri libopengl0" in line
    assert "cannot render" in line


def test_an_unknown_camera_is_refused(room: mujoco.MjModel) -> None:
    with pytest.raises(TwinModelMismatch, match=r'camera name="rear".*found'):
        fixed_camera(room, "rear")
