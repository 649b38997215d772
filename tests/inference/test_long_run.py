"""What scores are worth under noise with memory: exact sums, coverage, blocks, tails."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import toeplitz

from scissorcal.aliases import Array
from scissorcal.inference import ArNoise, Problem, fit_ar, infer, log_density, tails_of
from scissorcal.inference.autocorrelation import covariance_of_sum


def test_covariance_of_a_sum_is_the_toeplitz_quadratic_form():
    rng = np.random.default_rng(0)
    noise = ArNoise(2, (1.2, -0.5), 0.7)
    slopes = rng.standard_normal((140, 3))
    series = np.repeat([4, 7], [90, 50])
    expected = np.zeros((3, 3))
    for label in (4, 7):
        part = slopes[series == label]
        expected += part.T @ toeplitz(noise.autocovariance(len(part))) @ part
    assert np.allclose(covariance_of_sum(slopes, series, noise), expected, rtol=1e-10)


def test_autocovariances_are_those_of_drawn_noise():
    noise = ArNoise(2, (1.2, -0.5), 0.7)
    drawn = noise.draw(np.zeros(400_000, dtype=np.int64), np.random.default_rng(1))
    seen = [float(np.mean(drawn[lag:] * drawn[: len(drawn) - lag])) for lag in range(6)]
    assert np.allclose(noise.autocovariance(6), seen, atol=0.02)


def regression(
    design: Array, measured: Array, series: NDArray[np.int64], **more: object
) -> Problem:
    p = design.shape[1] + 1

    def standardised(u: Array) -> tuple[Array, Array]:
        z = (measured - design @ u[:-1]) / np.exp(u[-1])
        return z, np.full(len(z), u[-1])

    def terms(u: Array) -> Array:
        z, log_sd = standardised(u)
        return log_density(z, float(more.get("tails", np.inf))) - log_sd

    return Problem(
        names=(*(f"b{i}" for i in range(p - 1)), "noise"),
        log_prior=lambda u: -0.5 * float(np.sum((u / 50.0) ** 2)),
        log_likelihood_terms=terms,
        series=series,
        prior_sd=np.full(p, 50.0),
        starts=np.zeros((1, p)),
        lower=np.full(p, -400.0),
        upper=np.full(p, 400.0),
        standardised=standardised,
        **more,
    )


def sweeps(n: int) -> Array:
    """Sign, speed and acceleration of sweeps to and fro, like those of friction."""
    t = np.arange(n)
    speed = np.where((t // 150) % 2 == 0, 1.0, -1.0) * (0.3 + 0.2 * ((t // 300) % 4))
    return np.stack([np.sign(speed), speed, np.gradient(speed) + 0.3 * np.sin(t / 7.0)], axis=1)


@pytest.mark.parametrize(
    ("rho", "fits", "least", "most"),
    [
        (0.9, 15, 0.74, 1.0),
        pytest.param(0.0, 120, 0.83, 0.96, marks=pytest.mark.slow),
        pytest.param(0.9, 120, 0.83, 0.96, marks=pytest.mark.slow),
    ],
)
def test_intervals_keep_their_coverage_under_noise_with_memory(rho, fits, least, most):
    """Fits of 3 slopes: coverage of 90 % within 3.5 standard deviations of a binomial.

    Of 120 fits that is 0.83 to 0.96, of 15 it is 0.74 and more. Intervals that leave out the memory
    are too narrow by up to 4.4, the square root of (1 + rho) / (1 - rho).
    """
    design, series = sweeps(3000), np.zeros(3000, dtype=np.int64)
    noise = ArNoise(1, (rho,), 1.0) if rho else ArNoise(0, (), 1.0)
    truth = np.array([1.0, -0.5, 2.0])
    inside = []
    for seed in range(fits):
        rng = np.random.default_rng(seed)
        measured = design @ truth + noise.draw(series, rng)
        found = infer(regression(design, measured, series), "draft", rng, count=1000)
        low, high = np.quantile(found.draws[:, :3], [0.05, 0.95], axis=0)
        inside.append((low < truth) & (truth < high))
        assert found.noise_orders[0] >= (1 if rho else 0)
    assert least < float(np.mean(inside)) <= most


def test_what_strokes_have_in_common_widens_the_intervals():
    """Every stroke has a level of its own, which no autoregression within strokes can show."""
    rng = np.random.default_rng(3)
    design, series = sweeps(3000), np.zeros(3000, dtype=np.int64)
    strokes = np.arange(3000) // 150
    white = design @ [1.0, 0.0, 0.0] + rng.standard_normal(3000)
    own = white + 0.5 * rng.standard_normal(20)[strokes]
    calm = infer(regression(design, white, series, blocks=strokes), "draft", rng)
    uneven = infer(regression(design, own, strokes, blocks=strokes), "draft", rng)
    assert calm.dispersion < 1.6
    assert uneven.dispersion > 2.0 or uneven.inflation[0] > 3.0


def test_outliers_are_noticed_and_do_not_draw_the_optimum():
    rng = np.random.default_rng(4)
    design, series = sweeps(2000), np.zeros(2000, dtype=np.int64)
    noise = rng.standard_normal(2000) * 0.1
    noise[rng.choice(2000, 40, replace=False)] += 5.0 * np.sign(design[:40, 0])
    measured = design @ [1.0, -0.5, 0.0] + noise
    normal = infer(regression(design, measured, series), "draft", rng)
    z = (measured - design @ normal.optimum.point[:3]) / np.exp(normal.optimum.point[3])
    tails = tails_of(z, 1.0)
    assert tails < 4.0
    robust = infer(regression(design, measured, series, tails=tails), "draft", rng)
    away = [np.abs(found.optimum.point[:3] - [1.0, -0.5, 0.0]).max() for found in (normal, robust)]
    assert away[1] < 0.3 * away[0]
    assert robust.covariance[1, 1] < 0.1 * normal.covariance[1, 1]


def test_memory_is_never_taken_across_series():
    """Two series of one long trend each: joined as one they would look like a jump."""
    rng = np.random.default_rng(5)
    series = np.repeat([0, 1], 500)
    noise = ArNoise(1, (0.8,), 1.0).draw(series, rng)
    found = fit_ar(noise, series)
    assert found.order == 1
    assert abs(found.coefficients[0] - 0.8) < 0.08
