"""Images of one episode of an engine."""

from __future__ import annotations

import copy
import os
import sys
from typing import Any

import mujoco
import numpy as np
from gymnasium.envs.mujoco.mujoco_rendering import MujocoRenderer

from defmanip_gym.envs.engine import TransportEngine
from defmanip_gym.errors import RenderingError
from defmanip_gym.plant import names
from defmanip_gym.plant.scene import swing_color

RENDER_MODES = ("human", "rgb_array", "depth_array")


class TransportRenderer:
    """Draws an episode; the beam reddens as ‖z2‖∞ nears σ.

    Args:
        engine: what to draw.
        index: which of its episodes.
        width: pixels.
        height: pixels.
        camera: name of a camera of the model.
    """

    def __init__(
        self,
        engine: TransportEngine,
        *,
        index: int = 0,
        width: int = 640,
        height: int = 480,
        camera: str = names.TRACKING_CAMERA,
    ) -> None:
        self._engine, self._index = engine, index
        self._model = copy.copy(engine.simulation.model)
        self._data = mujoco.MjData(self._model)
        self._segments = [
            self._model.geom(names.segment_geom(k)).id
            for k in range(engine.config.beam.segment_count)
        ]
        self._renderer = MujocoRenderer(
            self._model, self._data, width=width, height=height, camera_name=camera
        )

    def render(self, mode: str) -> Any:
        """Return the image that ``mode`` asks for, or None in human mode.

        Raises:
            RenderingError: the machine offers no OpenGL.
        """
        engine = self._engine
        engine.simulation.materialize(self._index, self._model, self._data)
        swing = float(engine.largest_swing_rad[self._index])
        self._model.geom_rgba[self._segments] = swing_color(swing, engine.config.sigma_rad)
        if mode != "human":
            _choose_headless_backend()
        elif not _has_display():
            raise RenderingError(
                "Cannot open a window: there is no display. Use render_mode='rgb_array'."
            )
        try:
            image = self._renderer.render(mode)
        except Exception as error:  # GL back ends raise whatever they like
            raise RenderingError(
                f"Cannot render in mode {mode!r}: {error}. Headless machines need EGL or OSMesa "
                "(Debian: libegl1 libgl1-mesa-dri); MUJOCO_GL=egl or osmesa chooses one of them."
            ) from error
        return None if image is None else np.asarray(image)

    def close(self) -> None:
        """Free the OpenGL context."""
        self._renderer.close()  # type: ignore[no-untyped-call]


def _choose_headless_backend() -> None:
    """Name EGL where there is no display: Gymnasium tries GLFW first, which then fails late."""
    if not _has_display():
        os.environ.setdefault("MUJOCO_GL", "egl")


def _has_display() -> bool:
    displays = ("DISPLAY", "WAYLAND_DISPLAY")
    return sys.platform != "linux" or any(os.environ.get(name) for name in displays)
