"""The whole check over a law whose posterior is known: right passes, overconfident is found out."""

import pickle
from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest

from scissorcal.calibration import FitResult
from scissorcal.calibration.verify.check import StudySettings, assess, make_study, tasks_of
from scissorcal.calibration.verify.result import RankedQuantity, VerifyResult
from scissorcal.calibration.verify.study import (
    Generating,
    Study,
    Task,
    generating_prior,
    refit_prior,
    run,
)
from scissorcal.calibration.verify.verdicts import held_by_90
from scissorcal.errors import InputError, MissingError
from scissorcal.inference import ArNoise, infer

from .toy import BINS, LAYOUT, Linear, LinearSimulator, StandIn, as_fit

TRUTH = np.array([0.3, -0.5, np.log(0.8), np.log(0.3)])


def made(rho: float, naive: bool = False, change: float = 0.0) -> Linear:
    """Data with AR(1) noise of sd 0.3; the level of the later half of strokes differs by change."""
    rng = np.random.default_rng(4)
    noise = ArNoise(1, (rho,), 0.3 * np.sqrt(1 - rho**2)).draw(np.zeros(BINS, dtype=int), rng)
    plain = Linear(np.zeros(BINS))
    later = plain.strokes % 4 >= 2
    return Linear(plain.mean(TRUTH) + noise + change * later * plain.design[:, 2], naive)


def fit_of(experiment: Linear) -> FitResult:
    problem = experiment.candidate(experiment.observed).problem(experiment.series)
    return as_fit(experiment, infer(problem, "standard", np.random.default_rng(0), count=1000))


def study_of(experiment: Linear, rho: float = 0.8, seed: int = 0, fit: Any = None) -> Study:
    """A study whose simulated noise is that of :func:`made`."""
    noise = ArNoise(1, (rho,), 0.3 * np.sqrt(1 - rho**2))
    simulator = LinearSimulator(experiment, noise, float(TRUTH[3]))
    return make_study(
        experiment, fit or fit_of(experiment), simulator, settings=StudySettings(seed=seed)
    )


def checked(experiment: Linear, checks: Any, fits: int = 0) -> tuple[Study, VerifyResult]:
    fit = fit_of(experiment)
    study = pickle.loads(pickle.dumps(study_of(experiment, fit=fit)))
    records = [run(study, task) for task in tasks_of(study, checks, fits)]
    return study, assess(study, fit, checks, records)


def status(result: VerifyResult) -> dict[str, str]:
    return {verdict.check: verdict.status for verdict in result.verdicts}


def test_intervals_with_the_right_noise_pass_and_others_fail():
    """Noise of rho 0.8 makes naive intervals too narrow by 3."""
    _, right = checked(made(0.8), ("sbc",), 24)
    assert status(right) == {"calibration": "pass", "refits": "pass"}
    _, naive = checked(made(0.8, naive=True), ("sbc",), 24)
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
    assert "law or rig change between strokes" in result.verdicts[0].why


def test_a_local_prior_is_as_wide_as_stated_and_never_wider_than_the_recipes():
    rng = np.random.default_rng(1)
    experiment = Linear(np.zeros(BINS))
    sd = np.array([0.01, 0.02, 0.03, 1.999])
    draws = TRUTH + sd * rng.standard_normal((200_000, 4))
    found = generating_prior(experiment, draws, "local", 3.0)
    drawn = np.stack([found.draw(rng) for _ in range(4000)])
    assert drawn.mean(axis=0) == pytest.approx(TRUTH, abs=0.2)
    assert drawn.std(axis=0) == pytest.approx([0.03, 0.06, 0.09, 2.0], rel=0.1)
    prior = refit_prior(experiment, found)
    assert prior.names == LAYOUT.names[:3]
    assert prior.mean == pytest.approx(found.mean[:3])
    assert np.sqrt(np.diag(prior.covariance)) == pytest.approx([0.03, 0.06, 0.09], rel=0.02)
    whole = generating_prior(experiment, draws, "recipe", 3.0)
    assert whole.mean == pytest.approx(LAYOUT.mean)
    assert np.diag(whole.precision) == pytest.approx(1 / LAYOUT.sd**2)


class Refusing(LinearSimulator):
    """Refuses every other recording, and takes a law that lacks the slope for the rest."""

    def refit(self, data: Any, *given: Any) -> FitResult:
        if data[0] > 0.0:
            raise InputError("The recording holds no motion.")
        fit = super().refit(data, *given)
        kept = [p for p in fit.parameters if p.name != "slope"]
        draws = np.delete(fit.draws, 1, axis=1)
        other = {**fit.__dict__, "parameters": kept, "draws": draws, "candidate": "flat"}
        other["column"] = lambda name: draws[:, [p.name for p in kept].index(name)]
        return cast(FitResult, StandIn(**other))


def test_refused_data_count_and_other_laws_rank_common_quantities():
    experiment = made(0.0)
    plain = study_of(experiment, 0.0)
    made_of = plain.simulator
    assert isinstance(made_of, LinearSimulator)
    study = replace(
        plain,
        simulator=Refusing(experiment, made_of.ar, made_of.reference),
        generating=Generating("local", 3.0, np.array([0.0, 0.0, 0.0, -1.2]), np.eye(4)),
    )
    records = [run(study, Task("simulated", index)) for index in range(8)]
    refused = [r for r in records if "broken" in r]
    assert 0 < len(refused) < 8
    assert all(r["broken"] == "InputError: The recording holds no motion." for r in refused)
    result = assess(study, fit_of(experiment), ("sbc",), records)
    assert result.calibration is not None
    assert result.calibration.other_law == 1.0
    assert len(result.calibration.broken) == len(refused)
    assert [q.name for q in result.calibration.quantities] == ["offset", "level"]
    verdict = next(v for v in result.verdicts if v.check == "refits")
    assert verdict.status == "fail"
    assert "100.0% chose another candidate" in verdict.why


def test_a_failing_fit_is_counted_with_its_message():
    experiment = made(0.0)
    study = study_of(experiment)
    hopeless = Generating("local", 3.0, np.full(4, np.inf), np.eye(4))
    broken = replace(study, generating=hopeless)
    with np.errstate(all="ignore"):
        records = [run(broken, Task("simulated", index)) for index in range(3)]
    assert all("broken" in record for record in records)
    result = assess(study, fit_of(experiment), ("sbc",), records)
    assert status(result) == {"calibration": "not_evaluated"}
    assert "Every simulated fit failed" in result.not_done[0]


def test_equal_seeds_give_equal_fits_and_other_indices_others():
    experiment = made(0.0)
    study = study_of(experiment, seed=3)
    one, again, other = (run(study, Task("simulated", index)) for index in (5, 5, 6))
    assert one["ranks"] == again["ranks"]
    assert one["truths"] == again["truths"] != other["truths"]


def test_a_fit_without_nuisance_draws_must_be_repeated():
    experiment = made(0.0)
    fit = fit_of(experiment)
    fit.__dict__["nuisance_draws"] = None
    with pytest.raises(MissingError, match="scissorcal fit friction --force"):
        study_of(experiment, fit=fit)


def test_ranks_that_are_all_alike_hold_everything_or_nothing():
    """All truths beyond all draws: the worst fit has a width of zero, and ends in no division."""
    for shift, held in ((3.0, 0.0), (0.0, 1.0)):
        row = RankedQuantity("a", "m", (), (), 1e-9, None, 0.0, shift, ())
        assert held_by_90(row) == held
