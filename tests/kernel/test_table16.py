"""Tables in 16-bit numbers: what they hold, and what is refused."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scissorcal.kernel import Row16, Table, Table16

FINITE = st.floats(-1e6, 1e6, allow_nan=False, width=32)
WHOLE = st.integers(-(2**15), 2**15 - 1)


@given(low=FINITE, span=st.floats(1e-3, 1e6), shares=st.lists(st.floats(0, 1), min_size=1))
def test_a_row_holds_its_range_to_half_a_step(low: float, span: float, shares: list[float]) -> None:
    row = Row16.spanning(low, low + span)
    values = low + span * np.array(shares)
    steps = (low + span - min(low, 0.0 if 0 <= low < 0.5 * (low + span) else low)) / 65535
    allowed = 0.5 * row.scale + 2.0**-23 * (abs(row.offset) + abs(low) + span)
    assert row.scale <= steps * (1 + 2.0**-7) * (1 + 1e-6)
    assert np.all(np.abs(row.rounded(values) - values) <= allowed)


@given(low=st.floats(0.0, 1.0), high=st.floats(2.5, 1e3), whole=st.lists(WHOLE, min_size=1))
def test_what_was_decoded_is_stored_without_loss(low: float, high: float, whole: list[int]) -> None:
    row = Row16.spanning(low, high)
    values = row.values(np.array(whole, dtype=np.int16))
    for down in (False, True):
        assert row.numbers(values, down=down).tolist() == whole
    assert row.rounded([0.0])[0] == 0.0


def test_down_is_never_above() -> None:
    row = Row16.spanning(0.0, 3.7)
    values = np.random.default_rng(1).uniform(0.0, 3.7, 1000)
    below = row.rounded(values, down=True)
    assert np.all(below <= values * (1 + 1e-6))
    assert np.all(below >= values - 1.01 * row.scale)


def test_a_constant_row() -> None:
    row = Row16.spanning(0.25, 0.25)
    assert row.scale == 0.0
    assert row.rounded([0.25, 0.25]).tolist() == [0.25, 0.25]


def stored(knots: int = 5) -> Table16:
    x = np.linspace(0.0, 2.0, knots)
    rows = (Row16.spanning(0.0, 2.0), Row16.spanning(0.0, 4.0), Row16.spanning(0.0, 4.0))
    parts = [row.rounded(part) for row, part in zip(rows, (x, x**2, 2 * x), strict=True)]
    return Table16.of(Table(*parts), rows)


def test_a_table_is_read_as_it_was_stored() -> None:
    table = stored().decoded()
    again = Table16.of(table, stored().rows)
    assert np.array_equal(again.numbers, stored().numbers)
    x = np.linspace(0.0, 2.0, 40)
    assert table.evaluate(x) == pytest.approx(x**2, abs=2e-4)


def test_numbers_that_make_no_table_are_refused() -> None:
    good = stored()
    backwards = good.numbers.copy()
    backwards[0] = backwards[0, ::-1]
    with pytest.raises(ValueError, match="ascend"):
        Table16(backwards, good.rows).decoded()
    with pytest.raises(ValueError, match="2 to 256 knots"):
        Table16(good.numbers[:, :1], good.rows)
    with pytest.raises(ValueError, match="significant bits"):
        Table16(good.numbers, (Row16(0.0, 1.0 / 3.0), *good.rows[1:]))
    for odd in (Row16(float("nan"), 1.0), Row16(0.0, -1.0), Row16(0.0, float("inf"))):
        with pytest.raises(ValueError, match="finite"):
            Table16(good.numbers, (odd, *good.rows[1:]))


def test_a_table_that_its_rows_cannot_hold_is_refused() -> None:
    table = Table([0.0, 1.0], [0.0, 0.3], [0.1, 0.2])
    with pytest.raises(ValueError, match="cannot"):
        Table16.of(table, stored().rows)
