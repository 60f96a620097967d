"""The version, read from the installed distribution's metadata, and the revision of the sources."""

import subprocess
from importlib.metadata import version
from pathlib import Path

__version__ = version("defmanip_gym")

UNKNOWN_REVISION = "unknown"


def git_revision() -> str:
    """Return the revision of the working tree that holds this package, or "unknown"."""
    try:
        answer = subprocess.run(
            ["git", "describe", "--always", "--dirty", "--abbrev=12"],
            cwd=Path(__file__).parent,
            capture_output=True,
            text=True,
            timeout=10,
            check=True,
        )
    except (OSError, subprocess.SubprocessError):
        return UNKNOWN_REVISION
    return answer.stdout.strip()
