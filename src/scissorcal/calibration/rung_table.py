"""The rungs that were compared, as rows that reports and files read."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.candidates import Climbed, best_of

Array = NDArray[np.float64]


def rung_table(climbed: list[Climbed], chosen: Climbed) -> tuple[dict[str, Any], ...]:
    """Rows for the report, cheapest first.

    name, parameters, bic, held_out_rms, held_out_score, loo, loo_se, loo_k_hat, equivalent,
    chosen. ``bic``, ``held_out_score`` and ``loo`` count only as many observations as are
    independent, the same share for every rung. ``loo`` is the log density of all strokes, each by
    the posterior without it, ``loo_se`` its standard error over strokes, ``loo_k_hat`` the worst
    stroke's tail index; they are NaN for a single rung, as there is nothing to compare.
    ``equivalent`` rungs cannot be told from the best, ``chosen`` is used.
    ``key`` and ``values`` (by name, at the best point) are what a rung's law is drawn from.
    """
    share = best_of(climbed).share
    compared = len(climbed) > 1
    return tuple(
        {
            "name": candidate.rung.name,
            "parameters": len(candidate.optimum.point),
            "bic": -2 * candidate.log_likelihood * share
            + len(candidate.optimum.point) * float(np.log(candidate.observations * share)),
            "held_out_rms": candidate.held_out_rms,
            "held_out_score": float(candidate.scores.sum()) * share,
            **_loo(candidate, share if compared else float("nan")),
            "equivalent": candidate.rung is chosen.rung or candidate.rung.name in chosen.alike,
            "chosen": candidate.rung is chosen.rung,
            "key": dict(candidate.rung.key),
            "values": {
                name: float(value)
                for name, value in candidate.rung.layout.natural(candidate.optimum.point).items()
            },
        }
        for candidate in climbed
    )


def _loo(candidate: Climbed, share: float) -> dict[str, float]:
    if not np.isfinite(share):
        return {"loo": share, "loo_se": share, "loo_k_hat": share}
    found = candidate.left_out
    return {
        "loo": float(found.scores.sum()) * share,
        "loo_se": _standard_error(found.scores * share),
        "loo_k_hat": float(found.k_hats.max()),
    }


def _standard_error(scores: Array) -> float:
    """Of a sum over independent strokes; NaN for a single one."""
    if len(scores) < 2:
        return float("nan")
    return float(np.sqrt(len(scores) * np.var(scores, ddof=1)))
