"""Files of records: one for each entry, whole or absent, and sure of what they were made with."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from defmanip_gym.errors import RecordError
from defmanip_gym.evaluation.entry import Entry
from defmanip_gym.evaluation.records import EpisodeRecord
from defmanip_gym.files import write_atomically
from defmanip_gym.version import __version__

FORMAT = "defmanip_gym records"
FORMAT_VERSION = 3

_REPEAT = "Delete this file to have its episodes run again; the others are kept."


def fingerprint(configuration: Any) -> str:
    """Return the SHA-256 of a configuration made of JSON values, whatever its order of keys."""
    canonical = json.dumps(configuration, sort_keys=True, separators=(",", ":"))
    return _digest(canonical.encode())


class RecordFolder:
    """Reads and writes the records of entries as JSON lines under a header.

    The header holds the package's version, a fingerprint of what the episodes depend on, and a
    digest of the lines, so that a file which was cut, edited or made with other settings does not
    pass for records of this comparison.

    Args:
        root: of the files.
    """

    def __init__(self, root: Path) -> None:
        self.root = root

    def path(self, entry: Entry) -> Path:
        """Return where the records of an entry lie."""
        return self.root / entry.suite / f"{entry.file_stem}.jsonl"

    def read(self, entry: Entry, fingerprint: str) -> tuple[EpisodeRecord, ...]:
        """Return the records of an entry, none if there is no file.

        Raises:
            RecordError: the file is damaged or was made with other settings.
        """
        path = self.path(entry)
        if not path.exists():
            return ()
        header, records = _read(path)
        if header["package_version"] != __version__:
            raise RecordError(
                f"package version of {path}",
                header["package_version"],
                f"{__version__}, which runs now",
                "Records of different versions are not compared. Delete this file, choose another "
                "output folder, or pass --fresh to discard them all.",
            )
        if header["fingerprint"] != fingerprint:
            raise RecordError(
                "records",
                str(path),
                "records of this very contestant, suite and task",
                "They were made with another agent, certificate, suite or environment: delete "
                f"those of this contestant ({self.root}/*/{entry.file_stem}.jsonl), choose another "
                "output folder, or pass --fresh to discard all.",
            )
        for record in records:
            if (record.suite, record.contestant, record.member) != _key(entry):
                raise RecordError(
                    f"record in {path}",
                    (record.suite, record.contestant, record.member),
                    str(_key(entry)),
                    f"The file was renamed. {_REPEAT}",
                )
        return records

    def write(self, entry: Entry, fingerprint: str, records: Sequence[EpisodeRecord]) -> None:
        """Write the records of an entry; when this returns they are on disk, or none is."""
        rows = [json.dumps(record.to_row(), allow_nan=False) for record in records]
        body = "".join(f"{row}\n" for row in rows).encode()
        header = {
            "format": FORMAT,
            "version": FORMAT_VERSION,
            "package_version": __version__,
            "fingerprint": fingerprint,
            "digest": _digest(body),
        }
        write_atomically(self.path(entry), json.dumps(header).encode() + b"\n" + body)


def read_records(path: Path) -> tuple[EpisodeRecord, ...]:
    """Return the records in a file, of whatever settings and version.

    Raises:
        RecordError: the file is damaged, was edited, or is another program's.
    """
    return _read(path)[1]


def remove_leftovers(folders: Iterable[Path]) -> None:
    """Delete the temporary files of ``write_atomically`` that a killed process left behind."""
    for folder in folders:
        for leftover in folder.glob("*/.*.????????"):
            leftover.unlink(missing_ok=True)


def _read(path: Path) -> tuple[dict[str, Any], tuple[EpisodeRecord, ...]]:
    """Return header and records of a file that is as it was written."""
    try:
        first, _, body = path.read_bytes().partition(b"\n")
        header = json.loads(first)
    except OSError as error:
        raise RecordError("records", str(path), "a file that can be read", f"{error}.") from error
    except (ValueError, RecursionError) as error:
        raise _foreign(path, first) from error
    if not isinstance(header, dict) or header.get("format") != FORMAT:
        raise _foreign(path, first)
    if header.get("version") != FORMAT_VERSION or set(header) != _HEADER_FIELDS:
        raise RecordError(
            f"header of {path}",
            header.get("version"),
            f"version {FORMAT_VERSION} of {FORMAT!r}",
            f"Another version of the package wrote it. {_REPEAT}",
        )
    try:
        rows = [json.loads(line) for line in body.splitlines()]
    except (ValueError, RecursionError):
        rows = None
    if rows is None or header["digest"] != _digest(body):
        raise RecordError(
            "records",
            str(path),
            "a file as it was written",
            f"It was cut or edited. {_REPEAT}",
        )
    return header, tuple(EpisodeRecord.from_row(row) for row in rows)


_HEADER_FIELDS = {"format", "version", "package_version", "fingerprint", "digest"}


def _foreign(path: Path, header: bytes) -> RecordError:
    shown = header[:80].decode("utf-8", "replace")
    return RecordError(
        f"header of {path}", shown, f"that of {FORMAT!r}", f"It is no file of records. {_REPEAT}"
    )


def _key(entry: Entry) -> tuple[str, str, str]:
    return entry.suite, entry.contestant, entry.member


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()
