"""The version, read from the installed distribution's metadata."""

from importlib.metadata import version

__version__ = version("defmanip_gym")
