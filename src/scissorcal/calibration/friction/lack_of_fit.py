"""A stated lack of fit: by how much levels and inertia may be wrong without the data showing it."""

from dataclasses import replace

import numpy as np

from scissorcal.calibration.friction.model import FrictionExperiment
from scissorcal.inference import Posterior
from scissorcal.model.friction_terms import NUISANCE, PARAMETERS, side_of
from scissorcal.model.transforms import LOG, LOGIT


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
