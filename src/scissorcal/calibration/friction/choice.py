"""Choose the law of friction, and widen its posterior by the lack of fit that is stated."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from scissorcal.aliases import Array, Progress
from scissorcal.calibration.candidates import POSITIVE_EVIDENCE
from scissorcal.calibration.comparison import choose
from scissorcal.calibration.fit_candidate import FittedCandidate, fit_candidate
from scissorcal.calibration.friction.model import FrictionExperiment
from scissorcal.calibration.friction.search import scan_nodes
from scissorcal.inference import Posterior, Stop, gradient, tails_of
from scissorcal.model.friction_terms import NUISANCE, PARAMETERS, parts_of, side_of
from scissorcal.model.terms import LOG, LOGIT

USUAL_LAWS = {"rotary": "stribeck+angle", "linear": "coulomb+viscous"}
"""The law that evidence takes on most days, by the kind of joint: the pivot's on 12 of 12 days of
the virtual rig (paper, cloth, presses)."""

BUILD_UP = " + presliding"
"""What the name of a law with build-up after reversals has more than the same law without."""

OUTLIERS = 4.0
"""Student-t noise of at most this many degrees of freedom, whose kurtosis is infinite, takes the
place of normal noise; milder tails are left to the widening by the scores."""


def usual_law(laws: Sequence[FrictionExperiment]) -> FrictionExperiment:
    """The law that sweeps usually support, of candidates (simplest first): what draft effort fits.

    The richest without a term that `USUAL_LAWS` lacks, the simplest where each has one. Of its
    symmetries it is the preferred one, which comes first.
    """
    usual = set(parts_of(USUAL_LAWS[laws[0].joint.kind]))
    names = [str(law.key["law"]) for law in laws]
    within = [name for name in names if usual.issuperset(parts_of(name))]
    return laws[names.index(within[-1] if within else names[0])]


def choose_law(
    laws: list[FrictionExperiment], lack_of_fit: float, stop: Stop | None, tell: Progress
) -> tuple[list[FittedCandidate], FittedCandidate, FrictionExperiment, tuple[str, ...]]:
    """Fit every candidate law and choose one.

    The fits of all laws, that of the chosen one, its design, and notes on laws that were passed
    over: those with build-up after reversals, where :func:`_gain_of_build_up` is less
    than evidence asks for. The chosen law is fitted again with a Student-t noise where its
    residuals have outliers; that fit takes the place of the first. A share ``lack_of_fit`` of the
    drive that is stated as the law's error is what makes laws differ, and residuals below it have
    no outliers.
    """
    compared: list[FittedCandidate] = []
    by_name: dict[str, FittedCandidate] = {}
    passed: dict[str, float] = {}
    all_laws, laws = laws, []
    for index, law in enumerate(all_laws):
        plain = by_name.get(law.name.replace(BUILD_UP, ""))
        if plain is not None and law.name not in by_name:
            gain = _gain_of_build_up(plain, law)
            if gain < POSITIVE_EVIDENCE:
                passed[law.name] = gain
                continue
        tell(0.6 * index / len(all_laws), f"friction: trying {law.name}")
        laws.append(law)
        compared.append(fit_candidate(law.candidate(law.observed), law.series, law.strokes, stop))
        by_name[law.name] = compared[-1]
    drive = _rms(laws[0].observed)
    chosen = choose(compared, drive, lack_of_fit)
    place = next(i for i, entry in enumerate(compared) if entry.candidate is chosen.candidate)
    law = replace(laws[place], share=chosen.candidate.share)
    likelihood, point = chosen.candidate.likelihood, chosen.optimum.point
    if _rms(likelihood.residuals(point)) < lack_of_fit * drive:
        return compared, chosen, law, _notes(passed)
    tails = tails_of(likelihood.standardised(point), chosen.share)
    if tails > OUTLIERS:
        return compared, chosen, law, _notes(passed)
    robust = replace(law, tails=tails).candidate(law.observed)
    again = fit_candidate(replace(robust, starts=point[None, :]), law.series, law.strokes)
    compared[place] = replace(again, equivalent=chosen.equivalent)
    return compared, compared[place], law, _notes(passed)


def _notes(passed: Mapping[str, float]) -> tuple[str, ...]:
    """Which laws were not fitted, and why."""
    if not passed:
        return ()
    most = max(passed.values())
    return (
        f"Not fitted: {', '.join(passed)}. Build-up of friction after reversals would add "
        f"{most:.1f} nats by a score test, and evidence asks for {POSITIVE_EVIDENCE:g}.",
    )


def _gain_of_build_up(plain: FittedCandidate, rich: FrictionExperiment) -> float:
    """Log density (nats) that build-up after reversals would add to a fitted law, by a score test.

    ``rich`` is the law of ``plain`` with build-up, over the same windows. At each length of the
    scan the score test of Rao (1948, doi:10.1017/S0305004100023987) is taken for the share of dry
    friction that builds up, all parameters of the plain law being free within their priors: half
    the squared score over its variance, with the noise at its best, 0 where the share would be
    negative. Observations count by the plain law's share of independent ones, which falls where
    something is missing from it: planted build-up of 0.6 to 30 % of friction over 0.15 rad has 6.5
    to 21 nats here where fits gained 6 to 638 on unseen strokes, and none has 1.
    """
    candidate, point = plain.candidate, plain.optimum.point
    residuals = candidate.likelihood.residuals
    left = residuals(point)
    slopes = -gradient(residuals, point, 1e-3 * candidate.layout.sd)
    weight = plain.share * np.exp(-2.0 * point[-1])
    free = np.any(slopes != 0.0, axis=0)
    slopes = slopes[:, free]
    precision = weight * slopes.T @ slopes + candidate.prior_precision[np.ix_(free, free)]
    values = candidate.layout.natural(point)
    place = rich.layout.names.index("presliding_length")
    middle, sd = rich.layout.mean[place], rich.layout.sd[place]
    best, count = 0.0, plain.share * len(left)
    for node in scan_nodes(middle, sd, rich.basis.lag.spacing):
        column = rich.basis.lacking(values, rich.basis.lag.scale_of(node))
        score = -weight * float(column @ left)
        shared = weight * slopes.T @ column
        variance = weight * float(column @ column) - shared @ np.linalg.solve(precision, shared)
        if score > 0.0 and variance > 0.0:
            explained = min(score**2 / float(variance) / count, 1.0 - 1e-12)
            best = max(best, -0.5 * count * float(np.log1p(-explained)))
    return best


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def with_lack_of_fit(
    posterior: Posterior, law: FrictionExperiment, share: float, rng: np.random.Generator
) -> Posterior:
    """The posterior with relative errors of ``share`` (sd) in its draws, independent of each other.

    They are of inertia, levels, scales and shares; the offset's is that share of the drive (rms).
    As for a cut (decision 084), what repeats in every stroke is in no residual. With a share of 0
    nothing changes, and no random number is drawn.
    """
    if share == 0.0:
        return posterior
    drive = float(np.sqrt(np.mean(law.observed**2)))
    values = law.layout.natural(posterior.optimum.point)
    size = [_size(name, float(values[name]), share, drive) for name in law.layout.names]
    noise = rng.standard_normal(posterior.draws.shape)
    return replace(posterior, draws=posterior.draws + np.array(size) * noise)


def with_encoder_error(
    posterior: Posterior, law: FrictionExperiment, rng: np.random.Generator
) -> Posterior:
    """The posterior with the error that the encoder's steps give the inertia in its draws.

    What is regressed on has errors, so the inertia is too low by their share of the acceleration's
    mean square (Fuller 1987, Measurement Error Models, section 1.1). Draws are raised by that
    share, with a standard deviation of as much: steps are white only where motion crosses several
    a tick. With a share of 0 nothing changes, and no random number is drawn.
    """
    share = law.windows.encoder_share
    if share == 0.0:
        return posterior
    draws = posterior.draws.copy()
    error = 1.0 + rng.standard_normal(len(draws))
    draws[:, law.layout.names.index("inertia")] += share * error
    return replace(posterior, draws=draws)


def _size(name: str, value: float, share: float, drive: float) -> float:
    """Standard deviation of the error of one parameter, in its unconstrained coordinate."""
    row = PARAMETERS.get(side_of(name, PARAMETERS) or "")
    if row is None or row.name in NUISANCE:
        return 0.0
    if row.transform == LOG:
        return share
    if row.transform == LOGIT:
        return share / max(value * (1.0 - value), share)
    return share * drive if row.name == "offset" else 0.0
