"""Every exception of the package; each names the value, what is allowed and the remedy."""

from __future__ import annotations


class DefmanipError(Exception):
    """Base class: ``except DefmanipError`` catches whatever this package raises on purpose."""


class InvalidValueError(DefmanipError, ValueError):
    """A value that the package cannot accept.

    Attributes:
        name: what the value is.
        value: the value as given.
        allowed: the values that are accepted.
        remedy: what to do about it.
    """

    def __init__(self, name: str, value: object, allowed: str, remedy: str) -> None:
        self.name, self.value, self.allowed, self.remedy = name, value, allowed, remedy
        super().__init__(f"{name} is {value!r}; allowed: {allowed}. {remedy}")


class ParameterError(InvalidValueError):
    """A physical or task parameter outside its range."""


class ActionError(InvalidValueError):
    """An action of the wrong shape or with values that are not finite."""


class StartError(InvalidValueError):
    """A start state that the robot cannot take, or unknown reset options."""


class ObjectFileError(InvalidValueError):
    """A model file that cannot be read, or is not an object that certificates are made for."""


class CertificateError(InvalidValueError):
    """A certificate that does not exist for this object, or does not fit this environment."""


class GainError(InvalidValueError):
    """Controller gains for which the sampled loop is not stable."""


class AgentFileError(InvalidValueError):
    """A missing, damaged or foreign agent."""


class RunFolderError(InvalidValueError):
    """A training run folder that cannot be created, resumed or shipped."""


class RecordError(InvalidValueError):
    """Evaluation records that cannot be read or do not belong to this comparison."""


class DivergenceError(InvalidValueError):
    """A simulation that diverged where it must not."""


class RenderingError(DefmanipError, RuntimeError):
    """No image can be made here, typically because the machine has no OpenGL."""
