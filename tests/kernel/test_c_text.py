"""A model as C text: its numbers are exact."""

import numpy as np
import pytest

from scissorcal.kernel.c_text import c_float


def test_numbers_of_c_text_are_exact() -> None:
    """Any finite pattern of 32 bits, among them the smallest, comes back."""
    rng = np.random.default_rng(4)
    patterns = rng.integers(0, 2**32, 2000, dtype=np.uint64).astype(np.uint32)
    values = np.append(patterns.view(np.float32), np.float32([0.0, -0.0, 1e-45, 3.4e38]))
    values = values[np.isfinite(values)]
    again = [float.fromhex(c_float(value).removesuffix("f")) for value in values.tolist()]
    assert np.array_equal(np.float32(again).view(np.uint32), values.view(np.uint32))


@pytest.mark.parametrize("value", [np.inf, -np.inf, np.nan, 1e39])
def test_a_number_that_is_not_finite_in_32_bits_is_refused(value: float) -> None:
    with np.errstate(over="ignore"), pytest.raises(ValueError, match="no finite number"):
        c_float(value)
