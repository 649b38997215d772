"""What a law leaves of whole strokes, and by how much a term of the library would explain it.

All is worked out from products of columns by piece of a stroke: the law's slopes, so that what the
law could imitate by other values of its parameters counts for nothing; the terms; the residual.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array, Integers
from scissorcal.calibration.fit_candidate import FittedCandidate, split_strokes
from scissorcal.calibration.signals.filtering import Bins
from scissorcal.calibration.signals.segments import by_label
from scissorcal.inference import gradient, ljung_box
from scissorcal.model.course_terms import Course
from scissorcal.model.terms import Term

KNOWN_TO_LAW = 1e-3
"""Share of a term's variance that law and simpler terms cannot imitate, below which it is none."""
WITHIN_ROUNDING = 1e-9
DRAWS = 1000
NINETY_FIVE = 1.645
"""Standard deviations below and above which 5 % of a normal lie each."""
HOLDS_95 = 2.0
"""An error of this many rms holds 95 % of the motion."""
PARTS = 4
"""Parts of a piece. Waves swing within them, so that an error of a whole stroke cannot make one."""
TOGETHER = 8192
"""Bins whose columns are in memory together at least: they stay in the processor's cache."""
MOST_STROKES = 128
"""Strokes that count singly. Student's t at a chance of one in a thousand is 3.37 with 127 degrees
of freedom and 3.29 with any number: more would hardly let a term stand out better."""
SAME_RUN = 0.1
"""Share of the range by which an opening may jump within one motion without a reversal."""


@dataclass(frozen=True)
class Leftover:
    """Products (parts, m, m) of the columns: the law's slopes, the terms, the residual.

    A part is a quarter of a piece, and a piece is a stroke, or a stretch of a long one. Columns are
    in unit rms but the residual; ``combined`` gives their sum (n,) with factors (m,). ``scale``
    (terms,) is what the terms were divided by, ``law`` counts the law's slopes, ``bins`` (parts,)
    are the bins of each part, ``stroke`` and ``piece`` (parts,) the numbers of its stroke and
    piece.
    ``share`` is the share of bins that are independent once all terms together have explained what
    they can: what is missing from a law is correlated too, and must not pass for noise.
    """

    gram: Array
    combined: Callable[[Array], Array]
    terms: tuple[Term, ...]
    scale: Array
    law: int
    bins: Array
    stroke: Integers
    piece: Integers
    share: float

    def free(self, within: Sequence[int] = ()) -> Array:
        """Columns (m, terms + 1) of terms and residual, the law and terms ``within`` taken out."""
        taken = [*range(self.law), *(self.law + i for i in within)]
        gram = self.gram.sum(axis=0)
        found = np.eye(len(gram))[:, self.law :]
        if taken:
            inner = np.linalg.pinv(gram[np.ix_(taken, taken)], rcond=1e-10, hermitian=True)
            found[taken] -= inner @ gram[taken, self.law :]
        return found

    @property
    def findings(self) -> dict[str, list[int]]:
        """Terms by what is found with them: the phases of a wave together, else each by itself."""
        found: dict[str, list[int]] = {}
        for index, term in enumerate(self.terms):
            found.setdefault(term.part or term.name, []).append(index)
        return found

    def chances(self, within: Sequence[int] = ()) -> dict[str, float]:
        """Chance that, without structure, any finding goes along with the residual as one does.

        Of two chances the larger: by noise with memory, and by how far pieces (of waves: parts)
        differ from each other, weighted by what they tell: a t or Hotelling's T^2 whose variance is
        free of bias and whose degrees of freedom count pieces that tell much (Bell and McCaffrey
        2002, Survey Methodology 28, 169). All findings together are as likely as their number times
        one of them. The law and the terms ``within`` are taken out.
        """
        free = self.free(within)
        scores = self._scores(free)
        squares = free[:, :-1].T @ self.gram
        own = set(np.flatnonzero(self._own(free)).tolist()) - set(within)
        variance = self._variance()
        found = {}
        for name, indices in self.findings.items():
            used = [i for i in indices if i in own]
            if used:
                along, unit = scores[:, used], squares[:, used] @ free[:, used]
                unit = unit.reshape(len(along), -1)
                if len(indices) == 1:
                    along, unit = _summed(along, self.piece), _summed(unit, self.piece)
                found[name] = _chance(along, unit.reshape(-1, len(used), len(used)), variance)
        return {name: min(1.0, len(found) * chance) for name, chance in found.items()}

    def weighed(self, weights: Array) -> tuple[Array, Array]:
        """Few rows with the products of all pieces, each counted as often as ``weights`` says.

        Terms (m, terms) and residual (m,), the law taken out.
        """
        values, vectors = np.linalg.eigh(np.tensordot(weights, self.gram, axes=1))
        rows = np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T
        basis, singular, _ = np.linalg.svd(rows[:, : self.law], full_matrices=False)
        basis = basis[:, singular > 1e-6 * singular.max(initial=0.0)]
        rest = rows[:, self.law :]
        rest = rest - basis @ (basis.T @ rest)
        return rest[:, :-1], rest[:, -1]

    def held_out(self, within: Sequence[int], more: Sequence[int]) -> tuple[float, Array]:
        """What terms gain on unseen strokes: share of the rms, and nats by stroke (strokes,)."""
        before = [*range(self.law), *(self.law + i for i in within)]
        errors = np.zeros((2, len(self.gram)))
        for fold in split_strokes(np.unique(self.stroke)):
            unseen = np.isin(self.stroke, fold)
            gram = self.gram[~unseen].sum(axis=0)
            for row, columns in enumerate((before, [*before, *(self.law + i for i in more)])):
                solution = solve(gram, columns)
                errors[row, unseen] = _squares(self.gram[unseen], columns, solution)
        variance = errors[0].sum() / self.bins.sum()
        nats = 0.5 * self.share * (errors[0] - errors[1]) / variance
        gain = 1.0 - float(np.sqrt(errors[1].sum() / errors[0].sum()))
        return gain, np.bincount(self.stroke, nats).astype(np.float64)

    def refitted(self, terms: Sequence[int]) -> tuple[Array, Array]:
        """Coefficients (k,) of terms beside the law, and their covariance (k, k).

        Errors may depend on each other within a stroke (Liang and Zeger 1986,
        doi:10.1093/biomet/73.1.13).
        """
        columns = [*range(self.law), *(self.law + i for i in terms)]
        gram = self.gram.sum(axis=0)
        solution = solve(gram, columns)
        inverse = np.linalg.pinv(gram[np.ix_(columns, columns)], rcond=1e-12, hermitian=True)
        left = np.zeros(gram.shape[0])
        left[columns], left[-1] = -solution, 1.0
        by_part = self.gram[:, columns] @ left
        scores = _summed(by_part, self.stroke)
        few = len(scores) / (len(scores) - 1.0)
        covariance = few * inverse @ scores.T @ scores @ inverse
        return solution[self.law :], covariance[self.law :, self.law :]

    def torque(self, terms: Sequence[int], coefficients: Array) -> Array:
        """What terms add beyond the law, (n,)."""
        return self.combined(self.free()[:, list(terms)] @ coefficients)

    def sizes(self, terms: Sequence[int], coefficients: Array) -> Array:
        """Size (k,) of what terms add beyond the law by ``coefficients`` (k, terms)."""
        free = self.free()[:, list(terms)]
        inner = free.T @ self.gram.sum(axis=0) @ free / self.bins.sum()
        squares = np.einsum("ki,ij,kj->k", coefficients, inner, coefficients)
        return np.asarray(HOLDS_95 * np.sqrt(np.maximum(squares, 0.0)))

    def hidden(self) -> float:
        """Size that the structure of any one term may have, at 95 %."""
        free = self.free()
        total = self.gram.sum(axis=0)
        size = np.einsum("ij,il,lj->j", free[:, :-1], total, free[:, :-1])
        used = self._own(free)
        by_stroke = _summed(self._scores(free)[:, used], self.stroke)
        along = np.abs(by_stroke.sum(axis=0)) + NINETY_FIVE * np.sqrt(np.sum(by_stroke**2, axis=0))
        largest = np.max(along / np.sqrt(size[used]), initial=0.0)
        return HOLDS_95 * float(largest) / float(np.sqrt(self.bins.sum()))

    def twins(self, likeness: float) -> dict[str, set[str]]:
        """For each finding those whose terms, with the law taken out, correlate by ``likeness``."""
        design, _ = self.weighed(np.ones(len(self.bins)))
        unit = design / np.sqrt(np.sum(design**2, axis=0))
        alike = np.abs(unit.T @ unit) > likeness
        found = self.findings
        return {
            name: {other for other, theirs in found.items() if np.any(alike[np.ix_(own, theirs)])}
            for name, own in found.items()
        }

    def _variance(self) -> float:
        """Variance of the noise of a bin, over the share of bins that are independent."""
        gram = self.gram.sum(axis=0)
        columns = range(len(gram) - 1)
        left = _squares(self.gram, columns, solve(gram, columns)).sum()
        return float(left / self.bins.sum() / self.share)

    def _scores(self, free: Array) -> Array:
        """How terms go along with the residual (parts, terms), as :meth:`free` has both."""
        return np.asarray((self.gram @ free[:, -1]) @ free[:, :-1])

    def _own(self, free: Array) -> NDArray[np.bool_]:
        """Terms of which something is left after what was taken out."""
        left = np.einsum("ij,il,lj->j", free[:, :-1], self.gram.sum(axis=0), free[:, :-1])
        return np.asarray(left > KNOWN_TO_LAW * self.bins.sum())


def tabulate(
    chosen: FittedCandidate,
    course: Course,
    terms: Sequence[Term],
    known: Sequence[Term],
) -> Leftover:
    """Reduce all bins to products by piece, without terms that law and simpler terms have.

    What is ``known`` by other means counts as the law's. Strokes longer than most are several
    pieces, lest all excited motion be one. Of more than ``MOST_STROKES`` neighbours count as one,
    by adding the products of the first part of each, of the second, and so on.
    """
    point = chosen.optimum.point
    residuals = chosen.candidate.likelihood.residuals
    slopes = -gradient(residuals, point, 1e-3 * chosen.candidate.layout.sd)
    law, left = slopes[:, np.any(slopes != 0, axis=0)], residuals(point)
    own = law.shape[1] + len(known)

    def rows(here: Integers) -> Array:
        there = _at(course, here)
        columns = [term.column(there) for term in (*known, *terms)]
        return np.column_stack([law[here], *columns, left[here]])

    strokes = list(by_label(chosen.strokes).values())
    groups = min(len(strokes), MOST_STROKES)
    usual = float(np.median([len(here) for here in strokes]))
    counts = [max(1, round(len(here) / usual)) for here in strokes]
    split = [np.array_split(here, PARTS * n) for here, n in zip(strokes, counts, strict=True)]
    parts = [part for stroke in split for part in stroke]
    rows_of = [
        (k * groups // len(strokes), at)
        for k, stroke in enumerate(split)
        for at in range(len(stroke))
    ]
    places = {row: place for place, row in enumerate(sorted(set(rows_of)))}
    blocks = _blocks(parts)
    corner = rows(parts[0][:0])
    for block in blocks:
        every = rows(np.concatenate(block))
        corner = np.asarray(np.linalg.qr(np.vstack([corner, every]), mode="r"))
    lacking = max(corner.shape[1] - len(corner), 0)
    corner = np.pad(corner, ((0, lacking), (0, 0)))  # fewer bins than columns: the rest is 0
    size = np.sqrt(np.sum(corner**2, axis=0) / len(left))
    size[-1] = 1.0
    unit = corner / np.where(size > 0.0, size, 1.0)
    new = np.abs(np.diag(unit))[own:-1] ** 2 > KNOWN_TO_LAW * len(left)
    used = np.flatnonzero([*np.ones(own, dtype=bool), *new, True])
    solution = np.linalg.lstsq(unit[:, used[:-1]], unit[:, -1], rcond=1e-8)[0]
    least, gram = np.zeros(len(left)), np.zeros((len(places), len(used), len(used)))
    into = [places[row] for row in rows_of]
    found = (
        pair for block in blocks for pair in zip(block, _parted(rows, block, used), strict=True)
    )
    for place, (part, every) in zip(into, found, strict=True):
        every = every / size[used]
        gram[place] += every.T @ every
        least[part] = every[:, -1] - every[:, :-1] @ solution

    def combined(factors: Array) -> Array:
        found = np.zeros(len(left))
        for block in blocks:
            here = np.concatenate(block)
            found[here] = rows(here)[:, used] @ (factors / size[used])
        return found

    return Leftover(
        gram=gram,
        combined=combined,
        terms=tuple(term for term, is_new in zip(terms, new, strict=True) if is_new),
        scale=size[own:-1][new],
        law=own,
        bins=np.bincount(into, [len(part) for part in parts]).astype(np.float64),
        stroke=np.array([stroke for stroke, _ in places]),
        piece=np.repeat(np.arange(len(places) // PARTS), PARTS),
        share=ljung_box(least, chosen.series).share,
    )


def _blocks(parts: list[Integers]) -> list[list[Integers]]:
    """Parts one after the other, as many together as have ``TOGETHER`` bins."""
    blocks: list[list[Integers]] = [[]]
    count = 0
    for part in parts:
        if count >= TOGETHER:
            blocks.append([])
            count = 0
        blocks[-1].append(part)
        count += len(part)
    return blocks


def _parted(
    rows: Callable[[Integers], Array], block: list[Integers], used: Integers
) -> list[Array]:
    """The columns ``used`` of each part of a block."""
    columns = rows(np.concatenate(block))[:, used]
    return np.split(columns, np.cumsum([len(part) for part in block])[:-1])


def _at(course: Course, here: Integers) -> Course:
    """A course at some of its bins."""
    values = {f.name: getattr(course, f.name) for f in fields(course)}
    changed = {name: a[here] for name, a in values.items() if isinstance(a, np.ndarray)}
    return replace(course, **changed)


def course_of(bins: Bins, load: Array | None) -> Course:
    """The whole course of motion that bins show; ``load`` (n,) is what the joint bore, if known.

    A reversal is where the direction changes, the recording, or the place by a jump.
    """
    opening, speed = bins.opening, np.maximum(np.abs(bins.rate), bins.slowest_rate)
    low, span = float(opening.min()), max(float(np.ptp(opening)), 1e-300)
    starts = np.ones(len(opening), dtype=bool)
    starts[1:] = np.sign(bins.rate[1:]) != np.sign(bins.rate[:-1])
    starts[1:] |= bins.recording[1:] != bins.recording[:-1]
    starts[1:] |= np.abs(np.diff(opening)) > SAME_RUN * span
    run = np.cumsum(starts) - 1
    middle = np.zeros(len(opening))
    for one in np.unique(bins.recording):
        here = bins.recording == one
        middle[here] = 0.5 * (bins.time_s[here].min() + bins.time_s[here].max())
    pace = np.log(speed / speed.min())
    return Course(
        opening,
        bins.rate,
        bins.acceleration,
        load,
        time=bins.time_s - middle,
        phase=2.0 * np.pi * (opening - low) / span,
        turn=2.0 * np.pi / span,
        way=np.abs(opening - opening[starts][run]) / span,
        pace=pace / max(float(pace.max()), 1e-300),
    )


def _chance(scores: Array, unit: Array, variance: float) -> float:
    """Chance of what pieces say of terms together: ``scores`` (k, q), and ``unit`` (k, q, q).

    The latter are the scores that a coefficient of one would give.
    """
    from scipy.special import chdtrc, fdtrc

    total, summed = unit.sum(axis=0), scores.sum(axis=0)
    count = len(total)
    inverse = np.linalg.pinv(total, hermitian=True)
    by_noise = float(chdtrc(count, summed @ inverse @ summed / variance))
    weight = np.einsum("kij,ji->k", unit, inverse) / count
    apart = scores - unit @ (inverse @ summed)
    apart /= np.sqrt(np.maximum(1.0 - weight, WITHIN_ROUNDING))[:, None]
    squared = float(summed @ np.linalg.pinv(apart.T @ apart, hermitian=True) @ summed)
    freedom = 1.0 / float(np.sum(weight**2)) - count
    if freedom <= 0.0:
        return 1.0
    by_pieces = fdtrc(count, freedom, squared * freedom / (count * (freedom + count - 1.0)))
    return max(by_noise, float(by_pieces))


def _summed(values: Array, labels: Integers) -> Array:
    """Sums (labels, k) of rows (n, k) over labels, which are in order."""
    starts = np.flatnonzero(np.diff(labels, prepend=labels[0] - 1))
    return np.asarray(np.add.reduceat(values, starts, axis=0))


def solve(gram: Array, columns: Sequence[int]) -> Array:
    """Least-squares coefficients (columns,) of the residual, from products."""
    chosen = np.asarray(columns)
    normal, slope = gram[np.ix_(chosen, chosen)], gram[chosen, -1]
    return np.asarray(np.linalg.lstsq(normal, slope, rcond=1e-12)[0])


def _squares(gram: Array, columns: Sequence[int], coefficients: Array) -> Array:
    """Sum of squares (pieces,) that a solution leaves in each piece."""
    across = np.zeros(gram.shape[-1])
    across[list(columns)] = -coefficients
    across[-1] = 1.0
    return np.asarray(np.einsum("i,sij,j->s", across, gram, across))
