"""docs/payloads.md says how objects are carried."""

import re
from pathlib import Path

from defmanip_gym import errors

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "payloads.md").read_text()


def test_the_script_carries_the_bucket_inside_its_filter(capsys):
    (script,) = re.findall(r"```python\n(.*?)```", PAGE, re.S)
    exec(compile(script, "payloads.md", "exec"), {})
    printed = capsys.readouterr().out.strip()
    assert printed == "['m', 'rad'] True" and f"It prints `{printed}`" in PAGE


def test_what_it_names_is_there():
    for name in re.findall(r"`(\w+Error)`", PAGE):
        assert hasattr(errors, name)
    for path in re.findall(r"(?:benchmarks/[\w/]+\.py|images/\w+\.png)", PAGE):
        assert (ROOT / path).exists() or (ROOT / "docs" / path).exists()
