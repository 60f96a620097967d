from __future__ import annotations

import json
import os

import pytest
from episodes import record

from defmanip_gym.errors import RecordError
from defmanip_gym.evaluation.store import RecordStore, fingerprint


@pytest.fixture
def path(tmp_path):
    return tmp_path / "records.jsonl"


def filled(path, *names):
    store = RecordStore(path, "f")
    for name in names:
        store.add(record(scenario=name))
    return store


def test_records_survive_reopening(path):
    store = filled(path, "paper", "sampled-01")
    reopened = RecordStore(path, "f")
    assert reopened.records == store.records
    assert reopened.finished("a") == {"paper", "sampled-01"}
    assert reopened.finished("b") == set()


def test_an_interrupted_write_leaves_the_old_file_and_nothing_else(path, monkeypatch):
    store = filled(path, "paper")
    before = path.read_bytes()

    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "replace", interrupted)
    with pytest.raises(KeyboardInterrupt):
        store.add(record(scenario="sampled-01"))
    assert path.read_bytes() == before
    assert list(path.parent.iterdir()) == [path]


def test_opening_removes_what_a_killed_write_left_behind(path):
    filled(path, "paper")
    leftover = path.with_name(f".{path.name}.a1b2c3d4")
    leftover.write_text("half of it")
    RecordStore(path, "f")
    assert not leftover.exists()


@pytest.mark.parametrize("lost", [1, 5, 200])
def test_a_cut_last_line_is_dropped(path, lost):
    filled(path, "paper", "sampled-01")
    path.write_bytes(path.read_bytes()[:-lost])
    assert RecordStore(path, "f").finished("a") == {"paper"}


@pytest.mark.parametrize("kept", [0, 1, 20])
def test_a_file_cut_within_its_header_is_empty(path, kept):
    filled(path, "paper")
    path.write_bytes(path.read_bytes()[:kept])
    assert RecordStore(path, "f").records == ()


def test_damage_elsewhere_is_refused(path):
    filled(path, "paper", "sampled-01")
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join([lines[0], lines[1][:40] + "\n", lines[2]]))
    with pytest.raises(RecordError, match=r"line 2 of .*damaged"):
        RecordStore(path, "f")


@pytest.mark.parametrize(
    "change",
    [
        {"success": "yes"},
        {"duration_s": None},
        {"outcome": "fine"},
        {"start": [0, "x"]},
        {"new": 1},
    ],
)
def test_foreign_rows_are_refused(path, change):
    filled(path, "paper")
    header, row = path.read_text().splitlines()
    path.write_text(f"{header}\n{json.dumps({**json.loads(row), **change})}\n")
    with pytest.raises(RecordError):
        RecordStore(path, "f")


def test_other_settings_are_refused_with_the_remedy(path):
    filled(path, "paper")
    with pytest.raises(RecordError, match="another output folder, or pass --fresh"):
        RecordStore(path, "another")


def test_another_programs_file_is_refused_and_kept(path):
    path.write_text("precious")
    with pytest.raises(RecordError):
        RecordStore(path, "f")
    assert path.read_text() == "precious"


def test_an_episode_is_recorded_once(path):
    store = filled(path, "paper")
    with pytest.raises(RecordError, match="one of each"):
        store.add(record(scenario="paper"))


def test_fingerprint_ignores_the_order_of_keys_only():
    assert fingerprint({"a": 1, "b": 2}) == fingerprint({"b": 2, "a": 1})
    assert fingerprint({"a": 1, "b": 2}) != fingerprint({"a": 2, "b": 1})
