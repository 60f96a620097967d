"""A violation that a certificate had promised not to happen does not go unnoticed."""

from __future__ import annotations

from episodes import record

from defmanip_gym.evaluation import comparison
from defmanip_gym.evaluation.broken_certificates import broken_certificates
from defmanip_gym.evaluation.comparison import ComparisonConfig, run_comparison
from defmanip_gym.evaluation.report.sentences import certificate_claim

VIOLATION = {"outcome": "violation", "success": False, "violated": True}
COVERED = {"contestant": "tanner/l1", "certificate_applies": True}
BROKEN = record(**VIOLATION, **COVERED, scenario="nominal-07")
FINE = [
    record(**COVERED),
    record(**VIOLATION),
    record(**VIOLATION, contestant="tanner/l1", certificate_applies=False),
]


def printed(records, folder, monkeypatch, capsys):
    monkeypatch.setattr(comparison, "_complete_records", lambda *_: tuple(records))
    monkeypatch.setattr(comparison, "write_outputs", lambda *_: ((), None))
    monkeypatch.setattr(comparison, "print_results", lambda *_: None)
    run_comparison(ComparisonConfig(output=folder, contestants=("zero",)))
    return " ".join(capsys.readouterr().out.split())


def test_only_violations_that_the_certificate_covers_break_it():
    assert broken_certificates([*FINE, BROKEN]) == (BROKEN,)


def test_a_comparison_says_how_many_broke_and_names_one(tmp_path, monkeypatch, capsys):
    said = printed([*FINE, BROKEN], tmp_path, monkeypatch, capsys)
    assert "1 broken certificates" in said and "tanner/l1" in said and "nominal-07" in said


def test_a_comparison_without_one_says_nothing(tmp_path, monkeypatch, capsys):
    assert "broken" not in printed(FINE, tmp_path, monkeypatch, capsys)


def test_the_report_says_whether_certificates_held():
    assert certificate_claim([record(contestant="tanner")]) is None
    held = certificate_claim(FINE).text
    assert "held" in held and "all 1 episodes" in held
    told = certificate_claim([*FINE, BROKEN]).text
    assert "BROKEN" in told and "1 of 2" in told and "tanner/l1" in told
