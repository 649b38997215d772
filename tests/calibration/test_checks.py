"""Verdicts: each fails on what it is for, says what to measure next, and stops a calibration."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import chi2

from scissorcal.calibration import fit_friction
from scissorcal.calibration.checks import trust_verdicts
from scissorcal.calibration.fit_candidate import FittedCandidate, fit_candidate
from scissorcal.calibration.fit_model import Outcome
from scissorcal.calibration.result import StrokeError, worst_stroke
from scissorcal.calibration.signals.filtering import Bins
from scissorcal.cli.fit_law import text
from scissorcal.inference import Posterior, SamplingStatus, SearchStatus, infer
from scissorcal.recipe import FitFriction
from scissorcal.recording import Recording, Stroke
from scissorcal.workday import FitOutcome, StepState
from tests.calibration.test_comparison import line
from tests.calibration.truth import QUICK, Truth, friction_recording, make_recording, sweep

STROKES, BINS = 8, 50
SPEEDS = (0.1, 0.3, 0.6, 1.0)


def motion(speeds=SPEEDS, strokes=STROKES) -> Bins:
    """Closing strokes at the given speeds, in turn."""
    labels = np.repeat(np.arange(strokes), BINS)
    n = len(labels)
    rate = -np.array(speeds)[labels % len(speeds)]
    zeros = np.zeros(n)
    numbers = np.zeros(n, dtype=np.int64)
    opening = np.tile(np.linspace(0.8, 0.2, BINS), strokes)
    yes = np.ones(n, dtype=bool)
    return Bins(
        time_s=np.arange(n) * 0.005,
        opening=opening,
        rate=rate,
        acceleration=zeros,
        drive=zeros,
        advance=zeros,
        moving=yes,
        series=numbers,
        recording=numbers,
        stroke=labels,
        sheet=numbers,
        bin_s=0.005,
        rate_floor=0.0,
    )


def fitted(bins: Bins, twin: bool = False) -> tuple[FittedCandidate, Posterior]:
    """A line over opening; with ``twin`` its slope stands in the law twice."""
    rng = np.random.default_rng(1)
    x = bins.opening - bins.opening.mean()
    columns = np.column_stack([np.ones_like(x), x, *([x] if twin else [])])
    outcome = 1.0 + 3.0 * x + 0.5 * rng.standard_normal(len(x))
    found = fit_candidate(line(outcome, columns, "line", bins.stroke), bins.series, bins.stroke)
    problem = found.candidate.problem(bins.series)
    return found, infer(problem, "draft", rng, optimum=found.optimum)


def judged(
    bins: Bins,
    what="friction",
    contact=None,
    spoil=None,
    nuisance=(),
    error=0.05,
    effort="draft",
    **fit,
):
    chosen, posterior = fitted(bins, **fit)
    diagnostics = {
        "observations": len(bins.rate),
        "independent_share": 0.9,
        "largest_inflation": 1.2,
        "r_squared": 0.8,
        "residual_rms": 0.5,
        "relative_error": 0.2,
    }
    if spoil:
        posterior, diagnostics = spoil(posterior, diagnostics)
    errors = tuple(
        StrokeError(int(k), "a.mcap", "closing", 0.1, 0.1, error) for k in np.unique(bins.stroke)
    )
    met = np.full(len(bins.rate), np.nan) if contact is None else contact
    design = SimpleNamespace(what=what, nuisance=nuisance, bins=bins, contact=lambda point: met)
    outcome = Outcome(design, effort, [chosen], chosen, posterior, {})
    verdicts = trust_verdicts(outcome, diagnostics, errors)
    return {verdict.check: verdict for verdict in verdicts}


def test_a_good_fit_fails_nothing():
    found = judged(motion())
    assert {v.status for v in found.values()} == {"pass", "not_evaluated"}
    assert [name for name, v in found.items() if v.status == "not_evaluated"] == ["k-hat"]


def test_a_mixture_with_too_few_effective_draws_fails_without_a_limit_that_it_keeps():
    def few(posterior, diagnostics):
        said = "k-hat 0.60, 0.35 with an adapted mixture and 300 of 2000 effective draws"
        status = SamplingStatus.TOO_FEW
        return dataclasses.replace(posterior, k_hat=0.35, status=status, sentence=said), diagnostics

    found = judged(motion(), spoil=few, effort="standard")["k-hat"]
    assert (found.status, found.value, found.threshold) == ("fail", None, None)
    assert "300 of 2000 effective draws" in found.why


def test_parameters_that_act_alike_are_named_together():
    verdict = judged(motion(), twin=True)["null-directions"]
    assert verdict.status == "fail"
    assert "b1" in verdict.why
    assert "b2" in verdict.why
    assert "Record" in verdict.why


def test_a_number_that_is_none_is_named():
    def spoil(posterior, diagnostics):
        draws = posterior.draws.copy()
        draws[3, 1] = np.nan
        return dataclasses.replace(posterior, draws=draws), {**diagnostics, "r_squared": np.nan}

    verdict = judged(motion(), spoil=spoil)["finite"]
    assert verdict.status == "fail"
    assert "r_squared, b1" in verdict.why


@pytest.mark.parametrize("r2", [0.0, -190.0])
def test_a_law_that_explains_nothing_fails(r2):
    found = judged(motion(), spoil=lambda p, d: (p, {**d, "r_squared": r2}))
    assert found["r-squared"].status == "fail"


def test_a_search_that_did_not_settle_fails_with_its_own_words():
    def spoil(posterior, diagnostics):
        ended = dataclasses.replace(posterior.optimum, success=False, sentence="At a bound: b0.")
        return dataclasses.replace(posterior, optimum=ended), diagnostics

    verdict = judged(motion(), spoil=spoil)["optimum"]
    assert (verdict.status, verdict.why) == ("fail", "At a bound: b0.")


@pytest.mark.parametrize(
    ("status", "concerns", "outcome"),
    [
        (SearchStatus.AT_START, ("b0",), "pass"),
        (SearchStatus.PLATEAU, ("b0",), "pass"),
        (SearchStatus.AT_START, ("b0", "b1"), "fail"),
        (SearchStatus.ROUNDS_USED_UP, (), "fail"),
        (SearchStatus.NOT_FINITE, ("b0",), "fail"),
        (SearchStatus.AT_BOUNDS, ("b0",), "fail"),
    ],
)
def test_only_a_silent_nuisance_may_stay_at_its_prior(status, concerns, outcome):
    """b0 is a nuisance here, b1 the law's own."""

    def spoil(posterior, diagnostics):
        ended = dataclasses.replace(
            posterior.optimum, success=False, status=status, concerns=concerns
        )
        return dataclasses.replace(posterior, optimum=ended), diagnostics

    verdict = judged(motion(), spoil=spoil, nuisance=("b0",))["optimum"]
    assert verdict.status == outcome
    if outcome == "pass":
        assert "b0 stayed where the prior is" in verdict.why


@pytest.mark.parametrize(
    ("error", "outcome"), [(0.05, "not_evaluated"), (0.5, "fail")], ids=["predicts", "does not"]
)
def test_few_independent_bins_reject_only_what_does_not_predict(error, outcome):
    verdict = judged(
        motion(), spoil=lambda p, d: (p, {**d, "independent_share": 0.01}), error=error
    )["whiteness"]
    assert verdict.status == outcome
    assert verdict.value < verdict.threshold
    assert verdict.limit == "at least"


def test_one_stroke_only_fails():
    verdict = judged(motion(strokes=1))["strokes"]
    assert verdict.status == "fail"
    assert "record several" in verdict.why


def test_friction_at_one_speed_fails_and_a_cut_at_one_speed_is_told():
    spread = np.tile(np.linspace(0.02, 0.06, BINS), STROKES)
    assert judged(motion(speeds=(0.3,)))["strokes"].status == "fail"
    cut = judged(motion(speeds=(0.3,)), what="cut", contact=spread)["strokes"]
    assert cut.status == "not_evaluated"
    assert "speed (all near 0.3)" in cut.why
    alike = judged(motion(speeds=(0.3,)), what="cut", contact=0 * spread + 0.04)["strokes"]
    assert alike.status == "fail"
    assert "where the material is met" in alike.why
    assert judged(motion(), what="cut", contact=spread)["strokes"].status == "pass"


def steady(truth: Truth, rng: np.random.Generator) -> Recording:
    """Sweeps at a single speed, and nothing else."""
    strokes, opening = [], []
    for _ in range(6):
        for a, b, kind in ((0.85, 0.2, "closing"), (0.2, 0.85, "opening")):
            strokes.append(Stroke(len(strokes), kind, 0.3))
            opening.append(sweep(a, b, 0.3))
    return make_recording("friction", opening, [0.0] * 12, strokes, truth, rng, False)


def test_a_rejected_fit_is_not_printed_as_a_calibration(tmp_path):
    rng = np.random.default_rng(2)
    settings = FitFriction(law="coulomb+viscous", symmetry="asymmetric")
    found = fit_friction((steady(Truth(), rng),), settings, effort="draft", rng=rng)
    assert "strokes" in {verdict.check for verdict in found.rejected}
    state = StepState("fit friction", "failed", "")
    said = text(FitOutcome("friction", found, tmp_path / "friction.nc", (), False, state))
    first, second = said.splitlines()[:2]
    assert first == "friction: not a calibration:"
    assert second.startswith("  ")
    assert said.index("strokes: Strokes do not differ") < said.index("inertia")
    assert "which are not to be used" in said
    good = fit_friction(
        (friction_recording(Truth(), rng, QUICK),), settings, effort="draft", rng=rng
    )
    assert good.rejected == ()
    assert "not a calibration" not in text(FitOutcome("friction", good, tmp_path, (), False, state))


def error(relative: float, independent: float, stroke: int = 0) -> StrokeError:
    return StrokeError(stroke, "a.mcap", "closing", 0.1, relative, relative, independent)


@pytest.mark.parametrize("independent", [1.0, 2.0, 5.0, 40.0, 1000.0])
@pytest.mark.parametrize("tail", [0.05, 0.001])
def test_the_interval_of_a_strokes_error_is_that_of_chi_squared(independent, tail):
    low, high = error(0.1, independent).interval(tail)
    exact = np.sqrt(independent / chi2.isf([tail, 1.0 - tail], independent))
    assert low == pytest.approx(0.1 * exact[0], rel=0.03)
    assert high == pytest.approx(0.1 * exact[1], rel=0.1)


def test_a_fragment_is_the_worst_stroke_only_where_chance_would_not_make_it_so():
    """40 strokes of one error: 38 of 60 samples and two of 2, and one of 60 that errs half more."""
    rng = np.random.default_rng(7)
    fragments = worse = 0
    for _ in range(500):
        sizes = np.array([60] * 37 + [60] + [2] * 2)
        scale = np.where(np.arange(40) == 37, 0.06, 0.04)
        rms = scale * np.sqrt(rng.chisquare(sizes) / sizes)
        errors = [error(r, float(n), i) for i, (r, n) in enumerate(zip(rms, sizes, strict=True))]
        found = worst_stroke(errors)
        fragments += found.independent == 2.0
        worse += found.stroke == 37
    assert fragments <= 10
    assert worse >= 450
    far = [error(0.04, 60.0, 0), error(0.9, 2.0, 1)]
    assert worst_stroke(far).stroke == 1, "an error that no chance makes of 0.04"


def test_without_counts_the_largest_error_is_the_worst():
    errors = [error(share, float("nan"), i) for i, share in enumerate((0.02, 0.05, 0.03))]
    assert worst_stroke(errors).stroke == 1
    assert worst_stroke([error(float("nan"), 3.0)]) is None
