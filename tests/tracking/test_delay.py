"""The camera's delay from replays of pictures and contacts, and when it cannot be seen."""

import numpy as np
import pytest
from benchmarks.control.pose_run import settings_for
from benchmarks.control.world import Scenario, circle, make_world, plane
from scipy.stats import chi2

from scissorcal.model import Plane
from scissorcal.tracking.judge import DelayFit, _last, measure_delay
from scissorcal.tracking.rows import CameraPose, TipContact


def measured(scenario: Scenario, seed: int, late_s: float) -> DelayFit:
    """Pictures that are taken for ``late_s`` earlier than they were exposed."""
    world = make_world(scenario, plane, circle(10e-3), np.random.default_rng(seed))
    pictures = [
        CameraPose(p.exposed_s - late_s, p.rotation, p.place_m, p.covariance, p.certain)
        for p in world.pictures
    ]
    contacts = [
        TipContact(time, point, force)
        for time, point, force in zip(
            world.times_s.tolist(), world.point_m, world.force_N.tolist(), strict=True
        )
    ]
    return measure_delay(Plane(), settings_for(scenario), pictures, contacts)


@pytest.mark.parametrize(
    ("seed", "late_s"), [pytest.param(8, 0.0, marks=pytest.mark.slow), (12, 0.03)]
)
def test_a_moving_plate_that_is_touched_shows_the_delay(seed: int, late_s: float) -> None:
    fit = measured(Scenario("moving", moving=True, seconds=8.0), seed, late_s)
    assert fit.known
    assert fit.later_s == pytest.approx(late_s, abs=3.0 * fit.sd_s)
    assert 1e-3 < fit.sd_s < 8e-3
    assert "ms later than camera_delay_ms says" in fit.sentence


@pytest.mark.slow
def test_its_standard_deviation_is_honest() -> None:
    """Mean square of 12 z-scores below the 99.9 % quantile of a chi-square.

    Of 40 such runs all measured the delay, so at least 93 % do (95 %, binomial): of 12 then 7 or
    fewer with a chance of 1e-3.
    """
    scenario = Scenario("moving", moving=True, seconds=8.0)
    scores = []
    for seed in range(100, 112):
        late = 0.02 * (seed % 3 - 1)
        fit = measured(scenario, seed, late)
        if fit.known:
            scores.append((fit.later_s - late) / fit.sd_s)
    assert len(scores) > 7
    assert np.mean(np.square(scores)) < chi2.ppf(0.999, len(scores)) / len(scores)


def test_a_plate_at_rest_shows_none() -> None:
    fit = measured(Scenario("fixed", seconds=4.0), 1, 0.02)
    assert not fit.known
    assert "was not measured" in fit.sentence


def test_a_long_track_is_measured_by_its_end() -> None:
    contacts = [TipContact(0.01 * number, np.zeros(3), 2.0) for number in range(5000)]
    pictures = [
        CameraPose(0.1 * number, np.eye(3), np.zeros(3), np.eye(6)) for number in range(500)
    ]
    kept, touched = _last(pictures, contacts)
    assert len(touched) == 2000
    assert kept[0].time_s == pytest.approx(touched[0].time_s - 1.0)
    kept, touched = _last(pictures, contacts[1000:1100])
    assert touched == contacts[1000:1100]
    assert kept[0].time_s == pytest.approx(9.0)
    assert kept[-1].time_s <= touched[-1].time_s + 0.1, "none from long after the last contact"


def test_pictures_without_contacts_show_none() -> None:
    fit = measure_delay(Plane(), settings_for(Scenario("fixed")), [], [])
    assert not fit.known
    assert "20 of each are needed" in fit.sentence
