"""The critic: searches what a law leaves unexplained for terms that recur. It never decides."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.candidates import POSITIVE_EVIDENCE
from scissorcal.calibration.fit_candidate import FittedCandidate, split_strokes
from scissorcal.calibration.result import Proposal
from scissorcal.inference import gradient, ljung_box
from scissorcal.model.friction_terms import TERMS, evaluate
from scissorcal.model.terms import Motion, Term
from scissorcal.recording.recording import Joint

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

RESAMPLES = 100
FALSE_ALARM = 0.05
FEWEST_FOR_RANKS = 6
"""With fewer strokes no ranking reaches 5 %, and the evidence alone decides."""
RECURS = 0.8
"""Share of resamples in which a term must be found to be proposed."""
TWINS = 0.9
"""Correlation, the law taken out, from which two terms are one finding under two names."""
MOST_TERMS = 3
FEWEST_STROKES = 6
WITHIN_ROUNDING = 1e-10
KNOWN_TO_LAW = 1e-3
"""Share of a term's variance that the law cannot imitate, below which the law has it already."""
LEAST_GAIN = 0.005
"""Share of the hold-out error below which a gain is of no use to anybody."""


@dataclass(frozen=True)
class Critique:
    """What the critic proposes, and a sentence on what it searched and found."""

    proposals: tuple[Proposal, ...]
    sentence: str


def criticise(
    what: Literal["friction", "cut"],
    chosen: FittedCandidate,
    motion: Motion,
    joint: Joint,
    rng: np.random.Generator,
) -> Critique:
    """Search a law's residuals for terms of the shared library that it lacks.

    A static search (Brunton, Proctor and Kutz 2016, doi:10.1073/pnas.1517384113, with the residual
    in the place of the derivative) by FROLS (Billings 2013) on columns of unit rms, cut off by the
    extended BIC over independent observations (Chen and Chen 2008, doi:10.1093/biomet/asn034).
    What the law itself could imitate by other values of its parameters is projected out first. The
    search is repeated over resamples of whole strokes, never of single bins, whose errors depend
    on each other; strokes longer than most count as several, lest all excited motion be missing
    from every third resample. A term is proposed where it is found in at least ``RECURS`` of them,
    and lowers the error on unseen strokes consistently (:func:`is_consistent`) and by
    ``LEAST_GAIN`` at least, the law's parameters being refitted with it, by one Gauss-Newton step,
    as they are without it.

    ``motion`` holds the (n,) bins that the law was fitted to.
    """
    labels = np.unique(chosen.strokes)
    if len(labels) < FEWEST_STROKES:
        return Critique(
            (),
            f"The critic needs {FEWEST_STROKES} strokes at least to tell what recurs, and there "
            f"are {len(labels)}.",
        )
    terms = _candidates(motion, joint)
    table = _tabulate(chosen, motion, terms, labels)
    twins = _twins(table)
    pieces = len(table.bins)
    even = np.full(pieces, 1.0 / pieces)
    found = [
        _search(table, rng.multinomial(pieces, even).astype(np.float64)) for _ in range(RESAMPLES)
    ]
    accepted: list[int] = []
    proposals: list[Proposal] = []
    for index in _search(table, np.ones(pieces)):
        inclusion = float(np.mean([bool(twins[index] & set(support)) for support in found]))
        gain, nats = _held_out(table, accepted, index)
        if inclusion < RECURS or not is_consistent(nats) or gain < LEAST_GAIN:
            continue
        accepted.append(index)
        proposals.append(
            _propose(what, chosen, table, accepted, twins[index], joint, inclusion, gain, nats)
        )
    names = f"{len(table.terms)} terms over {RESAMPLES} resamples of {len(labels)} strokes"
    if not proposals:
        return Critique((), f"The critic tried {names} and proposes none.")
    listed = ", ".join(proposal.name for proposal in proposals)
    return Critique(tuple(proposals), f"The critic tried {names} and proposes {listed}.")


@dataclass(frozen=True)
class _Table:
    """Products of columns by piece, (pieces, m, m): the law's slopes, the terms, the residual.

    A piece is a stroke, or a stretch of a long one. Columns are in unit rms but the residual;
    ``scale`` (terms,) is what the terms were divided by, ``law`` counts the law's slopes, ``bins``
    (pieces,) are the bins of each piece, ``stroke`` (pieces,) its stroke's number. ``share`` is the
    share of bins that are independent once all terms together have explained what they can: what
    is missing from a law is correlated too, and must not pass for noise.
    """

    gram: Array
    terms: tuple[Term, ...]
    scale: Array
    law: int
    bins: Array
    stroke: Integers
    share: float


def is_consistent(gained: Array) -> bool:
    """Whether log density gained by stroke (strokes,) is strong evidence, and in most strokes.

    The search tries many terms, so that a sum over strokes alone would propose those that a few
    strokes favour: Wilcoxon's signed-rank test (doi:10.2307/3001968) at 5 % counts too, where there
    are strokes enough for it.
    """
    if float(gained.sum()) < POSITIVE_EVIDENCE:
        return False
    return len(gained) < FEWEST_FOR_RANKS or signed_rank_chance(gained) < FALSE_ALARM


def signed_rank_chance(gained: Array) -> float:
    """Chance that values (n,) without a preferred sign have such a sum of positive ranks, or more.

    Exact, by counting the sums of all choices of signs: gains are real numbers, so that none are
    zero or equal. (Importing scipy.stats, which has it, costs half a second.)

    >>> signed_rank_chance(np.array([0.3, 0.1, -0.2, 0.5]))
    0.1875
    """
    ranks = np.argsort(np.argsort(np.abs(gained))) + 1
    chances = np.ones(1)
    for rank in range(1, len(gained) + 1):
        chances = 0.5 * (np.pad(chances, (0, rank)) + np.pad(chances, (rank, 0)))
    return float(chances[int(ranks[gained > 0].sum()) :].sum())


def _candidates(motion: Motion, joint: Joint) -> tuple[Term, ...]:
    return tuple(
        term
        for term in TERMS.values()
        if not (term.needs_load and motion.load is None)
        and not (term.rotary and joint.kind == "linear")
    )


def _tabulate(
    chosen: FittedCandidate, motion: Motion, terms: Sequence[Term], labels: Integers
) -> _Table:
    """Reduce all bins to products by stroke, leaving out terms that the law has already."""
    point = chosen.optimum.point
    residuals = chosen.candidate.likelihood.residuals
    slopes = -gradient(residuals, point, 1e-3 * chosen.candidate.layout.sd)
    law = slopes[:, np.any(slopes != 0, axis=0)]
    law = law / _rms(law)
    columns = evaluate(tuple(term.name for term in terms), motion)
    scale = _rms(columns)
    alive = np.flatnonzero(scale > 0)
    columns = columns[:, alive] / scale[alive]
    basis = np.linalg.svd(law, full_matrices=False)
    basis_columns = basis[0][:, basis[1] > 1e-8 * basis[1].max()]
    left = columns - basis_columns @ (basis_columns.T @ columns)
    new = np.flatnonzero(np.mean(left**2, axis=0) > KNOWN_TO_LAW)
    every = np.column_stack([law, columns[:, new], residuals(point)])
    solution = np.linalg.lstsq(every[:, :-1], every[:, -1], rcond=1e-8)[0]
    white = ljung_box(every[:, -1] - every[:, :-1] @ solution, chosen.series)
    strokes = [np.flatnonzero(chosen.strokes == label) for label in labels]
    usual = float(np.median([len(here) for here in strokes]))
    split = [np.array_split(here, max(1, round(len(here) / usual))) for here in strokes]
    pieces = [piece for stroke in split for piece in stroke]
    return _Table(
        gram=np.stack([every[here].T @ every[here] for here in pieces]),
        terms=tuple(terms[alive[i]] for i in new),
        scale=scale[alive[new]],
        law=law.shape[1],
        bins=np.array([len(here) for here in pieces], dtype=np.float64),
        stroke=np.repeat(np.arange(len(split)), [len(stroke) for stroke in split]),
        share=white.share,
    )


def _twins(table: _Table) -> list[set[int]]:
    """For each term those that, with the law taken out, say nearly the same, itself among them."""
    if not table.terms:
        return []
    design, _ = _without_law(table, table.gram.sum(axis=0))
    unit = design / np.sqrt(np.sum(design**2, axis=0))
    alike = np.abs(unit.T @ unit) > TWINS
    return [set(np.flatnonzero(row).tolist()) | {i} for i, row in enumerate(alike)]


def _rms(columns: Array) -> Array:
    return np.asarray(np.sqrt(np.mean(columns**2, axis=0)))


def _search(table: _Table, weights: Array) -> tuple[int, ...]:
    """Terms that FROLS and the extended BIC take, given how often each piece counts."""
    if not table.terms:
        return ()
    design, target = _without_law(table, np.tensordot(weights, table.gram, axes=1))
    size = np.sqrt(np.sum(design**2, axis=0))
    usable = np.flatnonzero(size**2 > KNOWN_TO_LAW * float(weights @ table.bins))
    if len(usable) == 0:
        return ()
    count = float(weights @ table.bins) * table.share
    best: tuple[int, ...] = ()
    lowest = count * np.log(float(target @ target))
    for support in forward_path(design[:, usable] / size[usable], target):
        kept = design[:, usable[list(support)]]
        left = target - kept @ np.linalg.lstsq(kept, target, rcond=None)[0]
        penalty = len(support) * (np.log(count) + 2 * np.log(len(usable)))
        criterion = count * np.log(max(float(left @ left), 1e-300)) + penalty
        if criterion < lowest:
            best, lowest = tuple(int(usable[i]) for i in support), criterion
    return best


def _without_law(table: _Table, gram: Array) -> tuple[Array, Array]:
    """Few rows with the products of all bins: terms (m, terms) and residual (m,), law taken out."""
    values, vectors = np.linalg.eigh(gram)
    rows = np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T
    basis, singular, _ = np.linalg.svd(rows[:, : table.law], full_matrices=False)
    basis = basis[:, singular > 1e-6 * singular.max(initial=0.0)]
    rest = rows[:, table.law :]
    rest = rest - basis @ (basis.T @ rest)
    return rest[:, :-1], rest[:, -1]


def forward_path(design: Array, target: Array, most: int = MOST_TERMS) -> list[tuple[int, ...]]:
    """Supports of growing size by forward regression orthogonal least squares.

    Each step takes the column of ``design`` (m, k) that, made orthogonal to those before, explains
    most of ``target`` (m,): the largest error reduction ratio (Billings 2013, ISBN 9781119943594,
    section 3.2; FROLS in PySINDy). Columns that those before make up already are never taken.
    """
    left = np.array(design, dtype=np.float64)
    before = np.sum(left**2, axis=0)
    chosen: list[int] = []
    supports = []
    for _ in range(min(most, design.shape[1])):
        size = np.sum(left**2, axis=0)
        new = size > WITHIN_ROUNDING * before
        new[chosen] = False
        if not np.any(new):
            break
        explained = np.where(new, (left.T @ target) ** 2 / np.where(new, size, 1.0), -1.0)
        chosen.append(int(np.argmax(explained)))
        supports.append(tuple(sorted(chosen)))
        along = left[:, chosen[-1]] / np.sqrt(size[chosen[-1]])
        left -= np.outer(along, along @ left)
    return supports


def _solve(gram: Array, columns: Sequence[int]) -> Array:
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


def _held_out(table: _Table, accepted: Sequence[int], index: int) -> tuple[float, Array]:
    """What a term gains on unseen strokes: share of the rms, and nats by stroke (strokes,)."""
    before = [*range(table.law), *(table.law + i for i in accepted)]
    errors = np.zeros((2, len(table.gram)))
    for fold in split_strokes(np.unique(table.stroke)):
        unseen = np.isin(table.stroke, fold)
        gram = table.gram[~unseen].sum(axis=0)
        for row, columns in enumerate((before, [*before, table.law + index])):
            solution = _solve(gram, columns)
            errors[row, unseen] = _squares(table.gram[unseen], columns, solution)
    variance = errors[0].sum() / table.bins.sum()
    nats = 0.5 * table.share * (errors[0] - errors[1]) / variance
    gain = 1.0 - float(np.sqrt(errors[1].sum() / errors[0].sum()))
    return gain, np.bincount(table.stroke, nats).astype(np.float64)


def _propose(
    what: Literal["friction", "cut"],
    chosen: FittedCandidate,
    table: _Table,
    accepted: Sequence[int],
    twins: set[int],
    joint: Joint,
    inclusion: float,
    gain: float,
    nats: Array,
) -> Proposal:
    """Refit law and accepted terms over all strokes, and word the last term as a proposal."""
    columns = [*range(table.law), *(table.law + i for i in accepted)]
    gram = table.gram.sum(axis=0)
    solution = _solve(gram, columns)
    sd = _clustered_sd(table, columns, solution)
    index = accepted[-1]
    term = table.terms[index]
    coefficient = float(solution[-1] / table.scale[index])
    coefficient_sd = float(sd[-1] / table.scale[index])
    unit = term.unit(joint.position_unit, joint.effort_unit)
    adopted = [str(name) for name in chosen.candidate.key.get("adopt", ())]
    adopted += [table.terms[i].name for i in accepted]
    adoptable = what == "friction" and term.adoptable
    line = f"fit.friction.adopt = {json.dumps(adopted)}" if adoptable else ""
    how = f"adopt it by {line}" if line else f"no {what} candidate has it yet"
    sentence = (
        f"{chosen.name} leaves {coefficient:.3g} {unit} times {term.name} ({term.meaning}) "
        f"unexplained: found in {inclusion:.0%} of the resamples of strokes, and it lowers the "
        f"error on unseen strokes by {gain:.1%} ({nats.sum():.0f} nats); {how}."
    )
    others = ", ".join(table.terms[i].name for i in sorted(twins - {index}))
    if others:
        sentence += f" These strokes hardly tell it from {others}."
    return Proposal(
        name=term.name,
        formula=f"{term.meaning}: coefficient times {term.name}",
        coefficient=coefficient,
        coefficient_sd=coefficient_sd,
        unit=unit,
        inclusion=inclusion,
        held_out_gain=gain,
        held_out_nats=float(nats.sum()),
        adopted_by=line,
        sentence=sentence,
    )


def _clustered_sd(table: _Table, columns: Sequence[int], solution: Array) -> Array:
    """Standard deviations (columns,) that let errors depend on each other within a stroke.

    Liang and Zeger 1986, doi:10.1093/biomet/73.1.13.
    """
    chosen, gram = np.asarray(columns), table.gram
    normal = gram.sum(axis=0)[np.ix_(chosen, chosen)]
    inverse = np.linalg.pinv(normal, rcond=1e-12, hermitian=True)
    by_piece = gram[:, chosen, -1] - gram[:, chosen[:, None], chosen] @ solution
    scores = np.stack([by_piece[table.stroke == k].sum(axis=0) for k in np.unique(table.stroke)])
    return np.asarray(np.sqrt(np.diag(inverse @ scores.T @ scores @ inverse)))
