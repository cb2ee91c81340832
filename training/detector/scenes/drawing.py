"""Draw a stage: colour, which geom each pixel shows, and how much of it a thing would fill."""

from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from sim_twin.pictures.renderer import GLContext, fixed_camera
from training.detector.scenes.pose import CAMERA
from training.detector.scenes.scene_model import SceneStage

WIDTH_PX, HEIGHT_PX = 512, 384
VISIBLE_GROUPS = (1, 1, 1, 0, 0, 0)
ALONE_GROUP, OTHER_GROUP = 0, 1
"""Of the geoms that are drawn alone, and of all others meanwhile."""
ALONE_GROUPS = (1, 0, 0, 0, 0, 0)
MAX_GEOMS = 2500
Image = NDArray[np.uint8]


class StageDrawing:
    """Draw images of one stage in an OpenGL context that outlives it."""

    def __init__(self, gl: GLContext, stage: SceneStage) -> None:
        gl.make_current()
        self._stage = stage
        self._context: Any = mujoco.MjrContext(
            stage.model, mujoco.mjtFontScale.mjFONTSCALE_100.value
        )
        self._scene = mujoco.MjvScene(stage.model, maxgeom=MAX_GEOMS)
        self._scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = 0
        self._option = mujoco.MjvOption()
        self._rect = mujoco.MjrRect(0, 0, WIDTH_PX, HEIGHT_PX)
        self._camera = fixed_camera(stage.model, CAMERA)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self._context)

    def draw(self) -> tuple[Image, NDArray[np.int32]]:
        """Return the RGB image and the geom of each pixel, -1 where there is none."""
        self._update(VISIBLE_GROUPS)
        rgb = self._pixels(segments=False)
        codes = self._pixels(segments=True).astype(np.int32)
        index = codes[..., 0] + (codes[..., 1] << 8) + (codes[..., 2] << 16)
        return rgb, self._geoms()[index]

    def pixels_alone(self, members: list[int]) -> int:
        """Return how many pixels of the image those geoms would fill if nothing hid them."""
        groups = self._stage.model.geom_group
        kept = groups.copy()
        groups[:] = OTHER_GROUP
        groups[members] = ALONE_GROUP
        self._update(ALONE_GROUPS)
        groups[:] = kept
        return int(self._pixels(segments=True).any(axis=2).sum())

    def close(self) -> None:
        """Release what this stage took of the context."""
        self._context.free()

    def _update(self, groups: Sequence[int]) -> None:
        """Take over what the geoms of some groups look like now."""
        self._option.geomgroup[:] = groups
        mujoco.mjv_updateScene(
            self._stage.model, self._stage.data, self._option, mujoco.MjvPerturb(), self._camera,
            mujoco.mjtCatBit.mjCAT_ALL.value, self._scene,
        )  # fmt: skip

    def _pixels(self, segments: bool) -> Image:
        self._scene.flags[mujoco.mjtRndFlag.mjRND_SEGMENT] = segments
        self._scene.flags[mujoco.mjtRndFlag.mjRND_IDCOLOR] = segments
        rgb = np.empty((HEIGHT_PX, WIDTH_PX, 3), np.uint8)
        mujoco.mjr_render(self._rect, self._scene, self._context)
        mujoco.mjr_readPixels(rgb, None, self._rect, self._context)
        return np.ascontiguousarray(np.flipud(rgb))

    def _geoms(self) -> NDArray[np.int32]:
        """Return the model's geom for each segment code; code 0 is the background."""
        table = np.full(self._scene.ngeom + 2, -1, np.int32)
        for geom in self._scene.geoms[: self._scene.ngeom]:
            if geom.objtype == mujoco.mjtObj.mjOBJ_GEOM.value and geom.segid >= 0:
                table[geom.segid + 1] = geom.objid
        return table
