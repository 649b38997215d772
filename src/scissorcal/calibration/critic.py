"""The critic: searches what a law leaves unexplained for terms that recur. It never decides.

Whether anything stands out at all is asked first, without a search; PySINDy, whose import takes
most of a second, searches only then.
"""

import json
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.candidates import POSITIVE_EVIDENCE
from scissorcal.calibration.fit_candidate import FittedCandidate, split_strokes
from scissorcal.calibration.fit_model import Design
from scissorcal.calibration.leftover import DRAWS, Leftover, course_of, tabulate
from scissorcal.calibration.result import Proposal
from scissorcal.model.course_terms import LIBRARY
from scissorcal.model.terms import Term
from scissorcal.recording.recording import Joint
from scissorcal.verdicts import STATED, TORQUE, Check, Verdict

FALSE_ALARM = 0.02
"""Chance that the critic proposes anything where nothing is missing."""
FEWEST_STROKES = 6
"""Six strokes must agree on a term to an eighth of itself, three to a fiftieth (Student's t at the
chance ``FALSE_ALARM`` of one in 45 terms)."""
RECURS = 0.75
"""Share of the searches without a quarter of the strokes in which a term must be found: one quarter
may hold all strokes that show it."""
TWINS = 0.9
"""Correlation, the law taken out, from which two terms are one finding under two names."""
MOST_TERMS = 3
NOT_ASKED = "The critic was not asked."
STRUCTURE_LEFT = Check(
    "fit structure left",
    f"{TORQUE}lower limit of twice the rms of what the law lacks in every stroke, share of the "
    "drive (rms)",
    at_most=STATED,
)


@dataclass(frozen=True)
class Structure:
    """Torque that a law lacks and that recurs over strokes: twice its rms, which holds 95 % of it.

    ``low`` and ``high`` are its interval of 90 %, all in N m (N); ``low`` is 0 where nothing stands
    out, and ``high`` what any one term of the library could still hide.
    """

    size: float
    low: float
    high: float


@dataclass(frozen=True)
class Critique:
    """What the critic proposes, a sentence on what it did, and the structure that is left.

    ``torque`` (n,) is what the proposals add to the law at each bin. Structure and torque are None
    where the critic did not look.
    """

    proposals: tuple[Proposal, ...]
    sentence: str
    structure: Structure | None = None
    torque: Array | None = None


def criticise(
    design: Design,
    chosen: FittedCandidate,
    joint: Joint,
    rng: np.random.Generator,
    known: Sequence[str] = (),
) -> Critique:
    """Search a law's residuals for terms of the library that it lacks.

    A static search (Brunton, Proctor and Kutz 2016, doi:10.1073/pnas.1517384113, with the residual
    in the place of the derivative) by PySINDy's FROLS (Billings 2013), cut off by the extended BIC
    over independent observations (Chen and Chen 2008, doi:10.1093/biomet/asn034). What the law
    itself could imitate by other values of its parameters is projected out first. There is a search
    over all strokes, and one without each quarter of them: whole strokes, never single bins, whose
    errors depend on each other. A term is proposed where it is found in ``RECURS`` of the latter,
    goes along with the residual as no term of the library does by chance
    (:meth:`Leftover.chances`), and is strong evidence on unseen strokes, the law's parameters being
    refitted with it, by one Gauss-Newton step, as they are without it.

    The load of a cut is the torque that the law expects of the material. Terms that are ``known``
    by name are judged elsewhere and count as the law's.
    """
    what, bins, load = design.what, design.bins, None
    if what == "cut":
        load = design.observed - chosen.candidate.likelihood.residuals(chosen.optimum.point)
    labels = np.unique(chosen.strokes)
    if len(labels) < FEWEST_STROKES:
        return Critique(
            (),
            f"The critic needs {FEWEST_STROKES} strokes at least to tell what recurs, and there "
            f"are {len(labels)}.",
        )
    terms = [term for term in _candidates(load, joint) if term.name not in known]
    already = [LIBRARY[name] for name in known]
    left = tabulate(chosen, course_of(bins, load), terms, already)
    tried = f"The critic tried {len(left.terms)} terms over {len(labels)} strokes"
    quiet = Structure(0.0, 0.0, left.hidden())
    least = min(left.chances().values(), default=1.0)
    if least >= FALSE_ALARM:
        sentence = f"{tried} and proposes none: none stands out of chance ({least:.0%})."
        return Critique((), sentence, quiet)
    findings = _accepted(left)
    if not findings:
        sentence = f"{tried} and proposes none: what stands out does not recur in unseen strokes."
        return Critique((), sentence, quiet)
    accepted = [index for finding in findings for index in finding.terms]
    coefficients, covariance = left.refitted(accepted)
    draws = rng.multivariate_normal(coefficients, covariance, DRAWS, method="eigh")
    low, high = np.quantile(left.sizes(accepted, draws), [0.05, 0.95])
    size = float(left.sizes(accepted, coefficients[None])[0])
    proposals = tuple(
        _propose(what, chosen, left, findings[: place + 1], joint) for place in range(len(findings))
    )
    listed = ", ".join(proposal.name for proposal in proposals)
    return Critique(
        proposals,
        f"{tried} and proposes {listed}.",
        Structure(size, float(low), float(high)),
        left.torque(accepted, coefficients),
    )


def structure_verdict(critique: Critique, drive: float, unit: str, tolerance: float) -> Verdict:
    """Judge what recurs and the law lacks by the share of torque that the scene tolerates.

    ``drive`` is the drive's rms. It fails where the structure's lower limit exceeds the tolerance,
    and is not determined where only its upper one does.
    """
    left = critique.structure
    if left is None:
        asked = critique.sentence != NOT_ASKED
        why = critique.sentence if asked else "The critic was not asked; --critic asks it."
        return STRUCTURE_LEFT.not_evaluated(why, threshold=tolerance)
    low, size, high = (value / drive for value in (left.low, left.size, left.high))
    names = ", ".join(proposal.name for proposal in critique.proposals)
    most = f"{left.high:.2g} {unit} ({high:.1%} of the drive)"
    said = f"No term of the critic's library stands out; it could hide {most} at most."
    if names:
        said = (
            f"What the law lacks recurs over strokes with {left.size:.2g} {unit} ({size:.1%} of "
            f"the drive, {low:.1%} to {high:.1%}; twice the rms): {names}."
        )
    if low > tolerance:
        why = (
            f"{said} That is more than the scene's tolerance of {100 * tolerance:g}%: adopt the "
            "term if it is friction; if it is of the day or the rig, cure it (warm up, repair the "
            "encoder) and capture again."
        )
        return STRUCTURE_LEFT.verdict("fail", low, why, threshold=tolerance)
    if high > tolerance:
        why = (
            f"{said} Whether that exceeds the scene's tolerance of {100 * tolerance:g}% is not "
            "determined: capture more strokes."
        )
        return STRUCTURE_LEFT.not_evaluated(why, low, threshold=tolerance)
    return STRUCTURE_LEFT.verdict("pass", low, said, threshold=tolerance)


def _candidates(load: Array | None, joint: Joint) -> tuple[Term, ...]:
    return tuple(
        term
        for term in LIBRARY.values()
        if not (term.needs_load and load is None) and not (term.rotary and joint.kind == "linear")
    )


@dataclass(frozen=True)
class _Finding:
    """Terms that are found together, what speaks for them, and findings that say nearly the same.

    ``name`` is the term's, or that of both phases of a wave.
    """

    name: str
    terms: tuple[int, ...]
    inclusion: float
    gain: float
    nats: float
    twins: tuple[str, ...]


def _accepted(left: Leftover) -> list[_Finding]:
    """What is found, recurs, stands out of chance and helps on unseen strokes, in order."""
    folds = split_strokes(np.unique(left.stroke))
    weights = [(~np.isin(left.stroke, fold)).astype(np.float64) for fold in folds]
    names, *without = (
        list(dict.fromkeys(left.terms[i].part or left.terms[i].name for i in _search(left, each)))
        for each in (np.ones(len(left.bins)), *weights)
    )
    twins = left.twins(TWINS)
    accepted: list[_Finding] = []
    for name in names:
        within = [index for finding in accepted for index in finding.terms]
        terms = left.findings[name]
        recurs = float(np.mean([bool(twins[name] & set(others)) for others in without]))
        gain, nats = left.held_out(within, terms)
        if recurs < RECURS or nats.sum() < POSITIVE_EVIDENCE:
            continue
        if left.chances(within).get(name, 1.0) >= FALSE_ALARM:
            continue
        others = tuple(sorted(twins[name] - {name}))
        accepted.append(_Finding(name, tuple(terms), recurs, gain, float(nats.sum()), others))
    return accepted


def _search(left: Leftover, weights: Array) -> tuple[int, ...]:
    """Terms that FROLS and the extended BIC take, the first first, over pieces with ``weights``."""
    design, target = left.weighed(weights)
    size = np.sqrt(np.sum(design**2, axis=0))
    counted = float(weights @ left.bins)
    usable = np.flatnonzero(size**2 > 1e-3 * counted)
    if len(usable) == 0:
        return ()
    count = counted * left.share
    best: tuple[int, ...] = ()
    lowest = count * np.log(float(target @ target))
    for support in _supports(design[:, usable] / size[usable], target):
        kept = design[:, usable[list(support)]]
        rest = target - kept @ np.linalg.lstsq(kept, target, rcond=None)[0]
        penalty = len(support) * (np.log(count) + 2 * np.log(len(usable)))
        criterion = count * np.log(max(float(rest @ rest), 1e-300)) + penalty
        if criterion < lowest:
            best, lowest = tuple(int(usable[i]) for i in support), criterion
    return best


def _supports(design: Array, target: Array) -> list[tuple[int, ...]]:
    """Supports of growing size, each in the order in which FROLS took its terms."""
    with warnings.catch_warnings():
        # What it imports announces changes of its own that do not concern the search.
        warnings.simplefilter("ignore")
        from pysindy.optimizers import FROLS

        search = FROLS(max_iter=min(MOST_TERMS, design.shape[1]), alpha=0.0, unbias=False)
        search.fit(design, target[:, None])
    order: list[int] = []
    supports = []
    for step in search.history_:
        taken = [int(i) for i in np.flatnonzero(step[0]) if i not in order]
        if len(taken) == 1:
            order += taken
            supports.append(tuple(order))
    return supports


def _propose(
    what: Literal["friction", "cut"],
    chosen: FittedCandidate,
    left: Leftover,
    found: Sequence[_Finding],
    joint: Joint,
) -> Proposal:
    """Refit law and accepted terms over all strokes, and word the last finding as a proposal.

    The coefficient of a wave is its amplitude.
    """
    finding = found[-1]
    terms = list(finding.terms)
    refitted, covariances = left.refitted([index for other in found for index in other.terms])
    coefficients = refitted[-len(terms) :] / left.scale[terms]
    covariance = covariances[-len(terms) :, -len(terms) :] / np.outer(
        left.scale[terms], left.scale[terms]
    )
    coefficient = float(coefficients[0] if len(terms) == 1 else np.linalg.norm(coefficients))
    along = coefficients / np.linalg.norm(coefficients)
    size = float(left.sizes(terms, refitted[None, -len(terms) :])[0])
    term = left.terms[terms[0]]
    unit = term.unit(joint.position_unit, joint.effort_unit)
    adopted = [str(name) for name in chosen.candidate.key.get("adopt", ())]
    adopted += [other.name for other in found if left.terms[other.terms[0]].adoptable]
    adoptable = what == "friction" and term.adoptable
    line = f"fit.friction.adopt = {json.dumps(adopted)}" if adoptable else ""
    how = f"adopt it by {line}" if line else f"no {what} candidate has it"
    sentence = (
        f"{chosen.name} leaves {coefficient:.3g} {unit} times {finding.name} ({term.meaning}) "
        f"unexplained, {size:.2g} {joint.effort_unit} of torque (twice its rms): found in "
        f"{finding.inclusion:.0%} of the searches without a quarter of the strokes, and it lowers "
        f"the error on unseen strokes by {finding.gain:.1%} ({finding.nats:.0f} nats); {how}."
    )
    if finding.twins:
        sentence += f" These strokes hardly tell it from {', '.join(finding.twins)}."
    return Proposal(
        name=finding.name,
        formula=f"{term.meaning}: coefficient times {finding.name}",
        coefficient=coefficient,
        coefficient_sd=float(np.sqrt(along @ covariance @ along)),
        unit=unit,
        size=size,
        inclusion=finding.inclusion,
        held_out_gain=finding.gain,
        held_out_nats=finding.nats,
        adopted_by=line,
        sentence=sentence,
    )
