from __future__ import annotations

import numpy as np
import pytest
from episodes import trace

from defmanip_gym.errors import RecordError
from defmanip_gym.evaluation.traces import load_trace


def test_a_trace_survives_its_file(tmp_path):
    saved = trace("tanner/l1", "paper", 1.0)
    path = saved.save(tmp_path)
    loaded = load_trace(path)
    assert (loaded.contestant, loaded.scenario) == ("tanner/l1", "paper")
    np.testing.assert_array_equal(loaded.position_m, saved.position_m)
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("content", [b"", b"no trace", b"PK\x03\x04 cut"])
def test_a_damaged_trace_is_refused(tmp_path, content):
    path = tmp_path / "a.paper.npz"
    path.write_bytes(content)
    with pytest.raises(RecordError, match="--fresh"):
        load_trace(path)
