"""What the README shows works."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text()
SCRIPTS = re.findall(r"```python\n(.*?)```", README, re.S)


def test_the_script_in_the_readme_runs_and_succeeds(capsys):
    (script,) = (each for each in SCRIPTS if "TannerController" in each)
    exec(compile(script, "README.md", "exec"), {})
    success, margin = capsys.readouterr().out.split()
    assert success == "True"
    assert float(margin) > 0


def test_the_agent_inside_the_filter_arrives_and_is_hardly_ever_corrected(capsys):
    (script,) = (each for each in SCRIPTS if "SafetyFilterWrapper" in each)
    exec(compile(script, "README.md", "exec"), {})
    success, applies, rate = capsys.readouterr().out.split()
    assert success == applies == "True"
    assert float(rate) < 0.02
    assert len(SCRIPTS) == 2


@pytest.mark.parametrize(
    "document",
    [
        "README.md",
        "CONTRIBUTING.md",
        "docs/architecture.md",
        "docs/data.md",
        "docs/evaluation.md",
        "docs/filters.md",
        "docs/training.md",
        "docs/performance.md",
        "docs/recipes.md",
    ],
)
def test_links_and_named_files_exist(document):
    path = ROOT / document
    for target in re.findall(r"\]\((?!https:)([^)#]+)\)", path.read_text()):
        assert (path.parent / target).exists(), target


def test_makefile_has_the_targets_that_the_readme_names():
    targets = set(re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text(), re.M))
    assert set(re.findall(r"^make ([\w-]+)", README, re.M)) <= targets


def test_bounds_in_the_readme_are_what_certify_returns():
    from defmanip_gym.params import BeamParams
    from defmanip_gym.theory.certificates import CERTIFICATE_METHODS, certify

    rows = re.findall(r'\| `"(\w+)"` \| ([\d.e-]+) \\\| ([\d.e-]+) \|', README)
    assert [name for name, *_ in rows] == list(CERTIFICATE_METHODS)
    for name, *values in rows:
        for damping, value in zip((1.0, 0.1), values, strict=True):
            certificate = certify(BeamParams(damping=damping), method=name)
            assert certificate.nu_max == pytest.approx(float(value), rel=6e-3)
