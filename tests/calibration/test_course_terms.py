"""Terms of a whole course of motion against motion that is written down here."""

import numpy as np
import pytest

from scissorcal.calibration.leftover import course_of
from scissorcal.calibration.signals.filtering import Bins
from scissorcal.model import LIBRARY, TERMS

TIME = np.linspace(0.0, 2.0, 20001)
STEP = TIME[1] - TIME[0]
LOW, HIGH = 0.2, 0.8


def there_and_back() -> Bins:
    """One closing and one opening stroke, as a cosine of the time."""
    opening = 0.5 * (LOW + HIGH) + 0.5 * (HIGH - LOW) * np.cos(np.pi * TIME)
    rate = -0.5 * np.pi * (HIGH - LOW) * np.sin(np.pi * TIME)
    acceleration = -0.5 * np.pi**2 * (HIGH - LOW) * np.cos(np.pi * TIME)
    zeros = np.zeros(len(TIME), dtype=np.int64)
    return Bins(
        TIME, opening, rate, acceleration, 0.0 * TIME, 0.0 * TIME, rate != 0.0, zeros, zeros,
        (TIME > 1.0).astype(np.int64), zeros, 0.005, 1e-3,
    )  # fmt: skip


@pytest.mark.parametrize("periods", [1, 3, 6])
@pytest.mark.parametrize(("phase", "late"), [("cos", 0.0), ("sin", 0.5 * np.pi)])
def test_a_misread_opening_has_the_second_derivative_of_its_error(periods, phase, late):
    bins = there_and_back()
    many = f"{periods} period{'s' if periods > 1 else ''}"
    column = LIBRARY[f"misread {phase}({many})"].column(course_of(bins, None))
    error = np.cos(2.0 * np.pi * periods * (bins.opening - LOW) / (HIGH - LOW) - late)
    expected = np.gradient(np.gradient(error, STEP), STEP)
    inner = slice(5, -5)
    assert np.allclose(column[inner], expected[inner], atol=2e-3 * np.abs(expected).max())


def test_the_way_since_a_reversal_begins_anew_with_each_stroke():
    bins = there_and_back()
    course = course_of(bins, None)
    back = bins.rate > 0.0
    assert np.allclose(course.way[back], (bins.opening[back] - LOW) / (HIGH - LOW), atol=1e-6)
    moving = np.flatnonzero(bins.rate < 0.0)
    assert np.all(np.diff(course.way[moving]) > 0.0)
    assert course.time[0] == pytest.approx(-1.0)
    assert (course.pace.min(), course.pace.max()) == (0.0, 1.0)


def test_no_recipe_adopts_a_term_of_a_course():
    assert not any(LIBRARY[name].adoptable for name in set(LIBRARY) - set(TERMS))
    assert len({term.name for term in LIBRARY.values()}) == len(LIBRARY)
