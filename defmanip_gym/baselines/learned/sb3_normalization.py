"""Which of SB3's ``VecNormalize`` files belongs to a zip file; none is unpickled here."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from defmanip_gym.envs.registration import ENV_IDS
from defmanip_gym.errors import AgentFileError, ParameterError
from defmanip_gym.observation import ObservationLayout

NO_NORMALIZATION = "none"

_WORD = re.compile(r"[_-]?vec[_-]?norm(alize)?[_-]?", re.IGNORECASE)
_SUFFIXES = (".pkl", ".pickle")
_HEAD_BYTES = 200  # a pickle begins with the name of its class
_ROUNDING = 1e-5


def was_normalized(model: Any) -> bool | None:
    """Return whether a loaded model saw other observations than the environment's; None: unknown.

    The last ones that it saw are in its zip file, and the environment's have a sine and a cosine.
    """
    last: Any = model._last_obs
    if last is None:  # SB3's on-policy algorithms note the original one under VecNormalize only
        has_original = getattr(model, "_last_original_obs", None) is not None
        return True if has_original and hasattr(model, "clip_range") else None
    try:
        heading = ObservationLayout.of_size(last.shape[-1]).part(last, "heading")
    except (ParameterError, AttributeError, LookupError):
        return None
    return bool(np.abs(np.square(heading).sum(axis=-1) - 1.0).max() > _ROUNDING)


def normalization_of(path: Path, named: str | None, normalized: bool | None) -> Path | None:
    """Return the file with the statistics that a model was trained with, None for none.

    Those are found by SB3's, rl_zoo3's and similar names: with the zip file's name in theirs, step
    number included; in a folder of its name; as the only ones beside it; or in a folder of the
    environment's name.

    Args:
        path: the model's zip file.
        named: the file that the user names, or "none"; None for neither.
        normalized: what ``was_normalized`` says.

    Raises:
        AgentFileError: they are missing, or it is not clear which ones they are.
    """
    if named is not None:
        return _named(path, named, normalized)
    if normalized is False:
        return None
    tiers, others = _candidates(path)
    best: Sequence[Path] = next(filter(None, tiers), ())
    if len({candidate.read_bytes() for candidate in best}) > 1 or (not best and others):
        choices = ", ".join(str(candidate) for candidate in (best or others))
        raise AgentFileError(
            "normalization",
            f"one of {choices}",
            f"one that clearly belongs to {path}",
            f"Name it with --normalization, or say {NO_NORMALIZATION!r}.",
        )
    if not best and normalized:
        raise missing_normalization(path)
    return best[0] if best else None


def missing_normalization(path: Path) -> AgentFileError:
    """Return the error for a model that was trained normalized and is to be run without."""
    own = f"{_stem(path)}_vecnormalize.pkl"
    return AgentFileError(
        "normalization",
        None,
        f"the statistics of VecNormalize that {path} was trained with",
        "The last observations that it saw are not as the environment makes them. Save the "
        f"statistics with the model (VecNormalize.save), and put them beside it as {own} or name "
        "them with --normalization.",
    )


def _named(path: Path, named: str, normalized: bool | None) -> Path | None:
    if named == NO_NORMALIZATION:
        if normalized:
            raise missing_normalization(path)
        return None
    if normalized is False:
        raise AgentFileError(
            "normalization",
            named,
            f"{NO_NORMALIZATION!r} for {path}",
            "The model was trained on observations as they are.",
        )
    if not Path(named).is_file():
        raise AgentFileError(
            "normalization", named, f"a file, or {NO_NORMALIZATION!r}", "Check the path."
        )
    return Path(named)


def _candidates(path: Path) -> tuple[list[list[Path]], list[Path]]:
    """Return files that can be meant, the likeliest kind first, and those of unclear kinds."""
    stem, beside = _stem(path), _statistics_in(path.parent)
    its = {file: _owner(file) for file in beside}
    own = [file for file, owner in its.items() if _is_of(stem, owner)]
    of_nobody = [file for file, owner in its.items() if not owner]
    zips = {_stem(file) for file in path.parent.glob("*.zip")} - {stem}
    others = [
        file
        for file, owner in its.items()
        if owner and file not in own and not any(_is_of(one, owner) for one in zips)
    ]
    in_environments = [file for env_id in ENV_IDS for file in _statistics_in(path.parent / env_id)]
    return [own, _statistics_in(path.parent / stem), of_nobody, in_environments], others


def _statistics_in(folder: Path) -> list[Path]:
    if not folder.is_dir():
        return []
    files = (file for file in sorted(folder.iterdir()) if file.suffix in _SUFFIXES)
    return [file for file in files if file.is_file() and _is_statistics(file)]


def _is_statistics(file: Path) -> bool:
    if _WORD.search(file.stem):
        return True
    with file.open("rb") as stream:
        return b"VecNormalize" in stream.read(_HEAD_BYTES)


def _owner(file: Path) -> str:
    """Return what a name says beside "VecNormalize": whose statistics they are."""
    return _WORD.sub("_", file.stem).strip("_-")


def _is_of(stem: str, owner: str) -> bool:
    is_step = re.fullmatch(r"\d+_steps", owner) is not None
    return owner == stem or (is_step and stem.endswith(f"_{owner}"))


def _stem(path: Path) -> str:
    return path.name.removesuffix(".zip")
