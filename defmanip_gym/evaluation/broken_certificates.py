"""Certificates that did not keep their word."""

from __future__ import annotations

from collections.abc import Iterable

from defmanip_gym.evaluation.records import EpisodeRecord


def broken_certificates(records: Iterable[EpisodeRecord]) -> tuple[EpisodeRecord, ...]:
    """Return the episodes that exceeded σ although the enforced certificate covers them.

    There should be none. A violation where the certificate does not apply is no such episode.
    """
    return tuple(record for record in records if record.violated and record.certificate_applies)
