"""Numbers as people read them."""

import doctest
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scissorcal.report import numbers, panel, strokes
from scissorcal.report.numbers import (
    decimals_for,
    display,
    finite,
    finite_each,
    percent,
    scalar,
    short,
    significant,
    unit_text,
    with_decimals,
)

VALUES = st.floats(min_value=-1e300, max_value=1e300) | st.sampled_from(
    [math.nan, math.inf, -math.inf, 5e-324, -5e-324]
)
SUPERSCRIPT = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹−", "-0123456789-", "\u202f")


def value_of(text: str) -> float:
    """Read a number back that was written for people."""
    mantissa, times, power = text.translate(SUPERSCRIPT).partition(" × 10")
    return float(f"{mantissa}e{power}" if times else mantissa)


@pytest.mark.parametrize("module", [numbers, strokes, panel])
def test_examples_in_docstrings_hold(module: object) -> None:
    outcome = doctest.testmod(module)  # type: ignore[arg-type]
    assert outcome.attempted > 0
    assert outcome.failed == 0


@given(VALUES, st.integers(1, 8))
def test_any_number_can_be_written_and_read_back(value: float, digits: int) -> None:
    text = significant(value, digits)
    if not math.isfinite(value):
        assert text == "not available"
        return
    for written in (text, short(value, digits)):
        assert value_of(written) == pytest.approx(
            value, rel=0.51 * 10.0 ** (1 - digits), abs=1e-320
        )


@given(VALUES, st.integers(-290, 400))
def test_any_number_can_be_written_to_any_place(value: float, decimals: int) -> None:
    text = with_decimals(value, decimals)
    if not math.isfinite(value):
        assert text == "not available"
    else:
        assert abs(value_of(text) - value) <= max(0.51 * 10.0**-decimals, 1e-14 * abs(value))


@given(st.floats(min_value=1e-12, max_value=1e12), st.floats(min_value=1e-9, max_value=1e9))
def test_a_mean_is_written_to_two_digits_of_its_sd(sd: float, mean: float) -> None:
    written = with_decimals(mean, decimals_for(sd, mean))
    assert abs(value_of(written) - mean) <= 0.051 * sd + 1e-14 * mean


@pytest.mark.parametrize(
    ("written", "expected"),
    [
        (significant(0.0), "0"),
        (significant(-0.5), "−0.500"),
        (significant(1.7976931348623157e308), "1.80 × 10³⁰⁸"),
        (significant(99999.6, 5), "1.0000 × 10⁵"),
        (with_decimals(-51902.8, 1), "−51\u202f902.8"),
        (with_decimals(0.00001, 4), "0.0000"),
        (with_decimals(-0.00001, 4), "0.0000"),
        (percent(0.0005), "0.050 %"),
        (percent(None), "not available"),
        (unit_text("N m s/rad"), "N m s/rad"),
        (unit_text("J/m^-2 x^10"), "J/m⁻² x¹⁰"),
        (display(1234567), "1\u202f234\u202f567"),
        (display(value=True), "yes"),
        (scalar((1.5, float("nan"))), "1.5, not available"),
    ],
)
def test_cases(written: object, expected: str) -> None:
    assert written == expected


def test_what_json_cannot_hold_becomes_nothing() -> None:
    assert finite("3") is None
    assert scalar(float("inf")) is None
    assert finite_each([1.23456789, float("nan"), float("-inf")], 3) == (1.23, None, None)
