"""OpenGL contexts without a window."""

from __future__ import annotations

import importlib
import os
import sys
from typing import Any

from defmanip_gym.errors import RenderingError

# MUJOCO_GL, as MuJoCo reads it
_MODULES = {
    "egl": "mujoco.egl",
    "osmesa": "mujoco.osmesa",
    "cgl": "mujoco.cgl",
    "glfw": "mujoco.glfw",
    "glx": "mujoco.glfw",
    "wgl": "mujoco.glfw",
}
REMEDY = (
    "Headless machines need EGL or OSMesa (Debian: libegl1 libgl1-mesa-dri); "
    "MUJOCO_GL=egl or osmesa chooses one of them."
)
_SWITCHED_OFF = ("disable", "disabled", "off", "false", "0")


def has_display() -> bool:
    """Whether a window can be opened."""
    displays = ("DISPLAY", "WAYLAND_DISPLAY")
    return sys.platform != "linux" or any(os.environ.get(name) for name in displays)


def open_context() -> Any:
    """Return an OpenGL context that is current in this thread.

    Raises:
        RenderingError: there is none.
    """
    refusals = []
    for name in _backends():
        try:
            context = importlib.import_module(_MODULES[name]).GLContext(640, 480)
            context.make_current()
        except Exception as error:  # OpenGL's libraries raise whatever they like
            refusals.append(f"{name}: {error}")
        else:
            return context
    found = "; ".join(refusals) or "MUJOCO_GL switches it off"
    raise RenderingError(f"Cannot render: no OpenGL here ({found}). {REMEDY}")


def _backends() -> tuple[str, ...]:
    chosen = os.environ.get("MUJOCO_GL", "").lower().strip()
    if chosen in _SWITCHED_OFF:
        return ()
    if chosen in _MODULES:
        return (chosen,)
    if sys.platform == "darwin":
        return ("cgl", "glfw")
    if sys.platform != "linux":
        return ("glfw",)
    # EGL first even with a display: who closes a window with GLFW closes all of GLFW's contexts
    return ("egl", "glfw") if has_display() else ("egl",)
