"""Compare fitted candidates on hold-out strokes, in rows and in words, and say what to measure."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.candidates import (
    POSITIVE_EVIDENCE,
    RELIABLE,
    RELIABLE_UNITS,
    Account,
    CandidateRow,
    compare,
    comparison_sentence,
    standard_error,
)
from scissorcal.calibration.fit_candidate import FittedCandidate
from scissorcal.calibration.signals.filtering import Bins
from scissorcal.recording.recording import Joint

PLACES = 5
"""Stretches of speed, and of contact or opening, among which the place of most difference lies."""
FEWEST_BINS = 10

MOST_MORE = 20
"""Times the recorded motion beyond which nobody records more to distinguish two candidates."""


def choose(
    fitted: Sequence[FittedCandidate], signal_rms: float = 0.0, negligible: float = 0.0
) -> FittedCandidate:
    """Take the simplest candidate that is not distinguishable from the best.

    ``fitted`` stands simplest first. Hold-out strokes are judged twice (see
    :func:`~.candidates.compare`): by fits without them, and by the posterior without them (PSIS-LOO
    over whole strokes, as far as its k-hats are good). Where an error of the law is stated, as the
    share ``negligible`` of ``signal_rms``, candidates whose error is larger by less than that are
    equivalent too; what a person would not feel is decided where a model is rendered. The result
    has ``equivalent`` filled in.
    """
    rows = _rows(fitted, signal_rms, negligible)
    (index,) = (index for index, row in enumerate(rows) if row.chosen)
    return replace(fitted[index], equivalent=tuple(row.name for row in rows if row.equivalent))


def best_of(fitted: Sequence[FittedCandidate]) -> FittedCandidate:
    """The candidate with the highest log density of unseen strokes.

    Its share of independent bins is the one by which all candidates are compared.
    """
    return max(fitted, key=lambda candidate: float(candidate.scores.sum()))


def contenders(fitted: Sequence[FittedCandidate]) -> list[FittedCandidate]:
    """The candidates that come near the best (:func:`_is_near`), the best among them.

    PSIS-LOO could speak for these alone.
    """
    best = best_of(fitted)
    most = len(best.optimum.point)
    behind = [float((best.scores - candidate.scores).sum()) * best.share for candidate in fitted]
    return [
        candidate
        for candidate, nats in zip(fitted, behind, strict=True)
        if candidate is best or _is_near(nats, len(candidate.optimum.point), most)
    ]


def names_of_contenders(rows: Sequence[Mapping[str, Any]]) -> tuple[str, ...]:
    """Names of the candidates that come near the best, from a fit's rows (:func:`candidate_rows`).

    Those that are equivalent are among them.
    """
    best = min(rows, key=lambda row: float(row["behind"]))
    return tuple(
        str(row["name"])
        for row in rows
        if row["equivalent"]
        or _is_near(float(row["behind"]), int(row["parameters"]), int(best["parameters"]))
    )


def _is_near(behind: float, parameters: int, of_best: int) -> bool:
    """Whether another estimate of hold-out densities could reverse that of fits without strokes.

    The log density of unseen strokes lies about a nat a parameter below that of strokes that were
    fitted (Akaike 1974, doi:10.1109/TAC.1974.1100705), and estimates of it lie within as much of
    it: a candidate that is farther behind than the parameters of both is rejected by either.
    """
    return behind < POSITIVE_EVIDENCE + parameters + of_best


def _rows(
    fitted: Sequence[FittedCandidate], signal_rms: float, negligible: float = 0.0
) -> tuple[CandidateRow, ...]:
    best = best_of(fitted)
    accounts = [Account(np.stack([candidate.scores for candidate in fitted]) * best.share)]
    if len(fitted) > 1:
        near = [id(candidate) for candidate in contenders(fitted)]
        scores = np.full_like(accounts[0].scores, np.nan)
        reliable = np.zeros(scores.shape, dtype=bool)
        for index, candidate in enumerate(fitted):
            if id(candidate) in near:
                scores[index] = candidate.left_out.scores * best.share
                reliable[index] = candidate.left_out.reliable
        accounts.append(Account(scores, reliable))
    limit = (negligible * signal_rms) ** 2
    return compare(
        [candidate.name for candidate in fitted],
        [len(candidate.optimum.point) for candidate in fitted],
        accounts,
        [
            limit > 0 and candidate.held_out_rms**2 - best.held_out_rms**2 <= limit
            for candidate in fitted
        ],
    )


def candidate_rows(
    fitted: Sequence[FittedCandidate], chosen: FittedCandidate
) -> tuple[dict[str, Any], ...]:
    """Rows for the report and the file, simplest first.

    Those of :class:`~.candidates.CandidateRow`, and bic, held_out_rms, held_out_score, loo, loo_se,
    loo_k_hat. ``bic``, ``held_out_score`` and ``loo`` count only as many observations as are
    independent, the same share for every candidate. ``loo`` is the log density of all strokes, each
    by the posterior without it, ``loo_se`` its standard error over strokes, ``loo_k_hat`` the worst
    stroke's tail index. They are NaN for a single candidate, as there is nothing to compare, and
    for those that are no :func:`contenders`. ``key`` and ``values`` (by name, at the best point)
    are what a candidate's law is drawn from.
    """
    share = best_of(fitted).share
    near = [id(candidate) for candidate in contenders(fitted)] if len(fitted) > 1 else []
    rows = []
    for row, candidate in zip(_rows(fitted, 0.0), fitted, strict=True):
        used = candidate.name == chosen.name
        row = replace(row, chosen=used, equivalent=used or candidate.name in chosen.equivalent)
        count = float(np.log(candidate.observations * share))
        natural = candidate.candidate.layout.natural(candidate.optimum.point)
        rows.append(
            {
                **asdict(row),
                "bic": -2 * candidate.log_likelihood * share + row.parameters * count,
                "held_out_rms": candidate.held_out_rms,
                "held_out_score": row.score,
                **_loo(candidate, share if id(candidate) in near else float("nan")),
                "key": dict(candidate.candidate.key),
                "values": {name: float(value) for name, value in natural.items()},
            }
        )
    return tuple(rows)


def _loo(candidate: FittedCandidate, share: float) -> dict[str, float]:
    if not np.isfinite(share):
        return {"loo": share, "loo_se": share, "loo_k_hat": share}
    left_out = candidate.left_out
    return {
        "loo": float(left_out.scores.sum()) * share,
        "loo_se": standard_error(left_out.scores * share),
        "loo_k_hat": float(left_out.k_hats.max()),
    }


def comparison_text(
    fitted: Sequence[FittedCandidate],
    chosen: FittedCandidate,
    bins: Bins,
    contact: Array,
    joint: Joint,
) -> str:
    """Say which candidates are equivalent, which is used, and what would distinguish them.

    ``contact`` (n,) is where the material is met, NaN for empty motion. The place named is where,
    within the recorded motion, the predictions of the candidate used and of any equivalent one lie
    furthest apart, and the time (the number of segments, where those are of the path and not of
    time) is what it would take there for 3 nats.
    """
    if len(fitted) == 1:
        return f"{chosen.name} was compared with no other candidate."
    rows = [
        replace(row, chosen=row.name == chosen.name, equivalent=row.name in chosen.equivalent)
        for row in _rows(fitted, 0.0)
    ]
    text = comparison_sentence(rows, "strokes")
    doubt = _unreliable(fitted)
    others = [
        candidate
        for candidate in fitted
        if candidate.name in chosen.equivalent and candidate.name != chosen.name
    ]
    if not others:
        return text + doubt
    place = max((_apart(chosen, other, bins, contact) for other in others), key=lambda p: p.nats)
    return f"{text} {_advice(place, chosen, bins, joint)}{doubt}"


@dataclass(frozen=True)
class _Place:
    """Where two candidates differ: ranges of speed and place, and nats that one bin there is worth.

    ``difference`` is the rms of their difference there, in the unit of the effort.
    """

    other: str
    speed: tuple[float, float]
    place: tuple[float, float]
    by_contact: bool
    difference: float
    nats: float


def _apart(chosen: FittedCandidate, other: FittedCandidate, bins: Bins, contact: Array) -> _Place:
    residuals = [c.candidate.likelihood.residuals(c.optimum.point) for c in (chosen, other)]
    difference = residuals[0] - residuals[1]
    variance = float(np.mean(residuals[0] ** 2))
    speed = np.abs(bins.rate)
    by_contact = bool(np.any(np.isfinite(contact)))
    place = contact if by_contact else bins.opening
    known = np.isfinite(place)
    speeds, places = (_ranges(values[known]) for values in (speed, place))
    best = _Place(other.name, (0.0, 0.0), (0.0, 0.0), by_contact, 0.0, 0.0)
    for low, high in pairwise(speeds):
        for near, far in pairwise(places):
            here = known & (speed >= low) & (speed <= high) & (place >= near) & (place <= far)
            if np.count_nonzero(here) < FEWEST_BINS:
                continue
            squared = float(np.mean(difference[here] ** 2))
            nats = 0.5 * chosen.share * squared / variance
            if nats > best.nats:
                span, reach = (float(low), float(high)), (float(near), float(far))
                best = _Place(best.other, span, reach, by_contact, float(np.sqrt(squared)), nats)
    return best


def _ranges(values: Array) -> Array:
    return np.unique(np.quantile(values, np.linspace(0.0, 1.0, PLACES + 1)))


def _advice(place: _Place, chosen: FittedCandidate, bins: Bins, joint: Joint) -> str:
    if place.nats <= 0.0:
        return "Their predictions are the same over the recorded motion."
    unit = "m" if place.by_contact else joint.position_unit
    where = "contact" if place.by_contact else "opening"
    count = POSITIVE_EVIDENCE / place.nats
    more = f"{count * bins.bin_s:.2g} s more of motion"
    if not np.isfinite(bins.bin_s):
        more = f"{max(1, round(count))} more segments of the path"
    if count > MOST_MORE * len(bins.rate):
        return (
            f"{chosen.name} and {place.other} differ by at most {place.difference:.2g} "
            f"{joint.effort_unit} (rms): no practical amount of motion would distinguish them."
        )
    return (
        f"{chosen.name} and {place.other} differ most, by {place.difference:.2g} "
        f"{joint.effort_unit} (rms), at {place.speed[0]:.2g} to {place.speed[1]:.2g} "
        f"{joint.position_unit}/s and {where} {place.place[0]:.2g} to {place.place[1]:.2g} {unit}: "
        f"if one of them is true, about {more} there would distinguish them."
    )


def _unreliable(fitted: Sequence[FittedCandidate]) -> str:
    """Where PSIS-LOO did not count."""
    good = float(np.mean(best_of(fitted).left_out.reliable))
    if good >= RELIABLE_UNITS:
        return ""
    return (
        f" PSIS-LOO was not used: for {1 - good:.0%} of the strokes its k-hat is {RELIABLE:.2f} or "
        "more, as single strokes decide a parameter; record more strokes of each kind."
    )
