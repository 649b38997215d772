"""Two halves of the data, fitted separately, and the test of their difference."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array, Integers

PIECES = 4

BY_RECORDING = "whole recordings"
"""Start of the description of a split by recordings."""

SILENT = 0.02
"""Share of the variance of two independent halves below which both only repeat their prior."""

MIXTURE_DRAWS = 50_000


@dataclass(frozen=True)
class StrokeFacts:
    """A stroke's label, kind, speed, sheet, and the index of its recording."""

    label: int
    kind: str
    speed: float
    sheet: int | None = None
    recording: int = 0


@dataclass(frozen=True)
class Split:
    """Two disjoint halves of the bins (n,), and a description of the split.

    ``recordings`` are their numbers in each half where whole recordings were split, else None.
    """

    first: NDArray[np.bool_]
    second: NDArray[np.bool_]
    words: str
    recordings: tuple[int, int] | None = None


@dataclass(frozen=True)
class HalfFit:
    """The posterior of one half in unconstrained coordinates.

    ``mean`` (p,), ``covariance`` (p, p), and how many independent observations it rests on.
    """

    mean: Array
    covariance: Array
    independent: float


@dataclass(frozen=True)
class Difference:
    """Second minus first half (p,), its covariance (p, p), and the test of both.

    ``z`` (p,) is NaN where the halves repeat their prior. ``statistic`` over ``dimensions`` is
    F distributed with ``independent`` observations; ``p_value`` is NaN where no test is possible.
    """

    difference: Array
    covariance: Array
    z: Array
    statistic: float
    dimensions: int
    independent: float
    p_value: float


def split_strokes(strokes: Integers, facts: Sequence[StrokeFacts]) -> Split | None:
    """Split bins (n,), labelled by ``strokes`` (n,), into two halves of whole strokes.

    Where there are two recordings or more, whole recordings alternate: halves that share recordings
    cannot show a change between them. Else, where strokes belong to two sheets or more, whole
    sheets alternate. Otherwise strokes of a kind are ranked by speed and alternate, opening ones
    against closing ones, so that both halves see both directions and all speeds. A stroke that is
    the only one of its kind (an excitation) is cut into four pieces, the outer two for one half.
    None where there is only one stroke.
    """
    present = [fact for fact in facts if np.any(strokes == fact.label)]
    if len(present) < 2:
        return None
    sheets = sorted({fact.sheet for fact in present if fact.sheet is not None})
    recordings = sorted({fact.recording for fact in present})
    first = np.zeros(len(strokes), dtype=bool)
    if len(recordings) > 1:
        for fact in present:
            first[strokes == fact.label] = fact.recording in recordings[::2]
        counts = len(recordings[::2]), len(recordings[1::2])
        words = f"{BY_RECORDING}, {counts[0]} of {len(recordings)} in one half"
        return Split(first, ~first, words, counts)
    if len(sheets) > 1:
        taken = {sheet for index, sheet in enumerate(sheets) if index % 2 == 0}
        for fact in present:
            first[strokes == fact.label] = fact.sheet in taken
        return Split(first, ~first, f"whole sheets, {len(taken)} of {len(sheets)} in one half")
    phase = 0
    for kind in sorted({fact.kind for fact in present}):
        alike = sorted((fact for fact in present if fact.kind == kind), key=lambda f: f.speed)
        if len(alike) == 1:
            here = np.flatnonzero(strokes == alike[0].label)
            first[here] = (np.arange(len(here)) * PIECES // len(here)) % 3 == 0
            continue
        for index, fact in enumerate(alike):
            first[strokes == fact.label] = (index + phase) % 2 == 0
        phase += 1
    if not first.any() or first.all():
        return None
    return Split(first, ~first, "whole strokes of a kind, alternating by speed")


def compare(first: HalfFit, second: HalfFit, prior_precision: Array) -> Difference:
    """Compare two posteriors that share a prior but no data.

    With a common normal prior of precision P0 and posteriors of covariances A and B the difference
    of the means has the covariance A + B - A P0 B - B P0 A: the common part from the prior cancels.
    Directions in which hardly anything of A + B is left are taken out. The squared Mahalanobis
    length of the p others is compared with Hotelling's distribution for covariances that rest on
    n independent observations, T^2 (n - p + 1) / (n p) ~ F(p, n - p + 1)
    (Hotelling 1931, doi:10.1214/aoms/1177732979).
    """
    from scipy.stats import f

    A, B = first.covariance, second.covariance
    size = np.sqrt(np.diag(A + B))
    unit = np.outer(size, size)
    root = np.linalg.cholesky((A + B) / unit) * size[:, None]
    shared = A @ prior_precision @ B
    inverse = np.linalg.inv(root)
    values, vectors = np.linalg.eigh(inverse @ (A + B - shared - shared.T) @ inverse.T)
    informed = values > SILENT
    axes = root @ vectors
    covariance = (axes * np.where(informed, values, 0.0)) @ axes.T
    difference = second.mean - first.mean
    along = vectors.T @ inverse @ difference
    spread = np.sqrt(np.diag(covariance))
    z = np.where(spread**2 > SILENT * size**2, difference / np.maximum(spread, 1e-300), np.nan)
    independent, p = min(first.independent, second.independent), int(informed.sum())
    statistic, probability = float("nan"), float("nan")
    freedom = independent - p + 1
    if p and freedom > 0:
        squared = float(np.sum(along[informed] ** 2 / values[informed]))
        statistic = squared / p
        probability = float(f.sf(squared * freedom / (independent * p), p, freedom))
    return Difference(difference, covariance, z, statistic, p, float(independent), probability)


def effort_difference(
    difference: Difference, slopes: Array, rng: np.random.Generator
) -> tuple[float, float, float]:
    """Root mean square by which two halves' predictions differ, what is expected, and its p-value.

    ``slopes`` (n, p) are derivatives of the expected effort by the unconstrained parameters. The
    mean square of a normal difference is a weighted sum of chi-squares, whose weights are the
    eigenvalues of the effort's covariance; with few observations it is divided by that of the
    covariance itself. Its distribution is simulated from ``rng``.
    """
    predicted = slopes @ difference.difference
    mean_square = float(np.mean(predicted**2))
    root = _root(difference.covariance)
    weights = np.linalg.eigvalsh(root @ (slopes.T @ slopes / len(slopes)) @ root)
    weights = np.maximum(weights, 0.0)
    n = max(difference.independent, 1.0)
    drawn = rng.chisquare(1, (MIXTURE_DRAWS, len(weights))) @ weights
    drawn *= n / rng.chisquare(n, MIXTURE_DRAWS)
    above = float((np.count_nonzero(drawn >= mean_square) + 1) / (MIXTURE_DRAWS + 1))
    return float(np.sqrt(mean_square)), float(np.sqrt(weights.sum())), above


def _root(covariance: Array) -> Array:
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray((vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T)
