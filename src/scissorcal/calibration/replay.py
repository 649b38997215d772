"""Record-and-replay, what haptic scissors did before there were models: the thing to beat."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array, Integers
from scissorcal.calibration.fit_candidate import FittedCandidate
from scissorcal.calibration.result import ReplayComparison, ReplayRow
from scissorcal.calibration.signals.filtering import Bins
from scissorcal.calibration.signals.segments import by_label
from scissorcal.inference import find_optimum

KNOTS = 60
FEWEST_BINS = 20
FEWEST_STROKES = 3
ONE_WAY = 0.95
MOST_TRIED = 64
"""Strokes that are tried as the replayed one, evenly over the recording: the best of so many lies,
on average, among the best 1.5 % of all (1 / 65), and the work does not grow with their square."""
OTHER_SPEED = 0.2
"""Relative difference from which a speed is another one."""
OTHER_PLACE_M = 2e-3
"""Distance from which a contact, or a place in the material, is another one."""


@dataclass(frozen=True)
class Replay:
    """Torque of one stroke as a table over opening, both (k,), opening ascending."""

    opening: Array
    torque: Array

    def __call__(self, opening: Array) -> Array:
        """Replayed torque (n,); the table's end holds beyond it."""
        return np.interp(opening, self.opening, self.torque)

    def covers(self, opening: Array) -> NDArray[np.bool_]:
        """Where (n,) the recorded stroke has been."""
        return np.asarray((opening >= self.opening[0]) & (opening <= self.opening[-1]))


def replay_from_stroke(opening: Array, torque: Array, knots: int = KNOTS) -> Replay:
    """Make a table of one stroke, (n,) each: means over even stretches of opening.

    What Okamura, Webster, Nolin, Johnson and Jafry 2003 (The haptic scissors, ICRA,
    doi:10.1109/ROBOT.2003.1241697) rendered: the recorded torque at the recorded angle.

    >>> replay = replay_from_stroke(np.linspace(0.8, 0.2, 600), np.linspace(0.0, 0.6, 600), 6)
    >>> replay.opening.round(2).tolist()
    [0.25, 0.35, 0.45, 0.55, 0.65, 0.75]
    >>> replay(np.array([0.5])).round(2).tolist()
    [0.3]
    """
    low, high = float(opening.min()), float(opening.max())
    place = np.clip(((opening - low) / (high - low) * knots).astype(int), 0, knots - 1)
    count = np.bincount(place, minlength=knots)
    held = count > 0
    sums = [np.bincount(place, values, knots)[held] for values in (opening, torque)]
    return Replay(sums[0] / count[held], sums[1] / count[held])


def compare_with_replay(
    chosen: FittedCandidate,
    bins: Bins,
    measured: Array,
    contact: Array,
    sources: tuple[str, ...],
    *,
    refit: bool,
) -> ReplayComparison | None:
    """Hold a fitted law against the replay of one closing stroke, on the others.

    The replay gets the best stroke that it could have: the one that predicts the others best. The
    law's error on a stroke is of a fit without it and its fold; with ``refit`` also of the same
    law fitted to nothing but the replayed stroke (and its prior), which is the fair contest.
    ``measured`` and ``contact`` (n,) are the effort that was fitted and where the material is
    met, NaN where nothing is; ``sources`` name the recordings. None where fewer than three strokes
    close.
    """
    places = by_label(chosen.strokes)
    strokes = [label for label, here in places.items() if label >= 0 and _closes(bins.rate[here])]
    if len(strokes) < FEWEST_STROKES:
        return None
    closing = [places[label] for label in strokes]
    count = min(len(closing), MOST_TRIED)
    tried = [k * len(closing) // count for k in range(count)]
    replays = [replay_from_stroke(bins.opening[closing[k]], measured[closing[k]]) for k in tried]
    errors = _left_in_others(replays, tried, closing, bins.opening, measured)
    best = int(np.argmin(errors))
    base, replay = tried[best], replays[best]
    alone = _one_stroke(chosen, strokes[base]) if refit else np.full(len(measured), np.nan)
    rows = []
    for k, here in enumerate(closing):
        covered = here[replay.covers(bins.opening[here])]
        if k == base or len(covered) < FEWEST_BINS:
            continue
        rows.append(
            ReplayRow(
                stroke=strokes[k],
                recording=sources[int(bins.recording[here[0]])],
                novelty=_novelty(bins, contact, closing[base], here),
                speed=_speed(bins, here),
                covered=len(covered) / len(here),
                measured_rms=_rms(measured[covered]),
                replay_rms=_rms(measured[covered] - replay(bins.opening[covered])),
                model_rms=_rms(chosen.held_out_residuals[covered]),
                one_stroke_rms=_rms(alone[covered]),
            )
        )
    if not rows:
        return None
    here = closing[base]
    return ReplayComparison(
        stroke=strokes[base],
        recording=sources[int(bins.recording[here[0]])],
        kind="closing",
        speed=_speed(bins, here),
        opening=replay.opening,
        torque=replay.torque,
        rows=tuple(rows),
        sentence=_sentence(strokes[base], rows),
    )


def _closes(rate: Array) -> bool:
    """Whether a stroke does nothing but close, and is long enough for a table."""
    return len(rate) >= FEWEST_BINS and bool(np.mean(rate < 0) > ONE_WAY)


def _left_in_others(
    replays: list[Replay],
    own: Sequence[int],
    strokes: list[Integers],
    opening: Array,
    measured: Array,
) -> list[float]:
    """Sum of squares that each replay leaves in all strokes but its ``own``, held beyond its ends.

    What is not known of the others, NaN, counts for nothing; a replay of which nothing is known
    leaves infinitely much.
    """
    places = np.concatenate(strokes)
    opening, measured = opening[places], measured[places]
    ends = np.cumsum([0, *(len(here) for here in strokes)])
    sums = []
    for replay, k in zip(replays, own, strict=True):
        squares = (measured - replay(opening)) ** 2
        squares[ends[k] : ends[k + 1]] = 0.0
        known = bool(np.any(np.isfinite(replay.torque)))
        sums.append(float(np.nansum(squares)) if known else np.inf)
    return sums


def _one_stroke(chosen: FittedCandidate, label: int) -> Array:
    """Residuals (n,) of the law fitted to one stroke alone."""
    problem = chosen.candidate.problem(chosen.series, chosen.strokes == label)
    optimum = find_optimum(problem, chosen.optimum.point[None, :])
    return chosen.candidate.likelihood.residuals(optimum.point)


def _novelty(bins: Bins, contact: Array, base: NDArray[np.intp], here: NDArray[np.intp]) -> str:
    """In what a stroke differs from the replayed one."""
    speeds = _speed(bins, base), _speed(bins, here)
    differences = ["speed"] if abs(speeds[1] / speeds[0] - 1.0) > OTHER_SPEED else []
    met = contact[base[0]], contact[here[0]]
    if abs(met[1] - met[0]) > OTHER_PLACE_M:
        differences.append("contact")
    moved = abs(float(np.median(bins.advance[here]) - np.median(bins.advance[base])))
    if moved > OTHER_PLACE_M or bins.sheet[here[0]] != bins.sheet[base[0]]:
        differences.append("place")
    return " + ".join(differences) or "none"


def _speed(bins: Bins, here: NDArray[np.intp]) -> float:
    return float(np.median(np.abs(bins.rate[here])))


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _sentence(base: int, rows: list[ReplayRow]) -> str:
    size = _rms(np.array([row.measured_rms for row in rows]))
    replayed = _rms(np.array([row.replay_rms for row in rows])) / size
    model = _rms(np.array([row.model_rms for row in rows])) / size
    better = sum(row.model_rms < row.replay_rms for row in rows)
    text = (
        f"Stroke {base}, replayed, is off by {replayed:.1%} of the effort (rms) on {len(rows)} "
        f"strokes that it is not; the law is off by {model:.1%} on strokes it had not seen, and "
        f"better on {better} of them."
    )
    alone = np.array([row.one_stroke_rms for row in rows])
    if np.all(np.isfinite(alone)):
        text += f" Fitted to that one stroke alone, the law is off by {_rms(alone) / size:.1%}."
    return text
