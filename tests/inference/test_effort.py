"""Each level of effort against known densities, and what it says where there is none."""

import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from scissorcal.aliases import Array
from scissorcal.errors import InputError
from scissorcal.inference import (
    InferOptions,
    NotFiniteError,
    Problem,
    SamplingStatus,
    SearchStatus,
    find_optimum,
    infer,
)
from scissorcal.inference.mixture import Mixture
from scissorcal.inference.thorough import run_ensembles

CORRELATED = np.array([[1.0, 0.95, 0.0], [0.95, 1.0, 0.0], [0.0, 0.0, 4.0]])


def problem_of(
    log_density: Callable[[Array], float], starts: list[list[float]], **more: object
) -> Problem:
    size = len(starts[0])
    settings: dict[str, object] = {
        "names": tuple("abcdefgh"[:size]),
        "log_prior": lambda u: 0.0,
        "log_likelihood_terms": lambda u: np.array([log_density(u)]),
        "series": np.zeros(1, dtype=np.int64),
        "prior_sd": np.full(size, 10.0),
        "starts": np.array(starts),
        "lower": np.full(size, -200.0),
        "upper": np.full(size, 200.0),
        "independent": True,
    }
    return Problem(**{**settings, **more})


def normal(covariance: Array) -> Callable[[Array], float]:
    precision = np.linalg.inv(covariance)
    return lambda u: -0.5 * float(u @ precision @ u)


def banana(bend: float) -> Callable[[Array], float]:
    """a is standard normal; b given a is normal about bend * a^2 with sd 0.25."""
    return lambda u: -0.5 * float(u[0] ** 2 + ((u[1] - bend * u[0] ** 2) / 0.25) ** 2)


def funnel(u: Array) -> float:
    """a is normal with sd 1.5; b and c given a are normal with variance exp(a)."""
    return float(-0.5 * (u[0] ** 2 / 2.25 + np.exp(-u[0]) * (u[1] ** 2 + u[2] ** 2)) - u[0])


def two_hills(u: Array) -> float:
    """30 % about (-4, -4), 70 % about (4, 4), both of unit covariance."""
    return float(
        np.logaddexp(
            np.log(0.7) - 0.5 * np.sum((u - 4) ** 2), np.log(0.3) - 0.5 * np.sum((u + 4) ** 2)
        )
    )


@pytest.mark.parametrize(
    "effort", ["draft", "standard", pytest.param("thorough", marks=pytest.mark.slow)]
)
def test_a_correlated_normal(effort: str) -> None:
    """4000 draws: an sd is known to 1.1 %, a correlation of 0.95 to 0.002."""
    found = infer(
        problem_of(normal(CORRELATED), [[3.0, 3.0, 3.0]]),
        effort,
        np.random.default_rng(0),
        count=4000,
    )
    assert found.draws.shape == (4000, 3)
    assert found.effort_reached == effort
    assert found.covariance == pytest.approx(CORRELATED, abs=1e-6)
    assert found.draws.mean(axis=0) / [1, 1, 2] == pytest.approx(np.zeros(3), abs=0.08)
    assert found.draws.std(axis=0) == pytest.approx([1, 1, 2], rel=0.05)
    assert np.corrcoef(found.draws, rowvar=False)[0, 1] == pytest.approx(0.95, abs=0.012)
    assert found.status.trusted == (effort != "draft")
    assert (found.ensembles, bool(np.isfinite(found.tau).all())) == (
        (4, True) if effort == "thorough" else (0, False)
    )


def test_a_bent_valley_makes_standard_help_itself_with_a_mixture() -> None:
    found = infer(
        problem_of(banana(0.5), [[1.0, 1.0]]), "standard", np.random.default_rng(0), count=4000
    )
    assert found.effort_reached == "standard"
    assert "mixture" in found.sentence
    assert found.status is SamplingStatus.WEIGHED
    assert found.draws[:, 0].std() == pytest.approx(1.0, rel=0.05)
    # What makes it a banana: b leans on a^2 with slope 0.5, and is not correlated with a.
    slope = np.polyfit(found.draws[:, 0] ** 2, found.draws[:, 1], 1)[0]
    assert slope == pytest.approx(0.5, rel=0.03)


def test_what_importance_cannot_do_goes_to_ensembles_and_says_so() -> None:
    """A valley ninety times longer than wide; the ensembles end by their budget, and say that."""
    narrow = problem_of(
        lambda u: -0.5 * float(u[0] ** 2 / 4 + ((u[1] - u[0] ** 2) / 0.1) ** 2), [[1.0, 1.0]]
    )
    found = infer(
        narrow,
        "standard",
        np.random.default_rng(3),
        count=1000,
        options=InferOptions(budget=112_000),
    )
    assert found.effort_reached == "thorough"
    assert "Escalated from standard" in found.sentence
    assert found.status is SamplingStatus.BUDGET_USED_UP
    assert not found.status.trusted
    poor = infer(
        narrow,
        "standard",
        np.random.default_rng(3),
        count=1000,
        options=InferOptions(budget=20_000),
    )
    assert (poor.effort_reached, poor.status) == ("standard", SamplingStatus.HEAVY_WEIGHTS)
    assert "ensembles need at least" in poor.sentence
    calm = infer(
        narrow,
        "standard",
        np.random.default_rng(3),
        count=1000,
        options=InferOptions(escalate=False),
    )
    assert calm.evaluations < 10_000
    assert not calm.status.trusted


def test_a_funnel() -> None:
    """sd of b is sqrt(E exp(a)) = exp(2.25 / 4); its tails make it hard to estimate: 15 %."""
    found = infer(problem_of(funnel, [[0.5, 0.1, 0.1]]), "standard", np.random.default_rng(0))
    assert found.status.trusted
    assert found.draws[:, 0].mean() == pytest.approx(0.0, abs=0.2)
    assert found.draws[:, 0].std() == pytest.approx(1.5, rel=0.07)
    assert found.draws[:, 1].std() == pytest.approx(np.exp(2.25 / 4), rel=0.15)


@pytest.mark.slow
def test_a_funnel_by_ensembles() -> None:
    found = infer(
        problem_of(funnel, [[0.5, 0.1, 0.1]]), "thorough", np.random.default_rng(0), count=6000
    )
    assert found.status is SamplingStatus.CONVERGED
    assert found.draws[:, 0].std() == pytest.approx(1.5, rel=0.05)
    scaled = found.draws[:, 1] * np.exp(-found.draws[:, 0] / 2)
    assert scaled.std() == pytest.approx(1.0, rel=0.05)


@pytest.mark.parametrize("effort", ["standard", pytest.param("thorough", marks=pytest.mark.slow)])
def test_two_hills_both_get_their_share(effort: str) -> None:
    """Share 0.7: 5000 independent draws know it to 0.007, jumps between hills make that 0.03."""
    problem = problem_of(two_hills, [[3.0, 2.0], [-3.0, -5.0]])
    found = infer(problem, effort, np.random.default_rng(0), count=4000)
    assert [cluster.starts for cluster in found.optimum.optima] == [1, 1]
    assert found.optimum.optima[0].point == pytest.approx([4.0, 4.0], abs=0.01)
    assert found.optimum.optima[1].value - found.optimum.optima[0].value == pytest.approx(
        np.log(3 / 7), abs=0.01
    )
    assert "1 other" in found.optimum.sentence
    assert found.status.trusted
    assert np.mean(found.draws[:, 0] > 0) == pytest.approx(0.7, abs=0.06)


def test_starts_on_one_ridge_are_one_optimum() -> None:
    flat = problem_of(lambda u: -50.0 * float((u[0] + u[1]) ** 2), [[3.0, -3.0], [-7.0, 6.0]])
    assert len(find_optimum(flat).optima) == 1


def test_a_parameter_without_data_is_named() -> None:
    problem = problem_of(lambda u: -0.5 * float(u[0] ** 2), [[2.0, 1.0]])
    found = find_optimum(problem)
    assert found.status is SearchStatus.AT_START
    assert not found.success
    assert found.sentence.endswith("It concerns b.")
    with_prior = problem_of(
        lambda u: -0.5 * float(u[0] ** 2),
        [[2.0, 1.0]],
        log_prior=lambda u: -0.005 * float(u @ u),
    )
    drawn = infer(with_prior, "draft", np.random.default_rng(0))
    assert drawn.status is SamplingStatus.FLAT
    assert drawn.null == ("b (100%)",)
    assert drawn.draws[:, 1].std() == pytest.approx(10.0, rel=0.1)


def test_an_optimum_at_a_bound_is_named() -> None:
    found = find_optimum(
        problem_of(lambda u: float(u[0] - u[1] ** 2), [[0.0, 1.0]], upper=np.array([5.0, 200.0]))
    )
    assert found.status is SearchStatus.AT_BOUNDS
    assert found.sentence.endswith("It concerns a.")


def test_a_region_that_cannot_be_evaluated_is_no_place_for_an_optimum() -> None:
    """Beyond a = 1 the density is NaN, and it rises up to there."""

    def cliff(u: Array) -> float:
        return float(np.nan if u[0] > 1 else 5 * u[0] - u[1] ** 2)

    found = find_optimum(problem_of(cliff, [[0.0, 1.0]]))
    assert found.status is SearchStatus.NOT_FINITE
    assert not found.success
    assert found.sentence.endswith("It concerns a.")


def test_a_region_of_nan_off_the_optimum_is_only_left_out() -> None:
    """The half-plane a > 1 is NaN: draws are those of a normal cut there."""

    def cut(u: Array) -> float:
        return float(np.nan if u[0] > 1 else -0.5 * (u[0] ** 2 + u[1] ** 2))

    found = infer(problem_of(cut, [[-1.0, 1.0]]), "standard", np.random.default_rng(0), count=4000)
    assert found.status.trusted
    assert found.draws[:, 0].max() <= 1
    assert found.draws[:, 0].mean() == pytest.approx(stats.truncnorm.mean(-np.inf, 1), abs=0.06)


def test_nan_everywhere_is_an_error_of_the_input() -> None:
    with pytest.raises(NotFiniteError, match="finite at no start") as caught:
        infer(problem_of(lambda u: np.nan, [[0.0, 0.0]]), "draft", np.random.default_rng(0))
    assert isinstance(caught.value, InputError)
    assert isinstance(caught.value, ValueError)


def test_slopes_that_are_nan_beside_the_optimum_are_an_error_that_names_them() -> None:
    """The log-likelihood is finite and its residuals are not: it contradicts itself."""
    problem = problem_of(
        lambda u: -0.5 * float(u @ u),
        [[1.0, 1.0]],
        standardised=lambda u: (np.array([u[0], np.nan * u[1]]), np.zeros(2)),
    )
    with pytest.raises(NotFiniteError, match="beside its optimum"):
        infer(problem, "draft", np.random.default_rng(0))


def test_walkers_that_never_move_do_not_read_as_converged() -> None:
    """All walkers share one value of b, so no difference between them ever moves it."""
    start = Mixture(np.ones(1), np.zeros((1, 2)), np.diag([1.0, 0.0])[None])
    chains = run_ensembles(
        normal(np.eye(2)), start, np.random.default_rng(0), InferOptions(500_000)
    )
    assert chains.status is SamplingStatus.STUCK
    assert np.isnan(chains.tau[1])
    assert np.isfinite(chains.tau[0])


def test_a_posterior_that_accepts_nothing_is_stuck() -> None:
    """Finite on a lattice of the very points walkers start from, and nowhere else."""
    allowed: set[bytes] = set()

    def once(u: Array) -> float:
        if len(allowed) < 64:
            allowed.add(u.tobytes())
        return 0.0 if u.tobytes() in allowed else -np.inf

    start = Mixture(np.ones(1), np.zeros((1, 2)), np.eye(2)[None])
    chains = run_ensembles(once, start, np.random.default_rng(0), InferOptions(500_000))
    assert chains.status is SamplingStatus.STUCK
    assert chains.acceptance == 0.0


class KilledError(Exception):
    """Stands for the end of a process."""


def test_a_killed_run_goes_on_as_if_it_had_not_been(tmp_path: Path) -> None:
    problem = problem_of(normal(CORRELATED), [[1.0, 1.0, 1.0]])

    def run(checkpoint: Path | None, target: Problem = problem):
        rng = np.random.default_rng(5)
        return infer(target, "thorough", rng, options=InferOptions(35_000, checkpoint=checkpoint))

    whole = run(None)
    independent = whole.evaluations / (2.0 * whole.tau.max())
    close = 4.0 / np.sqrt(2.0 * independent)  # an sd of n draws is known to 1 / sqrt(2 n)
    assert close < 0.2
    assert whole.draws.std(axis=0) == pytest.approx([1, 1, 2], rel=close)
    calls = 0

    def dying(u: Array) -> Array:
        nonlocal calls
        calls += 1
        if calls > 20_000:
            raise KilledError
        return problem.log_likelihood_terms(u)

    path = tmp_path / "walks.npz"
    with pytest.raises(KilledError):
        run(path, problem_of(lambda u: float(dying(u)[0]), [[1.0, 1.0, 1.0]]))
    assert path.exists()
    resumed = run(path)
    np.testing.assert_array_equal(resumed.draws, whole.draws)
    np.testing.assert_array_equal(resumed.tau, whole.tau)
    assert resumed.evaluations < whole.evaluations
    again = run(path)
    np.testing.assert_array_equal(again.draws, whole.draws)
    assert list(tmp_path.iterdir()) == [path]


def test_a_checkpoint_of_another_posterior_is_refused_and_kept(tmp_path: Path) -> None:
    path = tmp_path / "not there yet" / "walks.npz"
    rng = np.random.default_rng(0)
    problem = problem_of(normal(np.eye(2)), [[1.0, 1.0]])
    infer(problem, "thorough", rng, options=InferOptions(20_000, checkpoint=path))
    before = path.read_bytes()
    for other in (
        problem_of(normal(2 * np.eye(2)), [[1.0, 1.0]]),
        problem_of(normal(CORRELATED), [[1.0, 1.0, 1.0]]),
    ):
        with pytest.raises(ValueError, match=r"walks\.npz: this checkpoint is of another"):
            infer(other, "thorough", rng, options=InferOptions(checkpoint=path))
    assert path.read_bytes() == before
    path.write_bytes(before[: len(before) // 2])
    with pytest.raises(ValueError, match=r"walks\.npz: not a readable checkpoint"):
        infer(
            problem_of(normal(np.eye(2)), [[1.0, 1.0]]),
            "thorough",
            rng,
            options=InferOptions(checkpoint=path),
        )


def test_a_checkpoint_with_a_long_header_is_refused_in_one_line(tmp_path: Path) -> None:
    path = tmp_path / "walks.npz"
    long_header = {"chain": np.zeros(1, [(f"n{k}", float) for k in range(2000)])}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # numpy names the version of so long a header
        np.savez(path, **long_header)
    problem = problem_of(normal(np.eye(2)), [[1.0, 1.0]])
    with pytest.raises(ValueError, match="not a readable checkpoint") as caught:
        infer(problem, "thorough", np.random.default_rng(0), options=InferOptions(checkpoint=path))
    assert "\n" not in str(caught.value)


def test_the_generator_alone_decides_what_is_drawn() -> None:
    problem = problem_of(normal(np.eye(2)), [[1.0, 1.0]])
    first, second, other = (
        infer(problem, "thorough", np.random.default_rng(seed), options=InferOptions(17_000))
        for seed in (7, 7, 8)
    )
    np.testing.assert_array_equal(first.draws, second.draws)
    assert not np.array_equal(first.draws, other.draws)


@pytest.mark.slow
def test_ranks_of_the_truth_are_uniform() -> None:
    """Simulation-based calibration of exp(a) + noise; a chi-square at 0.1 %, 15 in a bin."""
    ranks = []
    fits, bins = 150, 10
    rng = np.random.default_rng(11)
    for _ in range(fits):
        truth = rng.standard_normal(2)
        x = np.linspace(0, 1, 8)
        y = np.exp(truth[0] * x) + truth[1] + 0.3 * rng.standard_normal(8)

        def log_density(u: Array, x: Array = x, y: Array = y) -> float:
            residuals = (y - np.exp(u[0] * x) - u[1]) / 0.3
            return -0.5 * float(residuals @ residuals)

        problem = problem_of(
            log_density,
            [[0.0, 0.0]],
            log_prior=lambda u: -0.5 * float(u @ u),
            prior_sd=np.ones(2),
        )
        found = infer(problem, "standard", rng, count=999)
        assert found.status.trusted
        ranks.append((found.draws < truth).sum(axis=0))
    for column in np.array(ranks).T:
        counts = np.bincount(column * bins // 1000, minlength=bins)
        assert stats.chisquare(counts).pvalue > 1e-3
