"""Images of the episodes of an engine, and a window on the first."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import mujoco

from defmanip_gym.envs.engine import TransportEngine
from defmanip_gym.envs.rendering.graphics import GRAPHICS
from defmanip_gym.envs.rendering.modes import IMAGE_MODES
from defmanip_gym.envs.rendering.opengl import REMEDY, has_display
from defmanip_gym.envs.rendering.stage import Image, Stage
from defmanip_gym.envs.rendering.view_params import MOST_PIXELS, ViewParams
from defmanip_gym.errors import RenderingError
from defmanip_gym.validation import require_choice, require_whole

if TYPE_CHECKING:
    from gymnasium.envs.mujoco.mujoco_rendering import MujocoRenderer


class TransportRenderer:
    """Draws episodes; the beam reddens as ‖z2‖∞ nears σ.

    One model, one scene and one set of textures and buffers serve all episodes and cameras. They
    are made with the first image, and again with the first after ``close``.

    Args:
        engine: what to draw.
        view: size and camera, unless an image asks for others.

    Raises:
        ParameterError: the model has no such camera.
    """

    def __init__(self, engine: TransportEngine, view: ViewParams) -> None:
        self._engine, self.view = engine, view
        view.camera_of(engine.simulation.model)
        self._stage: Stage | None = None
        self._window: MujocoRenderer | None = None

    def render(self, mode: str) -> Any:
        """Return what Gymnasium's ``render`` does of the first episode: an image, or a window.

        Raises:
            RenderingError: the machine offers no OpenGL, or no display for a window.
        """
        return self._show() if mode == "human" else self.images(mode, ids=[0])[0]

    def images(
        self,
        mode: str = "rgb_array",
        *,
        camera: str | int | None = None,
        width: int | None = None,
        height: int | None = None,
        ids: Sequence[int] | None = None,
    ) -> tuple[Image, ...]:
        """Return an image of each episode.

        Args:
            mode: ``rgb_array`` for (height, width, 3) uint8, ``depth_array`` for (height, width)
                float32 of OpenGL's depth buffer, 0 near and 1 far, as Gymnasium has it.
            camera: name or number of one of the model's cameras, -1 for the free one.
            width: pixels.
            height: pixels.
            ids: which episodes; all by default.

        Raises:
            ParameterError: an unknown mode or camera, or a size outside its range.
            RenderingError: the machine offers no OpenGL.
        """
        require_choice("mode", mode, IMAGE_MODES)
        eye = self.view.camera_of(self._engine.simulation.model, camera)
        width = require_whole("width", self.view.width if width is None else width, 1, MOST_PIXELS)
        height = require_whole(
            "height", self.view.height if height is None else height, 1, MOST_PIXELS
        )
        chosen = range(self._engine.num_envs) if ids is None else ids
        stage = self._opened()
        swings = self._engine.largest_swing_rad

        def draw() -> tuple[Image, ...]:
            images = []
            for i in chosen:
                stage.pose(i, float(swings[i]))
                images.append(stage.photograph(eye, width, height, mode == "depth_array"))
            return tuple(images)

        return _drawn(draw)

    def close(self) -> None:
        """Close the window, and free what drawing needs."""
        if self._window is not None and self._window.viewer is not None:
            # not its close(), which ends GLFW and with it everybody's windows
            self._window.viewer.free()
        if self._stage is not None:
            self._stage.close()
        self._window = self._stage = None

    def _opened(self) -> Stage:
        if self._stage is None:
            self._stage = Stage(self._engine, self.view)
        return self._stage

    def _show(self) -> None:
        if not has_display():
            raise RenderingError(
                "Cannot open a window: there is no display. Use render_mode='rgb_array'."
            )
        stage = self._opened()
        stage.pose(0, float(self._engine.largest_swing_rad[0]))
        try:
            if self._window is None:
                self._window = _window(stage, self.view)
            if self._window.viewer is not None:
                self._window.viewer.make_context_current()  # another window may have come since
            self._window.render("human")
        except Exception as error:  # GLFW raises whatever it likes
            raise RenderingError(
                f"Cannot open a window: {error}. Use render_mode='rgb_array'."
            ) from error


def _drawn(draw: Callable[[], tuple[Image, ...]]) -> tuple[Image, ...]:
    """Return what ``draw`` returns on the graphics thread; what MuJoCo says becomes our error."""
    try:
        return GRAPHICS.run(draw)
    except (mujoco.FatalError, mujoco.UnexpectedError) as error:
        raise RenderingError(f"Cannot render: {error}. {REMEDY}") from error


def _window(stage: Stage, view: ViewParams) -> MujocoRenderer:
    from gymnasium.envs.mujoco.mujoco_rendering import MujocoRenderer  # which only windows need

    eye = view.camera_of(stage.model)
    settings = ("type", "fixedcamid", "trackbodyid", "azimuth", "elevation", "distance", "lookat")
    config = {name: getattr(eye, name) for name in settings}
    return MujocoRenderer(stage.model, stage.data, config, width=view.width, height=view.height)
