"""Every exception of the package; each names the value, what is allowed and the remedy."""

from __future__ import annotations

import pickle
from typing import Any, overload

import gymnasium


class DefmanipError(Exception):
    """Base class: ``except DefmanipError`` catches whatever this package raises on purpose.

    Copies and pickles are whole, also in another process; of an attribute that cannot be pickled
    they hold the text.
    """

    def __reduce_ex__(self, protocol: Any) -> tuple[Any, ...]:
        attributes = {key: _portable(value, protocol) for key, value in vars(self).items()}
        # by its text alone, whatever its constructor takes
        return _rebuilt, (type(self), str(self)), attributes

    def __reduce__(self) -> tuple[Any, ...]:
        # what asks for this one instead: tblib, which dask hands all exceptions to
        return self.__reduce_ex__(pickle.DEFAULT_PROTOCOL)


class InvalidValueError(DefmanipError, ValueError):
    """A value that the package cannot accept.

    Attributes:
        name: what the value is.
        value: the value as given.
        allowed: the values that are accepted.
        remedy: what to do about it.
    """

    name: str
    value: object
    allowed: str
    remedy: str

    @overload
    def __init__(self, name: InvalidValueError) -> None: ...

    @overload
    def __init__(self, name: str, value: object, allowed: str, remedy: str) -> None: ...

    def __init__(
        self,
        name: str | InvalidValueError,
        value: object = None,
        allowed: str = "",
        remedy: str = "",
    ) -> None:
        if isinstance(name, InvalidValueError):  # AsyncVectorEnv raises type(error)(error) again
            self.name, self.value = name.name, name.value
            self.allowed, self.remedy = name.allowed, name.remedy
            super().__init__(str(name))
            return
        self.name, self.value, self.allowed, self.remedy = name, value, allowed, remedy
        super().__init__(f"{name} is {_shown(value)}; allowed: {allowed}. {remedy}")


class ParameterError(InvalidValueError):
    """A physical or task parameter outside its range."""


class ActionError(InvalidValueError):
    """An action of the wrong shape or with values that are not finite."""


class StartError(InvalidValueError):
    """A start state that the robot cannot take, or unknown reset options."""


class SeedError(StartError, gymnasium.error.Error):
    """A seed that is not a whole number from zero; Gymnasium's own error as well."""


class StateError(InvalidValueError):
    """A state of episodes that cannot be kept, or does not fit this environment."""


class ObjectFileError(InvalidValueError):
    """A model file that cannot be read, or is not an object that certificates are made for."""


class PayloadError(InvalidValueError):
    """A payload that cannot be carried, or that something is not known for."""


class CertificateError(InvalidValueError):
    """A certificate that does not exist for this object, or does not fit this environment."""


class GainError(InvalidValueError):
    """Controller gains for which the sampled loop is not stable."""


class ControllerError(InvalidValueError):
    """A controller that cannot be made, or is none."""


class AgentFileError(InvalidValueError):
    """A missing, damaged or foreign agent."""


class RunFolderError(InvalidValueError):
    """A training run folder that cannot be created, resumed or shipped."""


class RecordError(InvalidValueError):
    """Evaluation records that cannot be read or do not belong to this comparison."""


class DatasetError(InvalidValueError):
    """A dataset of episodes that cannot be written, read or simulated again."""


class InstallationError(InvalidValueError):
    """A package that is not installed, of those that only some commands need."""


class DivergenceError(InvalidValueError):
    """A simulation that diverged where it must not."""


class RenderingError(DefmanipError, RuntimeError):
    """No image can be made here, typically because the machine has no OpenGL."""


def _rebuilt(kind: type[DefmanipError], text: str) -> DefmanipError:
    error = kind.__new__(kind)
    error.args = (text,)
    return error


def _portable(value: object, protocol: Any) -> object:
    """Return ``value`` if another process can have it, else its text."""
    try:
        pickle.loads(pickle.dumps(value, protocol))
    except Exception:  # whatever the value's class raises
        return _shown(value)
    return value


def _shown(value: object) -> str:
    try:
        return repr(value)
    except Exception:  # of integers with thousands of digits, for one
        return f"a {type(value).__name__} that cannot be shown"
