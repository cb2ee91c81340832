"""Render a MuJoCo model without a display: colour and metric depth, through EGL."""

from __future__ import annotations

import weakref
from typing import Any, Protocol

import mujoco
import numpy as np
from numpy.typing import NDArray

from sim_twin.errors import OpenGLMissing, TwinModelMismatch

APT_LINE = "apt-get install -y libegl1 libgl1-mesa-dri libopengl0"
VISIBLE_GROUPS = (1, 1, 1, 0, 0, 0)
"""Groups 0 and 1 are the world's looks, 2 the robot's; the others are collision shapes."""


class GLContext(Protocol):
    """Own one OpenGL context."""

    def make_current(self) -> None:
        """Direct this thread's OpenGL calls here."""
        ...

    def free(self) -> None:
        """Release the context."""
        ...


def open_gl_context(width: int, height: int) -> GLContext:
    """Open a headless EGL context.

    Raises:
        OpenGLMissing: the EGL or Mesa libraries are not installed.
    """
    try:
        from mujoco import egl

        context: GLContext = egl.GLContext(width, height)
    except (ImportError, AttributeError, OSError, RuntimeError) as error:
        raise OpenGLMissing(
            f"cannot render: no OpenGL through EGL ({error}); install it with: {APT_LINE}"
        ) from error
    return context


class Renderer:
    """Draw frames of one size; shadows and multisampling are off, they cost 10-20x in software."""

    def __init__(self, model: mujoco.MjModel, width: int, height: int) -> None:
        self.width = width
        self.height = height
        self._model = model
        self._near_m = model.vis.map.znear * model.stat.extent
        self._far_m = model.vis.map.zfar * model.stat.extent
        self._gl = open_gl_context(width, height)
        self._gl.make_current()
        self._context: Any = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100.value)
        self._scene = mujoco.MjvScene(model, maxgeom=2000)
        self._scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = 0
        self._option = mujoco.MjvOption()
        self._option.geomgroup[:] = VISIBLE_GROUPS
        self._perturb = mujoco.MjvPerturb()
        self._release = weakref.finalize(self, _release, self._gl, self._context)
        self._release.atexit = False  # EGL is gone by then
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self._context)
        self._context.readDepthMap = mujoco.mjtDepthMap.mjDEPTH_ZEROFAR
        self._rect = mujoco.MjrRect(0, 0, width, height)

    def render(
        self, data: mujoco.MjData, camera: mujoco.MjvCamera
    ) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        """Return RGB and the depth along the optical axis in metres, both upright."""
        self._gl.make_current()
        rgb = np.empty((self.height, self.width, 3), np.uint8)
        depth = np.empty((self.height, self.width), np.float32)
        mujoco.mjv_updateScene(
            self._model,
            data,
            self._option,
            self._perturb,
            camera,
            mujoco.mjtCatBit.mjCAT_ALL.value,
            self._scene,
        )
        mujoco.mjr_render(self._rect, self._scene, self._context)
        mujoco.mjr_readPixels(rgb, depth, self._rect, self._context)
        return np.ascontiguousarray(np.flipud(rgb)), self._metres(np.flipud(depth))

    def close(self) -> None:
        """Release the OpenGL objects; closing twice is allowed."""
        self._release()

    def _metres(self, buffer: NDArray[np.float32]) -> NDArray[np.float32]:
        """Turn the reversed depth buffer (1 is near, 0 is far) into metres."""
        near, far = self._near_m, self._far_m
        metres = buffer * np.float32(far - near)
        metres += np.float32(near)
        np.divide(np.float32(near * far), metres, out=metres)
        return metres


def _release(gl: GLContext, context: Any) -> None:
    """Free MuJoCo's OpenGL names in the context that owns them, not in whichever is current."""
    gl.make_current()
    context.free()
    gl.free()


def fixed_camera(model: mujoco.MjModel, name: str) -> mujoco.MjvCamera:
    """Return the view of a camera that the model declares.

    Raises:
        ModelMismatch: the model has no such camera.
    """
    number = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_CAMERA.value, name)
    if number < 0:
        found = ", ".join(repr(model.camera(one).name) for one in range(model.ncam)) or "none"
        raise TwinModelMismatch(
            f'expected a <camera name="{name}"> in the MJCF, as the robot file\'s camera.site, '
            f"found {found}; make them agree"
        )
    camera = mujoco.MjvCamera()
    camera.type = mujoco.mjtCamera.mjCAMERA_FIXED.value
    camera.fixedcamid = number
    return camera
