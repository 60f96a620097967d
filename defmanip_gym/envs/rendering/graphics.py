"""The thread that draws all off-screen images of a process.

What OpenGL draws, reads and frees belongs to whichever context is current in the calling thread:
closing one environment leaves none current for the next, and discarding a
:class:`mujoco.MjrContext` deletes textures and buffers of a stranger. Here contexts are made, used
and freed by one thread that does nothing else, and each is made current before it is used. So it
does not matter which thread asks for an image, and contexts of others, such as Gymnasium's own
environments, stay current in theirs.
"""

from __future__ import annotations

import atexit
import os
import sys
import threading
from collections.abc import Callable
from concurrent.futures import Future
from queue import SimpleQueue
from typing import Any, TypeVar

from defmanip_gym.errors import RenderingError

Result = TypeVar("Result")


class GraphicsThread:
    """Runs whatever calls OpenGL, one piece of work after the other; starts with the first."""

    def __init__(self) -> None:
        # a SimpleQueue: destructors put into it, wherever they interrupt this thread or another
        self._tasks: SimpleQueue[tuple[Future[Any], Callable[[], Any]] | None] = SimpleQueue()
        self._starting = threading.Lock()
        self._thread: threading.Thread | None = None
        self._is_forked = self._has_ended = self._is_registered = False
        if hasattr(os, "register_at_fork"):
            os.register_at_fork(after_in_child=self._note_fork)

    def run(self, work: Callable[[], Result]) -> Result:
        """Return what ``work`` returns, or raise what it raises.

        Raises:
            RenderingError: OpenGL is not to be had by this process any more.
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
        self._tasks.put((future, work))
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
                result = work()
            except BaseException as error:  # it belongs to the thread that waits
                future.set_exception(error)
            else:
                self._register_end()
                future.set_result(result)
                del result
            del task, future, work  # or the last environment drawn would never be discarded

    def _register_end(self) -> None:
        """Let the end of Python wait for what is being drawn.

        After the first image, by when MuJoCo has registered what ends OpenGL: that is then called
        after this.
        """
        if not self._is_registered:
            atexit.register(self._end)
            self._is_registered = True

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
