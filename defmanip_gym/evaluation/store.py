"""A file of records that is complete at every moment and knows which comparison it belongs to."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

from defmanip_gym.errors import RecordError
from defmanip_gym.evaluation.records import EpisodeRecord
from defmanip_gym.files import write_atomically

FORMAT = "defmanip_gym records"
FORMAT_VERSION = 1


def fingerprint(configuration: Any) -> str:
    """Return the SHA-256 of a configuration made of JSON values, whatever its order of keys."""
    canonical = json.dumps(configuration, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(canonical.encode("utf-8")).hexdigest()


class RecordStore:
    """Records as JSON lines under a header; opening it reads what an earlier run has finished.

    Args:
        path: of the file; its folder must exist.
        fingerprint: of the comparison's configuration.

    Raises:
        RecordError: the file is damaged or belongs to another comparison.
    """

    def __init__(self, path: Path, fingerprint: str) -> None:
        self.path = path
        self._header = json.dumps(
            {"format": FORMAT, "version": FORMAT_VERSION, "fingerprint": fingerprint}
        )
        _remove_leftovers(path)
        self._records = self._read() if path.exists() else {}

    @property
    def records(self) -> tuple[EpisodeRecord, ...]:
        """All records in the order in which they were added."""
        return tuple(self._records.values())

    def finished(self, contestant: str) -> set[str]:
        """Return the names of the scenarios that a contestant has finished."""
        return {scenario for name, scenario in self._records if name == contestant}

    def add(self, record: EpisodeRecord) -> None:
        """Keep a record; when this returns it is on disk, and never half of it.

        Raises:
            RecordError: there is one of this contestant and scenario already.
        """
        self._insert(self._records, record)
        rows = [json.dumps(kept.to_row(), allow_nan=False) for kept in self._records.values()]
        write_atomically(self.path, "\n".join([self._header, *rows, ""]).encode("utf-8"))

    def _read(self) -> dict[tuple[str, str], EpisodeRecord]:
        text = self.path.read_text(encoding="utf-8", errors="replace")
        whole, _, cut = text.rpartition("\n")
        if not whole and self._header.startswith(cut):
            return {}  # cut within the header: nothing was recorded yet
        header, *lines = whole.split("\n")
        self._check_header(header)
        records: dict[tuple[str, str], EpisodeRecord] = {}
        for number, line in enumerate(lines, start=2):
            self._insert(records, EpisodeRecord.from_row(self._parsed(line, number)))
        return records

    def _check_header(self, line: str) -> None:
        header = self._parsed(line, 1)
        expected = json.loads(self._header)
        if not isinstance(header, dict) or header.get("format") != FORMAT:
            raise RecordError(
                "header", line[:80], f"that of {FORMAT!r}", f"{self.path} is no file of records."
            )
        if header != expected:
            raise RecordError(
                "records",
                str(self.path),
                "records of this very comparison (same scenarios, horizon, plant, package version)",
                "They were made with other settings: choose another output folder, or pass "
                "--fresh to discard them.",
            )

    def _parsed(self, line: str, number: int) -> Any:
        try:
            return json.loads(line)
        except json.JSONDecodeError as error:
            raise RecordError(
                f"line {number} of {self.path}",
                line[:80],
                "one JSON object",
                "The file is damaged: choose another output folder, or pass --fresh to discard it.",
            ) from error

    def _insert(self, records: dict[tuple[str, str], EpisodeRecord], record: EpisodeRecord) -> None:
        key = record.contestant, record.scenario
        if key in records:
            raise RecordError(
                "record", key, "one of each contestant and scenario", f"Check {self.path}."
            )
        records[key] = record


def _remove_leftovers(path: Path) -> None:
    """Delete the temporary files of ``write_atomically`` that a killed process left behind."""
    for leftover in path.parent.glob(f".{path.name}.????????"):
        leftover.unlink(missing_ok=True)
