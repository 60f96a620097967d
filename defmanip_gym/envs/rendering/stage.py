"""What images are taken of: a model in the pose of an episode, and what OpenGL keeps of it."""

from __future__ import annotations

import copy
import weakref
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from defmanip_gym.envs.engine import TransportEngine
from defmanip_gym.envs.rendering.graphics import GRAPHICS
from defmanip_gym.envs.rendering.opengl import open_context
from defmanip_gym.envs.rendering.view_params import ViewParams
from defmanip_gym.plant.scene import swing_color

Image = NDArray[Any]

_MOST_GEOMS = 1000


class Stage:
    """A copy of the model that takes the pose of any episode, and what OpenGL keeps of it."""

    def __init__(self, engine: TransportEngine, view: ViewParams) -> None:
        self._engine = engine
        self.model = copy.copy(engine.simulation.model)
        self.data = mujoco.MjData(self.model)
        self._geoms = engine.simulation.body.geoms(self.model)
        self._scene = mujoco.MjvScene(self.model, _MOST_GEOMS)
        self._options = mujoco.MjvOption()
        screen, quality = self.model.vis.global_, self.model.vis.quality
        screen.offwidth, screen.offheight = view.width, view.height
        # most of what a small image costs is its shadow, drawn finer than can be seen
        quality.shadowsize = min(quality.shadowsize, 8 * max(view.width, view.height))
        self._opengl: Any = None
        self._context: Any = None
        self._free: Callable[[], object] | None = None

    def pose(self, index: int, swing_rad: float) -> None:
        """Take the pose of an episode, and the colour of its swing."""
        self._engine.simulation.materialize(index, self.model, self.data)
        sigma_rad = self._engine.config.sigma_rad
        self.model.geom_rgba[self._geoms] = swing_color(swing_rad, sigma_rad)

    def photograph(
        self, camera: mujoco.MjvCamera, width: int, height: int, is_depth: bool
    ) -> Image:
        """Return an image; on the graphics thread only."""
        context, frame = self._context_for(width, height), mujoco.MjrRect(0, 0, width, height)
        everything = mujoco.mjtCatBit.mjCAT_ALL
        mujoco.mjv_updateScene(
            self.model, self.data, self._options, None, camera, everything, self._scene
        )
        mujoco.mjr_render(frame, self._scene, context)
        if is_depth:
            image: Image = np.empty((height, width), dtype=np.float32)
            mujoco.mjr_readPixels(None, image, frame, context)
        else:
            image = np.empty((height, width, 3), dtype=np.uint8)
            mujoco.mjr_readPixels(image, None, frame, context)
        return image[::-1].copy()  # OpenGL's first row is the lowest

    def close(self) -> None:
        """Free what OpenGL keeps."""
        if self._free is not None:
            self._free()

    def _context_for(self, width: int, height: int) -> mujoco.MjrContext:
        """Return MuJoCo's drawing context, with its OpenGL context current."""
        if self._context is None:
            self._opengl, self._context, free = _opened(self.model)
            # environments are also discarded unclosed, and by any thread
            self._free = weakref.finalize(self, GRAPHICS.later, free)
        self._opengl.make_current()
        context = self._context
        if width > context.offWidth or height > context.offHeight:
            larger = max(width, context.offWidth), max(height, context.offHeight)
            mujoco.mjr_resizeOffscreen(*larger, context)
        return context


def _opened(model: mujoco.MjModel) -> tuple[Any, mujoco.MjrContext, Callable[[], None]]:
    """Return an OpenGL context, MuJoCo's in it, and what frees them.

    One for each model: MuJoCo's contexts disturb each other within one of OpenGL's.
    """
    opengl = open_context()
    context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100)
    mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, context)

    def free() -> None:
        opengl.make_current()
        context.free()
        opengl.free()

    return opengl, context, free
