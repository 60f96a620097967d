"""What native code writes to the standard error stream, past ``sys.stderr``."""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

_STDERR = 2


@contextmanager
def captured_stderr() -> Iterator[Path]:
    """Send file descriptor 2 into a file for a while; the file is removed at the end."""
    sys.stderr.flush()
    saved = os.dup(_STDERR)
    with tempfile.NamedTemporaryFile() as file:
        os.dup2(file.fileno(), _STDERR)
        try:
            yield Path(file.name)
        finally:
            sys.stderr.flush()
            os.dup2(saved, _STDERR)
            os.close(saved)
