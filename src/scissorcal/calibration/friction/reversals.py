"""Whether build-up of friction after reversals can be seen at all, before a law with it is fitted.

Searching its length takes longer than all other laws together (its columns are made anew at every
length), and sweeps that leave turns out seldom show it.
"""

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.fit_candidate import FittedCandidate
from scissorcal.calibration.friction.model import FrictionExperiment
from scissorcal.calibration.friction.search import scan_nodes
from scissorcal.inference.curvature import gradient

Array = NDArray[np.float64]

BUILD_UP = " + presliding"
"""What the name of a law with build-up has more than the same law without."""


def gain_of_build_up(plain: FittedCandidate, rich: FrictionExperiment) -> float:
    """Log density (nats) that build-up after reversals can add to a fitted law at most.

    ``rich`` is the law of ``plain`` with build-up, over the same windows. At each length of the
    scan the score test of Rao (1948, doi:10.1017/S0305004100023987) is taken for the share of dry
    friction that builds up, all parameters of the plain law being free within their priors: half
    the squared score over its variance, 0 where the share would be negative. The likelihood is
    quadratic in the share, but for the shift of the law's own levels, so that this is what the fit
    would gain on the data it is made of; unseen strokes gain less.
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
    best = 0.0
    for node in scan_nodes(middle, sd, rich.basis.lag.spacing):
        column = rich.basis.lacking(values, rich.basis.lag.scale_of(node))
        score = -weight * float(column @ left)
        shared = weight * slopes.T @ column
        variance = weight * float(column @ column) - shared @ np.linalg.solve(precision, shared)
        if score > 0.0 and variance > 0.0:
            best = max(best, 0.5 * score**2 / float(variance))
    return best
