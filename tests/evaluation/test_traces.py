from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest
from episodes import trace

from defmanip_gym.errors import RecordError
from defmanip_gym.evaluation.traces import load_trace


def test_a_trace_survives_its_file(tmp_path):
    saved = trace("tanner/l1", "nominal-00", 1.0, member="3")
    path = saved.save(tmp_path)
    assert path == tmp_path / "nominal" / "tanner+l1.3.nominal-00.npz"
    loaded = load_trace(path)
    for field in fields(saved):
        value, kept = getattr(saved, field.name), getattr(loaded, field.name)
        if isinstance(value, str):
            assert kept == value
        else:
            np.testing.assert_allclose(kept, value, rtol=1e-6)
    assert list(path.parent.iterdir()) == [path]


@pytest.mark.parametrize("content", [b"", b"no trace", b"PK\x03\x04 cut"])
def test_a_damaged_trace_is_refused(tmp_path, content):
    path = tmp_path / "a.paper.npz"
    path.write_bytes(content)
    with pytest.raises(RecordError, match="records/"):
        load_trace(path)
