"""What images show, and how large they are: the arguments of Gymnasium's ``MujocoEnv``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import mujoco

from defmanip_gym.errors import ParameterError
from defmanip_gym.plant import names
from defmanip_gym.validation import (
    require_choice,
    require_finite_sequence,
    require_number,
    require_params,
    require_whole,
    settle,
)

WIDTH, HEIGHT = 640, 480
MOST_PIXELS = 4096  # along one side; with its samples such an image takes half a gigabyte


@dataclass(frozen=True, kw_only=True)
class FreeCameraParams:
    """A camera that is not in the model, by MuJoCo's names; None is MuJoCo's own choice.

    Args:
        azimuth: direction in which it looks, degrees from x towards y.
        elevation: the same from the horizontal, negative downwards, degrees.
        distance: from the point that it looks at, m.
        lookat: that point, world frame, m; without it the camera follows a body.
        trackbodyid: which one; without it the base.

    Raises:
        ParameterError: a value outside its range, or both a point and a body.
    """

    azimuth: float | None = None
    elevation: float | None = None
    distance: float | None = None
    lookat: Sequence[float] | None = None
    trackbodyid: int | None = None

    def __post_init__(self) -> None:
        for name, low, high, unit in (
            ("azimuth", -360.0, 360.0, "degrees"),
            ("elevation", -90.0, 90.0, "degrees"),
            ("distance", 0.01, 1e4, "m"),
        ):
            if getattr(self, name) is not None:
                settle(self, name, require_number, low, high, unit)
        if self.trackbodyid is not None:
            settle(self, "trackbodyid", require_whole, 0)
        if self.lookat is not None:
            settle(self, "lookat", require_finite_sequence, 3)
            if self.trackbodyid is not None:
                raise ParameterError(
                    "trackbodyid", self.trackbodyid, "None beside lookat", "Give one of both."
                )


@dataclass(frozen=True, kw_only=True)
class ViewParams:
    """Size and camera of an environment's images.

    Args:
        width: pixels.
        height: pixels.
        camera_id: number of one of the model's cameras, -1 for the free camera.
        camera_name: name of one of them; ``track`` if nothing is said.
        default_camera_config: :class:`FreeCameraParams` of the free camera, or a mapping of its
            fields.

    Raises:
        ParameterError: a value outside its range, or more than one camera.
    """

    width: int = WIDTH
    height: int = HEIGHT
    camera_id: int | None = None
    camera_name: str | None = None
    default_camera_config: FreeCameraParams | Mapping[str, Any] | None = None

    def __post_init__(self) -> None:
        settle(self, "width", require_whole, 1, MOST_PIXELS)
        settle(self, "height", require_whole, 1, MOST_PIXELS)
        if self.camera_id is not None and self.camera_name is not None:
            raise ParameterError(
                "camera_name",
                self.camera_name,
                "None beside a camera_id",
                "Give one of both.",
            )
        if self.default_camera_config is not None:
            settle(self, "default_camera_config", require_params, FreeCameraParams)
            if self.camera_name is not None or self.camera_id not in (None, -1):
                raise ParameterError(
                    "default_camera_config",
                    self.default_camera_config,
                    "None beside camera_name or camera_id",
                    "It places the free camera; the model's cameras have their places.",
                )

    @property
    def camera(self) -> str | int:
        """The camera by name, or by number where that was given."""
        if self.camera_name is not None:
            return self.camera_name
        if self.camera_id is not None:
            return self.camera_id
        return names.TRACKING_CAMERA if self.default_camera_config is None else -1

    def camera_of(self, model: mujoco.MjModel, camera: str | int | None = None) -> mujoco.MjvCamera:
        """Return MuJoCo's camera for a name, a number, or None for the view's own.

        Raises:
            ParameterError: the model has no such camera, or no such body to follow.
        """
        chosen = self.camera if camera is None else camera
        if isinstance(chosen, str):
            known = [model.camera(i).name for i in range(model.ncam)]
            require_choice("camera_name", chosen, known)
            chosen = known.index(chosen)
        number = require_whole("camera_id", chosen, -1, model.ncam - 1)
        return self._free_camera(model) if number == -1 else _fixed_camera(number)

    def _free_camera(self, model: mujoco.MjModel) -> mujoco.MjvCamera:
        config = self.default_camera_config or FreeCameraParams()
        assert isinstance(config, FreeCameraParams)
        camera = mujoco.MjvCamera()
        mujoco.mjv_defaultFreeCamera(model, camera)
        for name in ("azimuth", "elevation", "distance"):
            if (value := getattr(config, name)) is not None:
                setattr(camera, name, value)
        if config.lookat is not None:
            camera.lookat[:] = config.lookat
            return camera
        body = config.trackbodyid
        camera.type = mujoco.mjtCamera.mjCAMERA_TRACKING
        camera.trackbodyid = (
            model.body(names.BASE).id
            if body is None
            else require_whole("trackbodyid", body, 0, model.nbody - 1)
        )
        return camera


def _fixed_camera(number: int) -> mujoco.MjvCamera:
    camera = mujoco.MjvCamera()
    camera.type, camera.fixedcamid = mujoco.mjtCamera.mjCAMERA_FIXED, number
    return camera
