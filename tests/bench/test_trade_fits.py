"""Errors of fits against a reference: zero against itself, exact where they are known."""

import json
from typing import Any

import pytest

from scissorcal.bench.trade.fits import MEAN, QUANTILES, SD, fits_errors
from scissorcal.bench.trade.point import Sample
from scissorcal.bench.trade.torque import (
    AVERAGE,
    BAND_AVERAGE,
    BAND_WORST,
    WIDTH_WORST,
    WORST,
    SceneTorque,
)
from tests.bench.made_trade import made_case


def outcome(
    *, mean: float = 1.0, sd: float = 0.5, torque: float = 2.0, width: float = 0.1
) -> dict[str, Any]:
    """Two parameters and three places, the last one beyond the blade."""
    first = {"mean": mean, "sd": sd, "q05": mean - sd, "q95": mean + sd}
    exact = {"mean": 0.0, "sd": 0.0, "q05": 0.0, "q95": 0.0}
    places = [torque, -4.0, None]
    return {
        "parameters": {"cut kappa": first, "cut held": exact},
        "torque": places,
        "low": [value if value is None else value - width for value in places],
        "high": [value if value is None else value + width for value in places],
    }


def errors(own: dict[str, Any]) -> dict[str, float]:
    found = fits_errors(made_case(), Sample({}, own), Sample({}, outcome()))
    return {name: error.value for name, error in found.items()}


def test_a_reference_has_no_error_against_itself() -> None:
    found = errors(outcome())
    wide = {name: value for name, value in found.items() if value}
    assert set(wide) == {"average band half width", WIDTH_WORST}
    assert wide[WIDTH_WORST] == pytest.approx(0.1)


def test_parameters_are_compared_in_sds_of_the_reference() -> None:
    found = errors(outcome(mean=2.0, sd=0.25))
    assert found[MEAN] == pytest.approx(2.0)
    assert found[SD] == pytest.approx(0.5)
    assert found[QUANTILES] == pytest.approx(2.5)


def test_torque_and_its_band_are_compared_place_by_place() -> None:
    found = fits_errors(
        made_case(), Sample({}, outcome(torque=2.4, width=0.2)), Sample({}, outcome())
    )
    assert found[WORST].value == pytest.approx(0.4)
    assert found[WORST].share == pytest.approx(0.1)
    assert found[AVERAGE].value == pytest.approx(0.2)
    assert found[BAND_WORST].value == pytest.approx(0.5)
    assert found[BAND_AVERAGE].value == pytest.approx((0.3 + 0.1 + 0.5 + 0.1) / 4)


def test_torque_keeps_its_numbers_in_json() -> None:
    found = SceneTorque.of(outcome())
    again = SceneTorque.of(json.loads(json.dumps(found.plain(), allow_nan=False)))
    assert again.plain() == found.plain() == {k: outcome()[k] for k in ("torque", "low", "high")}
