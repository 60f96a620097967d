from __future__ import annotations

import json
import os
from dataclasses import replace

import pytest
from episodes import record

from defmanip_gym.errors import RecordError
from defmanip_gym.evaluation import store
from defmanip_gym.evaluation.entry import Entry
from defmanip_gym.evaluation.store import (
    RecordFolder,
    fingerprint,
    read_records,
    remove_leftovers,
)

ENTRY = Entry(suite="nominal", contestant="a", family="analytic")
RECORDS = (record(), record(scenario="nominal-01", time_to_goal_s=None, success=False))


@pytest.fixture
def folder(tmp_path):
    folder = RecordFolder(tmp_path)
    folder.write(ENTRY, "f", RECORDS)
    return folder


def test_records_survive_their_file(folder):
    assert RecordFolder(folder.root).read(ENTRY, "f") == RECORDS
    assert read_records(folder.path(ENTRY)) == RECORDS


def test_an_entry_without_file_has_no_records(folder):
    assert folder.read(replace(ENTRY, member="3"), "f") == ()


def test_files_are_named_after_suite_contestant_and_member(folder):
    path = folder.path(replace(ENTRY, contestant="ppo/phase_plane", member="3"))
    assert path == folder.root / "nominal" / "ppo+phase_plane.3.jsonl"


def test_an_interrupted_write_leaves_the_old_file_and_nothing_else(folder, monkeypatch):
    path = folder.path(ENTRY)
    before = path.read_bytes()

    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "replace", interrupted)
    with pytest.raises(KeyboardInterrupt):
        folder.write(ENTRY, "f", RECORDS[:1])
    assert path.read_bytes() == before
    assert list(path.parent.iterdir()) == [path]


def test_what_a_killed_write_left_behind_is_removed_and_nothing_else(folder):
    path = folder.path(ENTRY)
    leftover = path.with_name(f".{path.name}.a1b2c3d4")
    leftover.write_text("half of it")
    remove_leftovers([folder.root])
    assert list(path.parent.iterdir()) == [path]


@pytest.mark.parametrize("kept", [0, 1, 40, 300, 600, -1, -200])
def test_a_cut_file_is_refused_by_name_with_the_remedy(folder, kept):
    path = folder.path(ENTRY)
    path.write_bytes(path.read_bytes()[:kept])
    with pytest.raises(RecordError, match=rf"{path.name}.*Delete this file"):
        folder.read(ENTRY, "f")


def test_a_file_cut_between_two_records_is_refused(folder):
    path = folder.path(ENTRY)
    path.write_bytes(b"".join(path.read_bytes().splitlines(keepends=True)[:2]))
    with pytest.raises(RecordError, match="cut or edited"):
        folder.read(ENTRY, "f")


def test_an_edited_value_is_noticed(folder):
    path = folder.path(ENTRY)
    path.write_text(path.read_text().replace('"success": false', '"success": true'))
    with pytest.raises(RecordError, match="cut or edited"):
        folder.read(ENTRY, "f")


@pytest.mark.parametrize(
    "change",
    [
        {"success": "yes"},
        {"duration_s": None},
        {"outcome": "fine"},
        {"family": "royal"},
        {"start": [0, "x"]},
        {"new": 1},
    ],
)
def test_foreign_rows_are_refused_also_under_a_matching_digest(folder, change):
    path = folder.path(ENTRY)
    header, row, _ = path.read_text().splitlines()
    body = json.dumps({**json.loads(row), **change}) + "\n"
    header = json.dumps({**json.loads(header), "digest": store._digest(body.encode())})
    path.write_text(f"{header}\n{body}")
    with pytest.raises(RecordError):
        folder.read(ENTRY, "f")


@pytest.mark.parametrize("row", ["no JSON", "[" * 100_000, "\xff"])
def test_rows_that_are_no_json_are_refused_also_under_a_matching_digest(folder, row):
    path = folder.path(ENTRY)
    body = f"{row}\n".encode("latin-1")
    header = json.loads(path.read_text().splitlines()[0]) | {"digest": store._digest(body)}
    path.write_bytes(json.dumps(header).encode() + b"\n" + body)
    with pytest.raises(RecordError, match="cut or edited"):
        folder.read(ENTRY, "f")


def test_records_of_another_package_version_are_refused(folder, monkeypatch):
    monkeypatch.setattr(store, "__version__", "99.0")
    with pytest.raises(RecordError, match=r"package version.*99\.0.*--fresh"):
        folder.read(ENTRY, "f")


def test_records_made_with_other_settings_are_refused_with_the_remedy(folder):
    remedy = rf"delete those of this contestant .*/\*/{ENTRY.file_stem}.jsonl.*, choose another"
    with pytest.raises(RecordError, match=remedy):
        folder.read(ENTRY, "another")


def test_a_renamed_file_does_not_pass_for_anothers(folder):
    other = replace(ENTRY, contestant="b")
    folder.path(ENTRY).rename(folder.path(other))
    with pytest.raises(RecordError, match="renamed"):
        folder.read(other, "f")


@pytest.mark.parametrize("content", [b"precious", b"[]\n", b"\xff\xfe\n", b'{"format": 1}\n'])
def test_another_programs_file_is_refused_and_kept(folder, content):
    path = folder.path(ENTRY)
    path.write_bytes(content)
    with pytest.raises(RecordError, match="no file of records"):
        folder.read(ENTRY, "f")
    assert path.read_bytes() == content


def test_fingerprint_ignores_the_order_of_keys_only():
    assert fingerprint({"a": 1, "b": 2}) == fingerprint({"b": 2, "a": 1})
    assert fingerprint({"a": 1, "b": 2}) != fingerprint({"a": 2, "b": 1})


def test_score_is_the_speed_towards_the_goal_and_zero_after_a_violation():
    assert record(start_distance_m=10.0, time_to_goal_s=8.0).score == pytest.approx(0.625)
    assert record(success=False, outcome="violation").score == 0.0
