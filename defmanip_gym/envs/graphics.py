"""The thread that draws all off-screen images of a process, in the one OpenGL context that it has.

What OpenGL draws, reads and frees belongs to whichever context is current in the calling thread.
With a context for each environment, drawing one uses another's, closing one leaves none current,
and a discarded :class:`mujoco.MjrContext` deletes textures and buffers of a stranger. Here a single
context is current for good, in a thread of its own: it does not matter which thread asks for an
image, and contexts of others, such as Gymnasium's own environments, are left as they are.
"""

from __future__ import annotations

import atexit
import importlib
import os
import sys
import threading
from collections.abc import Callable
from concurrent.futures import Future
from queue import SimpleQueue
from typing import Any, TypeVar

from defmanip_gym.errors import RenderingError

Result = TypeVar("Result")

# MUJOCO_GL, as MuJoCo reads it
_MODULES = {
    "egl": "mujoco.egl",
    "osmesa": "mujoco.osmesa",
    "cgl": "mujoco.cgl",
    "glfw": "mujoco.glfw",
    "glx": "mujoco.glfw",
    "wgl": "mujoco.glfw",
}
_SWITCHED_OFF = ("disable", "disabled", "off", "false", "0")


class GraphicsThread:
    """Runs whatever calls OpenGL, one piece of work after the other; starts with the first."""

    def __init__(self) -> None:
        # a SimpleQueue: destructors put into it, wherever they interrupt this thread or another
        self._tasks: SimpleQueue[tuple[Future[Any], Callable[[], Any]] | None] = SimpleQueue()
        self._starting = threading.Lock()
        self._thread: threading.Thread | None = None
        self._context: Any = None
        self._is_forked = self._has_ended = False
        if hasattr(os, "register_at_fork"):
            os.register_at_fork(after_in_child=self._note_fork)

    def run(self, work: Callable[[], Result]) -> Result:
        """Return what ``work`` returns, or raise what it raises.

        Raises:
            RenderingError: the machine offers no OpenGL, or not to this process.
        """
        if self._is_forked:
            raise RenderingError(
                "Cannot render: the process that this one was forked from has used OpenGL, which "
                "does not survive that. Let new processes start by 'spawn' or 'forkserver', as in "
                "AsyncVectorEnv(..., context='spawn'), or the parent render after them."
            )
        if self._has_ended:
            raise RenderingError("Cannot render: Python is ending. Render before it does.")
        self._start()
        future: Future[Result] = Future()
        self._tasks.put((future, lambda: self._in_context(work)))
        return future.result()

    def later(self, work: Callable[[], object]) -> None:
        """Run ``work`` before whatever is asked for next, without waiting; for destructors."""
        self._tasks.put((Future(), work))

    def _start(self) -> None:
        with self._starting:
            if self._thread is None:
                self._thread = threading.Thread(target=self._serve, name="graphics", daemon=True)
                self._thread.start()

    def _serve(self) -> None:
        while (task := self._tasks.get()) is not None:
            future, work = task
            try:
                future.set_result(work())
            except BaseException as error:  # it belongs to the thread that waits
                future.set_exception(error)
            del task, future, work  # or the last environment drawn would never be discarded
        if self._context is not None:
            self._context.free()

    def _in_context(self, work: Callable[[], Result]) -> Result:
        if self._context is None:
            self._context = _open_context()
            # after MuJoCo has registered its own clean-up, and so before that
            atexit.register(self._end)
        return work()

    def _end(self) -> None:
        self._has_ended = True
        self._tasks.put(None)
        if self._thread is not None:
            self._thread.join()

    def _note_fork(self) -> None:
        """Remember in a child that the parent, with us or without, has used OpenGL."""
        display = getattr(sys.modules.get("mujoco.egl"), "EGL_DISPLAY", None)
        self._is_forked = self._thread is not None or display is not None
        self._starting = threading.Lock()


GRAPHICS = GraphicsThread()


def has_display() -> bool:
    """Whether a window can be opened."""
    displays = ("DISPLAY", "WAYLAND_DISPLAY")
    return sys.platform != "linux" or any(os.environ.get(name) for name in displays)


def _open_context() -> Any:
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
    raise RenderingError(
        f"Cannot render: no OpenGL here ({'; '.join(refusals) or 'MUJOCO_GL switches it off'}). "
        "Headless machines need EGL or OSMesa (Debian: libegl1 libgl1-mesa-dri); MUJOCO_GL=egl or "
        "osmesa chooses one of them."
    )


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
