"""Cells of the statistics that verdicts rest on: weights, chains, whiteness, noise, groups."""

from collections.abc import Callable

import numpy as np
from benchmarks.extremes.cells import Cell, Found

from scissorcal.aliases import Array
from scissorcal.inference import fit_ar, ljung_box, smooth_weights, tails_of
from scissorcal.inference.ascent import least_squares
from scissorcal.inference.autocorrelation import robust_covariance_of_scores
from scissorcal.inference.between import between_groups
from scissorcal.inference.thorough import rank_r_hat

Check = Callable[[np.random.Generator], tuple[bool, str]]
"""Whether what was stated holds, and what was found."""

PLAYS, MOST_LOW = 200, 0.06
WHITE = "p above 0.01 for 94 % of 200 series of independent residuals"
"""False alarms: 2e-7 where p is uniform, 2e-3 where 2.5 % of it are below 0.01."""


def cells() -> tuple[Cell, ...]:
    """The cells of single statistics."""
    rows: tuple[tuple[str, str, str, Check], ...] = (
        ("importance weights all equal", "1,000 equal weights", "even weights, k-hat infinite",
         lambda rng: _weights(np.zeros(1000), np.inf)),
        ("one importance weight dominates", "one log weight 800 above the rest",
         "k-hat infinite",
         lambda rng: _weights(np.append(rng.standard_normal(999), 800.0), np.inf)),
        ("log weights of 1e300", "one log weight of 1e300", "k-hat infinite",
         lambda rng: _weights(np.append(rng.standard_normal(999), 1e300), np.inf)),
        ("5 importance weights", "5 weights", "k-hat infinite",
         lambda rng: _weights(rng.standard_normal(5), np.inf)),
        ("log weights that spread by 1e3", "log weights with an sd of 1,000", "k-hat above 0.7",
         lambda rng: _weights(1e3 * rng.standard_normal(1000), 0.7)),
        ("importance weights that are NaN", "a weight is NaN", "refused in a sentence",
         lambda rng: _weights(np.append(rng.standard_normal(999), np.nan), np.inf)),
        ("R-hat of chains that never move", "all draws equal", "NaN: nothing is known",
         lambda rng: _is(rank_r_hat(np.ones((4, 100))), np.nan)),
        ("R-hat of chains that stand apart", "each chain constant, at its own place", "infinite",
         lambda rng: _is(rank_r_hat(np.arange(4.0)[:, None] * np.ones((4, 100))), np.inf)),
        ("R-hat of 3 draws", "3 draws a chain", "NaN: nothing is known",
         lambda rng: _is(rank_r_hat(rng.standard_normal((4, 3))), np.nan)),
        ("whiteness of 3 residuals", "3 residuals, 20 lags asked for", WHITE,
         lambda rng: _p(rng.standard_normal((PLAYS, 3)))),
        ("whiteness of 20 residuals", "as many residuals as lags", WHITE,
         lambda rng: _p(rng.standard_normal((PLAYS, 20)))),
        ("whiteness of no residuals", "0 residuals", "p of 1", lambda rng: _p(np.zeros((1, 0)))),
        ("whiteness of constant residuals", "100 residuals of 0.1", "p of 1",
         lambda rng: _p(np.full((1, 100), 0.1))),
        ("whiteness of residuals of 1e-200", "squares underflow", WHITE,
         lambda rng: _p(1e-200 * rng.standard_normal((PLAYS, 500)))),
        ("whiteness of residuals of 1e200", "squares overflow", WHITE,
         lambda rng: _p(1e200 * rng.standard_normal((PLAYS, 500)))),
        ("whiteness of a NaN", "a residual is NaN", "p is NaN, which fails verdicts",
         lambda rng: _is(ljung_box(np.append(np.zeros(50), np.nan), np.zeros(51, int)).share,
                         np.nan)),
        ("noise that is a sine", "residuals follow exactly from those before", "its sd to 10 %",
         lambda rng: _sd(np.sin(0.3 * np.arange(1000.0)), np.sqrt(0.5))),
        ("noise that is a ramp", "residuals grow linearly", "its rms to 10 %",
         lambda rng: _sd(np.arange(1000.0), 1000.0 / np.sqrt(3.0))),
        ("noise of 1e-200", "squares underflow", "its sd to 10 %",
         lambda rng: _sd(1e-200 * rng.standard_normal(1000), 1e-200)),
        ("noise of 1e160", "squares overflow", "its sd to 10 %",
         lambda rng: _sd(1e160 * rng.standard_normal(1000), 1e160)),
        ("tails of 1e-200", "residuals of 1e-200 with heavy tails", "degrees of freedom 2.1 to 5",
         lambda rng: _between(tails_of(1e-200 * rng.standard_t(3, 2000), 1.0), 2.1, 5.0)),
        ("tails with an outlier of 1e150 sd", "one residual of 1e150", "heavy: at most 20",
         lambda rng: _between(tails_of(np.append(rng.standard_normal(1000), 1e150), 1.0), 2.1, 20)),
        ("tails of NaN", "a residual is NaN", "refused in a sentence",
         lambda rng: _is(tails_of(np.array([0.1, np.nan]), 1.0), 0.0)),
        ("covariance of scores each in its own series", "no score follows another",
         "that of independent scores to 40 %", _alone),
        ("covariance of scores that are NaN", "a score is NaN", "refused in a sentence",
         lambda rng: _is(float(robust_covariance_of_scores(
             np.full((50, 1), np.nan), np.zeros(50, int))[0, 0]), 0.0)),
        ("two groups alike", "two equal estimates", "scatter below ten times their sd",
         lambda rng: _groups([1.0, 1.0], 0.1, rng, 0.0, 1.0)),
        ("two groups 1e6 apart", "two estimates 1e7 of their sds apart",
         "their mean's sd at least 1e5", lambda rng: _groups([1.0, 1e6], 0.1, rng, 1e5, np.inf)),
        ("groups that are NaN", "an estimate is NaN", "refused in a sentence",
         lambda rng: _groups([np.nan, 1.0], 0.1, rng, 0.0, 0.0)),
        ("least squares of NaN", "residuals are NaN", "not converged",
         lambda rng: _squares(np.nan)),
        ("least squares of slopes of 1e200", "slopes overflow when squared", "not converged",
         lambda rng: _squares(1e200)),
        ("least squares in units of 1e12", "slopes of 1e-12", "converged to 1e-9", _units),
    )  # fmt: skip
    return tuple(
        Cell(name, "inference", extreme, stated, "closed form", _judged(check, stated))
        for name, extreme, stated, check in rows
    )


def _judged(check: Check, stated: str) -> Callable[[np.random.Generator], Found]:
    def run(rng: np.random.Generator) -> Found:
        holds, found = check(rng)
        return Found("right" if holds else "wrong", f"{found}; stated: {stated}")

    return run


def _weights(log_ratios: Array, least: float) -> tuple[bool, str]:
    weights, k_hat = smooth_weights(log_ratios)
    total = float(np.exp(weights).sum())
    holds = bool(float(k_hat) >= least and abs(total - 1.0) < 1e-9)
    return holds, f"k-hat {float(k_hat):.3g}, weights sum to {total:.6g}"


def _is(value: float, wanted: float) -> tuple[bool, str]:
    return bool(np.array_equal(value, wanted, equal_nan=True)), f"found {value:.3g}"


def _between(value: float, low: float, high: float) -> tuple[bool, str]:
    return low <= value <= high, f"found {value:.3g}"


def _p(every: Array) -> tuple[bool, str]:
    """Each row of residuals is independent, and most should count as that."""
    found = [ljung_box(row, np.zeros(len(row), dtype=np.int64)) for row in every]
    low = sum(not 0.01 < one.p_value <= 1.0 for one in found)
    most = float(np.median([one.share for one in found]))
    holds = low <= MOST_LOW * len(found) and most > 0.5
    return holds, f"{low} of {len(found)} p up to 0.01"


def _sd(residuals: Array, true: float) -> tuple[bool, str]:
    found = fit_ar(residuals, np.zeros(len(residuals), dtype=np.int64)).marginal_sd
    return abs(found / true - 1.0) < 0.1, f"sd {found:.4g}, true {true:.4g}"


def _alone(rng: np.random.Generator) -> tuple[bool, str]:
    found = robust_covariance_of_scores(rng.standard_normal((200, 1)), np.arange(200))
    return abs(found[0, 0] / 200.0 - 1.0) < 0.4, f"found {found[0, 0]:.4g}, expected 200"


def _groups(
    means: list[float], sd: float, rng: np.random.Generator, least: float, most: float
) -> tuple[bool, str]:
    precisions = np.full((2, 1, 1), sd**-2.0)
    column = np.array(means)[:, None]
    found = between_groups(column, precisions, np.full(1, sd), np.eye(1) * 1e-20, rng)
    spread = float(np.subtract(*np.quantile(found.population[:, 0], [0.84, 0.16]))) / 2
    return least <= spread <= most, f"sd {spread:.3g}"


def _squares(slope: float) -> tuple[bool, str]:
    def evaluate(x: Array) -> tuple[Array, Array]:
        return x * slope - np.arange(1.0, 4.0), np.full((3, 1), slope)

    point, converged = least_squares(evaluate, np.zeros(1))
    return not converged, f"converged: {converged}, at {point[0]:.3g}"


def _units(rng: np.random.Generator) -> tuple[bool, str]:
    x = np.arange(1.0, 4.0)

    def evaluate(u: Array) -> tuple[Array, Array]:
        return u * x * 1e-12 - x, x[:, None] * 1e-12

    point, converged = least_squares(evaluate, np.zeros(1))
    error = abs(float(point[0]) / 1e12 - 1.0)
    return converged and error < 1e-9, f"error {error:.1g}"
