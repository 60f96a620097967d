"""Cards tell which sources a training depended on."""

from defmanip_gym.training import sources
from defmanip_gym.training.sources import sources_digest, training_files


def names():
    root = sources._ROOT
    return {path.relative_to(root).as_posix() for path in training_files()}


def test_what_moves_and_rewards_an_agent_counts():
    assert {
        "envs/engine.py",
        "envs/task.py",
        "plant/simulation.py",
        "theory/filters/storage_filter.py",
        "training/train.py",
        "training/model.py",
        "baselines/residual_action.py",
        "baselines/analytic/field.py",
        "wrappers/safety_filter.py",
    } <= names()


def test_what_only_judges_or_shows_does_not():
    assert not any(name.startswith(("certification/", "oracle/", "catalogue/")) for name in names())
    assert not {"cli.py", "evaluation/comparison.py", "evaluation/report/page.py"} & names()


def test_the_digest_changes_with_a_file(tmp_path, monkeypatch):
    before = sources_digest()
    changed = tmp_path / "train.py"
    changed.write_bytes(b"# another\n")
    monkeypatch.setattr(sources, "training_files", lambda: (changed,))
    monkeypatch.setattr(sources, "_ROOT", tmp_path)
    sources_digest.cache_clear()
    try:
        assert sources_digest() != before
    finally:
        sources_digest.cache_clear()
