"""Percentiles against what sorting by hand gives."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scissorcal.render import latency_of


def test_a_thousand_known_latencies() -> None:
    latency = latency_of(np.random.default_rng(1).permutation(np.arange(1, 1001)) * 1000)
    assert latency is not None
    assert (latency.p50, latency.p99, latency.p999, latency.worst) == (500, 990, 999, 1000)


@pytest.mark.parametrize("nothing", [[], [0], [0, 0, 0]])
def test_no_commands_have_no_latency(nothing: list[int]) -> None:
    assert latency_of(np.array(nothing, dtype=np.uint32)) is None


@given(st.lists(st.integers(1, 2**32 - 1), min_size=1, max_size=300))
def test_each_percentile_occurred_and_they_ascend(values: list[int]) -> None:
    latency = latency_of(np.array(values, dtype=np.uint32))
    assert latency is not None
    found = [latency.p50, latency.p99, latency.p999, latency.worst]
    assert found == sorted(found)
    assert set(found) <= {value / 1000 for value in values}
    assert latency.worst == max(values) / 1000
    assert np.mean(np.array(values) / 1000 <= latency.p50) >= 0.5
