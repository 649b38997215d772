"""The whole check over a law whose posterior is known: right passes, overconfident is found out."""

import pickle
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from scissorcal.calibration import FitResult
from scissorcal.calibration.result import StrokeError
from scissorcal.calibration.verify import Study, VerifyResult, assess, make_study, run, tasks_of
from scissorcal.calibration.verify.generating import (
    Generating,
    generating_prior,
    refit_prior,
    residual_noise,
    simulate,
)
from scissorcal.calibration.verify.study import Task
from scissorcal.errors import MissingError
from scissorcal.inference import ArNoise, infer

from .toy import BINS, LAYOUT, STROKES, Linear

TRUTH = np.array([0.3, -0.5, np.log(0.8), np.log(0.3)])


def made(rho: float, naive: bool = False, change: float = 0.0) -> Linear:
    """Data with AR(1) noise of sd 0.3; the level of the later half of strokes differs by change."""
    rng = np.random.default_rng(4)
    noise = ArNoise(1, (rho,), 0.3 * np.sqrt(1 - rho**2)).draw(np.zeros(BINS, dtype=int), rng)
    plain = Linear(np.zeros(BINS))
    later = plain.strokes % 4 >= 2
    return Linear(plain.mean(TRUTH) + noise + change * later * plain.design[:, 2], naive)


def fit_of(experiment: Linear) -> FitResult:
    """What the check reads of a fit: draws, parameters, strokes."""
    problem = experiment.rung(experiment.observed).problem(experiment.series)
    posterior = infer(problem, "standard", np.random.default_rng(0), count=1000)
    natural = LAYOUT.columns(posterior.draws)
    fitted = LAYOUT.fitted(posterior.draws)
    held_out = tuple(
        StrokeError(i, "", ("closing", "opening")[i % 2], 0.1 * (1 + i // 2), 0.1, 0.1)
        for i in range(STROKES)
    )
    facts: dict[str, Any] = {
        "what": "friction",
        "effort": "standard",
        "rung": "linear",
        "parameters": fitted[:3],
        "draws": natural[:, :3],
        "nuisance": fitted[3:],
        "nuisance_draws": natural[:, 3:],
        "held_out": held_out,
        "inputs_hash": "0" * 64,
        "effort_unit": "N m",
        "diagnostics": {"effective_samples": posterior.effective},
        "series": SimpleNamespace(
            stroke=experiment.strokes, recording=np.zeros(len(experiment.strokes), dtype=int)
        ),
        "parameter": lambda name: next(p for p in fitted if p.name == name),
    }
    return cast(FitResult, SimpleNamespace(**facts))


def checked(experiment: Linear, checks: Any, fits: int = 0) -> tuple[Study, VerifyResult]:
    fit = fit_of(experiment)
    study = make_study(experiment, fit, seed=0)
    study = pickle.loads(pickle.dumps(study))
    records = [run(study, task) for task in tasks_of(study, checks, fits)]
    return study, assess(study, fit, checks, records)


def status(result: VerifyResult) -> dict[str, str]:
    return {verdict.check: verdict.status for verdict in result.verdicts}


def test_intervals_that_allow_for_the_noise_pass_and_those_that_do_not_are_found_out():
    """Noise of rho 0.8 makes naive intervals too narrow by 3."""
    _, right = checked(made(0.8), ("sbc",), 40)
    assert status(right) == {"calibration": "pass", "refits": "pass"}
    _, naive = checked(made(0.8, naive=True), ("sbc",), 40)
    assert status(naive)["calibration"] == "fail"
    assert naive.calibration is not None
    (offset, *_) = naive.calibration.quantities
    assert offset.width > 1.5
    verdict = naive.verdicts[0]
    assert verdict.threshold == pytest.approx(0.005 / 4)
    assert "offset are too narrow by a factor of about" in verdict.why
    assert "AR(1)" in naive.calibration.noise


def test_halves_and_prior_of_a_sound_fit_pass():
    _, result = checked(made(0.0), ("halves", "prior"))
    assert status(result) == {"halves": "pass", "halves-effort": "pass", "prior": "pass"}
    assert result.halves is not None
    assert result.halves.dimensions == 4
    assert result.calibration is None


def test_a_rig_that_changes_between_strokes_fails_the_halves():
    """Later strokes have another level, and the halves' standard deviations do not know of it."""
    _, result = checked(made(0.0, naive=True, change=0.3), ("halves",))
    assert status(result)["halves"] == "fail"
    assert "changes between strokes" in result.verdicts[0].why


def test_a_local_prior_is_as_wide_as_stated_and_never_wider_than_the_recipes():
    rng = np.random.default_rng(1)
    experiment = Linear(np.zeros(BINS))
    sd = np.array([0.01, 0.02, 0.03, 1.999])
    draws = TRUTH + sd * rng.standard_normal((200_000, 4))
    found = generating_prior(experiment, draws, "local", 3.0)
    drawn = np.stack([found.draw(rng) for _ in range(4000)])
    assert drawn.mean(axis=0) == pytest.approx(TRUTH, abs=0.2)
    assert drawn.std(axis=0) == pytest.approx([0.03, 0.06, 0.09, 2.0], rel=0.1)
    mean, precision = refit_prior(experiment, found)
    assert mean == pytest.approx([*found.mean[:3], LAYOUT.mean[3]])
    refit_sd = np.sqrt(np.diag(np.linalg.inv(precision)))
    assert refit_sd == pytest.approx([0.03, 0.06, 0.09, 2.0], rel=0.02)
    whole = generating_prior(experiment, draws, "recipe", 3.0)
    assert whole.mean == pytest.approx(LAYOUT.mean)
    assert np.diag(whole.precision) == pytest.approx(1 / LAYOUT.sd**2)


def test_noise_is_taken_where_the_model_is_regular_and_grows_with_its_parameter():
    rng = np.random.default_rng(2)
    experiment = Linear(np.zeros(BINS), ripple=2.0)
    noise = ArNoise(1, (0.7,), 0.1)
    observed = simulate(experiment, noise, TRUTH, TRUTH, rng)
    found = residual_noise(Linear(observed, ripple=2.0), TRUTH, rng)
    assert found.marginal_sd == pytest.approx(noise.marginal_sd, rel=0.25)
    louder = TRUTH + np.array([0, 0, 0, np.log(4.0)])
    plain = Linear(np.zeros(BINS))
    drawn = simulate(plain, noise, TRUTH, louder, rng) - plain.mean(louder)
    assert drawn.std() == pytest.approx(4 * noise.marginal_sd, rel=0.25)


def test_a_fit_that_breaks_is_counted_with_its_sentence():
    experiment = made(0.0)
    study = make_study(experiment, fit_of(experiment), seed=0)
    hopeless = Generating("local", 3.0, np.full(4, np.inf), np.eye(4))
    broken = Study(experiment, "standard", 0, hopeless, study.noise, study.start, 600, study.split)
    with np.errstate(all="ignore"):
        records = [run(broken, Task("simulated", index)) for index in range(3)]
    assert all("broken" in record for record in records)
    result = assess(study, fit_of(experiment), ("sbc",), records)
    assert status(result) == {"calibration": "not_evaluated"}
    assert "Every simulated fit broke" in result.not_done[0]


def test_equal_seeds_give_equal_fits_and_other_indices_others():
    experiment = made(0.0)
    study = make_study(experiment, fit_of(experiment), seed=3)
    one, again, other = (run(study, Task("simulated", index)) for index in (5, 5, 6))
    assert one["ranks"] == again["ranks"]
    assert one["truths"] == again["truths"] != other["truths"]


def test_a_fit_without_its_nuisance_draws_is_to_be_made_again():
    experiment = made(0.0)
    fit = fit_of(experiment)
    fit.__dict__["nuisance_draws"] = None
    with pytest.raises(MissingError, match="scissorcal fit friction --force"):
        make_study(experiment, fit, seed=0)
