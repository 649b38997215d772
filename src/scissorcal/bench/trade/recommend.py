"""Which setting to use, in sentences with the numbers of the run."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from scissorcal.bench.trade.point import TIMES_S, Curve, Point

LEAST_SAVING = 0.1
"""Least saving, as a share, for which the present setting is left where the cost is a time.

Processor times of equal work differ: repeats of one fit lie 7 % apart, lowest to highest of three,
in the median of 24 settings of the virtual rig, and further where other work runs beside them. A
setting with one repeat does not show that."""


class Captures(NamedTuple):
    """How much captures of one specimen differ, as far as they were simulated.

    ``needed`` says that a setting must have been tried on simulated captures before it takes the
    place of the present one. ``scatter`` is the limit that the main error of the present settings,
    a share of the scene's largest torque, does not exceed from one capture to the next in 9 of 10;
    None where it is not known.
    """

    needed: bool = False
    scatter: float | None = None


def recommend(
    curve: Curve, limit: float, tolerance: float, unsure: str = "", captures: Captures | None = None
) -> Curve:
    """Mark the recommended setting of a curve and say why, as its first sentence.

    It is the cheapest one by the main cost whose main error is at most ``limit``, a share of the
    scene's largest torque, that fails no check which the present setting passes, and whose guarded
    errors are allowed or no larger than the present setting's. Where the present setting is within
    the limit, it stays unless the range of the other's cost lies below its own; a cost that is a
    time must also be lower by `LEAST_SAVING`. Where ``captures`` are needed, the setting must also
    hold on the next capture (`_unheld`).
    Nothing is recommended where the error is not one of torque, where nothing but the reference
    was measured, where no setting is within the limit, or where ``unsure`` says why. ``tolerance``
    is the scene's.
    """
    seen = captures or Captures()
    able = [p for p in curve.points if not p.failed and curve.cost in p.costs]
    further = [f"{p.setting.label} gave no result: {p.failed}" for p in curve.points if p.failed]
    if curve.unmeasured:
        further.append(f"Not measured within the budget: {'; '.join(curve.unmeasured)}.")
    judged = [p for p in able if _share(curve, p) is not None]
    if not able and not curve.points:
        return replace(curve, sentences=("No setting was measured within the budget.", *further))
    if unsure:
        return replace(curve, sentences=(unsure, *further))
    if not [p for p in judged if not p.reference]:
        return replace(curve, sentences=(_silent(curve, able), *further))
    present = next((p for p in able if p.setting.present), None)
    judge = _Judge(curve, present, limit, seen)
    within = judge.within(able)
    held = [p for p in within if not judge.unheld(p)]
    if not held:
        return replace(curve, sentences=(_nothing(judge, judged, within), *further))
    chosen = min(held, key=lambda p: p.costs[curve.cost].median)
    points = tuple(replace(p, recommended=p is chosen) for p in curve.points)
    parts = [
        _reason(judge, able, chosen),
        _limit(curve, chosen, limit, tolerance),
        _on_the_next(curve, chosen, present),
        _passed(judge, able, chosen),
        _undetermined(judge, able, chosen),
        _unguarded(able, present),
        chosen.setting.remark,
    ]
    return replace(curve, points=points, sentences=(" ".join(filter(None, parts)), *further))


def unsimulated(curve: Curve, limit: float, captures: Captures) -> Point | None:
    """The cheapest setting that would be recommended if it holds on the next capture.

    None where no such setting lacks simulated captures, or where a cheaper one holds already.
    """
    if not captures.needed:
        return None
    able = [p for p in curve.points if not p.failed and curve.cost in p.costs]
    present = next((p for p in able if p.setting.present), None)
    judge = _Judge(curve, present, limit, captures)
    open_ = [p for p in judge.within(able) if not judge.unheld(p) or p.next_capture is None]
    cheapest = min(open_, key=lambda p: p.costs[curve.cost].median, default=None)
    if cheapest is None or cheapest.setting.present or cheapest.next_capture is not None:
        return None
    return cheapest


def barred(curve: Curve) -> frozenset[str]:
    """Labels that fail a check or need more than is allowed: no repeat can recommend them."""
    present = next((p for p in curve.points if p.setting.present and not p.failed), None)
    found = [p for p in curve.points if p.failed or _bar(p, present)]
    return frozenset(p.setting.label for p in found if not p.setting.present)


@dataclass(frozen=True)
class _Judge:
    """Judges the settings of a curve against its present one."""

    curve: Curve
    present: Point | None
    limit: float
    captures: Captures

    def within(self, able: Sequence[Point]) -> list[Point]:
        """Settings without objection; those that save, where the present one is among them."""
        within = [p for p in able if not self.objection(p)]
        present = self.present
        if present not in within or present is None:
            return within
        return [present, *(p for p in within if _saves(self.curve, p, present))]

    def objection(self, point: Point) -> str:
        """Why a setting may not be recommended, as the end of a sentence; empty where it may."""
        if bar := _bar(point, self.present):
            return bar
        share, error = _share(self.curve, point), self.curve.error
        if point.reference or (share is not None and share <= self.limit):
            return ""
        if share is None:
            return f"its {error} is not known"
        said = f"its {error} is {_percent(share)}"
        if self.undetermined(point):
            said += f", inside the {_percent(self.captures.scatter)} by which captures differ"
        return said

    def undetermined(self, point: Point) -> bool:
        """Whether an error beyond the limit is no larger than what another capture changes."""
        share, scatter = _share(self.curve, point), self.captures.scatter
        return share is not None and scatter is not None and self.limit < share <= scatter

    def unheld(self, point: Point) -> str:
        """Why a setting does not hold on the next capture; empty where it does.

        One that saves may add no more than the limit to the worst torque error on 9 of 10 captures.
        One that saves nothing, or replaces a present one beyond the limit, must have no more
        error than that on each simulated capture: on n captures chance does so in 1 of 2^n cases.
        """
        present = self.present
        if not self.captures.needed or point.setting.present or present is None:
            return ""
        found = point.next_capture
        if found is None:
            return "no other capture was simulated with it within the budget"
        spared = _saves(self.curve, point, present) and not self.objection(present)
        allowed = self.limit if spared else 0.0
        if found.loss <= allowed:
            return ""
        return (
            f"on the next capture its worst torque error may be {_percent(found.loss)} larger than "
            f"with {present.setting.label} ({found.captures} captures simulated)"
        )

    def why_not(self, point: Point) -> str:
        """The objection to a setting, or why it does not hold."""
        return self.objection(point) or self.unheld(point)


def choices_of(curves: Sequence[Curve]) -> tuple[tuple[str, str], ...]:
    """The recommended label of each knob that has one."""
    return tuple(
        (curve.knob, point.setting.label)
        for curve in curves
        for point in curve.points
        if point.recommended
    )


def together_sentence(curve: Curve, apart: Sequence[str] = ()) -> str:
    """What all recommended settings give at once, beside the present ones.

    ``apart`` names the recommended settings that the measurement does not hold.
    """
    if failed := [p for p in curve.points if p.failed]:
        return f"{curve.title} could not be measured: {failed[0].failed}"
    present = next((p for p in curve.points if p.setting.present), None)
    chosen = next((p for p in curve.points if not p.setting.present), None)
    if present is None or chosen is None:
        return "All recommended settings at once were not measured within the budget."
    costs = "; ".join(
        f"{name} {chosen.costs[name].words} in place of {present.costs[name].words}"
        for name in present.costs
        if name in chosen.costs
    )
    said = (
        f"All recommended settings at once, measured: {costs}; {curve.error} "
        f"{_percent(_share(curve, chosen))} of the scene's largest torque in place of "
        f"{_percent(_share(curve, present))}."
    )
    if apart:
        said += f" Not part of this measurement, which they do not change: {'; '.join(apart)}."
    return said


def _silent(curve: Curve, able: Sequence[Point]) -> str:
    """Why nothing is recommended although nothing failed."""
    if any(curve.error in p.errors and not p.reference for p in able):
        return f"The {curve.error} is no share of the torque, so no setting is recommended."
    return "Too few settings were measured to recommend one."


def _nothing(judge: _Judge, judged: Sequence[Point], within: Sequence[Point]) -> str:
    """Why no setting is recommended although some were measured."""
    curve, limit = judge.curve, judge.limit
    if within:
        nearest = _nearest(judge, within)
        return f"No setting is recommended: {nearest.setting.label}: {judge.why_not(nearest)}."
    lowest = min(judged, key=lambda p: _share(curve, p) or 0.0)
    if (_share(curve, lowest) or 0.0) <= limit:
        return (
            f"No setting is recommended: {lowest.setting.label} leaves the lowest "
            f"{curve.error}, but {judge.why_not(lowest)}."
        )
    return (
        f"No measured setting keeps the {curve.error} within {_percent(limit)} of the scene's "
        f"largest torque: {lowest.setting.label} comes nearest with "
        f"{_percent(_share(curve, lowest))}."
    )


def _reason(judge: _Judge, able: Sequence[Point], chosen: Point) -> str:
    """Whether the present setting stays, and what changes where another is enough."""
    curve, present = judge.curve, judge.present
    cost, label = chosen.costs[curve.cost], chosen.setting.label
    if chosen.setting.present:
        cheaper = [p for p in able if p.costs[curve.cost].median < cost.median]
        if not cheaper:
            return f"{label} stays: no measured setting costs less {curve.cost}."
        # what saves enough is not chosen, so there is an objection to each of them
        clear = [p for p in cheaper if _saves(curve, p, chosen)]
        if not clear:
            least = f" and by {_percent(LEAST_SAVING)}" if cost.unit in TIMES_S else ""
            return (
                f"{label} stays: no measured setting costs less {curve.cost} by more than the "
                f"repeats differ{least}."
            )
        best = _nearest(judge, clear)
        saved = _percent(1.0 - best.costs[curve.cost].median / cost.median)
        return (
            f"{label} stays: {best.setting.label} would save {saved} {curve.cost}, but "
            f"{judge.why_not(best)}."
        )
    if present is None:
        return f"{label} is enough, for {cost.words} {curve.cost}."
    own = present.costs[curve.cost]
    change = f"{cost.words} {curve.cost} in place of {own.words} with {present.setting.label}"
    if judge.objection(present):
        return f"{label} is needed: {change}, which is not within the limit."
    return f"{label} is enough: {change}, {_percent(1.0 - cost.median / own.median)} less."


def _nearest(judge: _Judge, points: Sequence[Point]) -> Point:
    """The cheapest that only the next capture speaks against, else the one of the lowest error."""
    cost, share = judge.curve.cost, lambda p: _share(judge.curve, p) or 0.0
    if able := [p for p in points if not judge.objection(p)]:
        return min(able, key=lambda p: p.costs[cost].median)
    return min(points, key=share)


def _passed(judge: _Judge, able: Sequence[Point], chosen: Point) -> str:
    """Name cheaper settings with an objection, each with the reason; empty where none is left.

    The sentence of a present setting that stays names one of them already.
    """
    curve, cost = judge.curve, chosen.costs[judge.curve.cost]
    cheaper = [p for p in able if p.costs[curve.cost].median < cost.median and judge.why_not(p)]
    clear = [p for p in cheaper if _saves(curve, p, chosen)]
    if chosen.setting.present and clear:
        cheaper.remove(_nearest(judge, clear))
    reasons: dict[str, list[str]] = {}
    for point in cheaper:
        reasons.setdefault(judge.why_not(point), []).append(point.setting.label)
    parts = [f"{', '.join(labels)}: {why}" for why, labels in reasons.items()]
    return f"Cheaper, but passed over: {'; '.join(parts)}." if parts else ""


def _undetermined(judge: _Judge, able: Sequence[Point], chosen: Point) -> str:
    """What to do where a cheaper setting is passed over for an error inside the scatter."""
    cost = chosen.costs[judge.curve.cost].median
    cheaper = [p for p in able if p.costs[judge.curve.cost].median < cost]
    if not any(judge.undetermined(p) for p in cheaper):
        return ""
    return "An error inside that is not determined: capture again and repeat the benchmark."


def stated(curve: Curve, point: Point) -> float | None:
    """What the sentence of a recommended setting states of its worst error on 9 of 10 captures.

    Its main error on this capture, and what simulated captures give on top: with it, or, where it
    changes no fit, with the present settings. A share of the scene's largest torque; None where no
    capture was simulated.
    """
    known = next((p.next_capture for p in curve.points if p.setting.present), None)
    found = point.next_capture or known
    return None if found is None else (_share(curve, point) or 0.0) + found.error


def _on_the_next(curve: Curve, chosen: Point, present: Point | None) -> str:
    """What the next capture gives with another setting; empty where not known, or where none is."""
    whole = stated(curve, chosen)
    own, known = chosen.next_capture, present.next_capture if present else None
    found = own or known
    if chosen.setting.present or found is None or whole is None:
        return ""
    said = f"{_percent(found.error)} {'with it' if own else 'with the present settings'}"
    if own and known and present:
        said += f" and {_percent(known.error)} with {present.setting.label}"
    return (
        f"On 9 of 10 captures of the same specimen the worst torque error is at most {said} "
        f"({found.captures} captures simulated from the fits): expect up to {_percent(whole)}, "
        "both together, against the truth."
    )


def _bar(point: Point, present: Point | None) -> str:
    """Which check a setting fails, or which guarded error is too large; empty without either."""
    if failed := [c for c in point.rejected if present is None or c not in present.rejected]:
        return f"it fails the check {', '.join(failed)}"
    if guard := _beyond_guard(point, present):
        return f"its {guard}"
    return ""


def _saves(curve: Curve, point: Point, present: Point) -> bool:
    """Whether a setting costs less than the present one beyond what repeats of both explain."""
    cost, own = point.costs[curve.cost], present.costs[curve.cost]
    least = LEAST_SAVING if cost.unit in TIMES_S else 0.0
    return cost.high < own.low and cost.median <= (1.0 - least) * own.median


def _unguarded(able: Sequence[Point], present: Point | None) -> str:
    """That a guarded error has no number, so that settings of smaller size are left out."""
    left_out = [p for p in able if _without_guard(p, present)]
    if present is None or not left_out:
        return ""
    why = left_out[0].unbounded[0]
    return f"No setting below {present.setting.label} is recommended, since {why}."


def _without_guard(point: Point, present: Point | None) -> bool:
    """Whether a guarded error of a setting has no number, and nothing shows that it is no worse."""
    return bool(point.unbounded) and not (present and point.setting.size >= present.setting.size)


def _beyond_guard(point: Point, present: Point | None) -> str:
    """Which guarded error of a setting is beyond 1 and the present one's; empty where none is."""
    if _without_guard(point, present):
        return point.unbounded[0]
    for name, error in point.errors.items():
        if error.guarded:
            known = present.errors.get(name) if present else None
            own = known.value if known else 1.0
            if error.value > max(1.0, own):
                return f"{name} is {error.value:.2g} in place of {own:.2g}"
    return ""


def _limit(curve: Curve, chosen: Point, limit: float, tolerance: float) -> str:
    share = _share(curve, chosen)
    if share is None:
        return f"Errors are counted against {curve.against}."
    return (
        f"Its {curve.error} is {_percent(share)} of the scene's largest torque against "
        f"{curve.against}; the limit of one knob is {_percent(limit)}, its part of the tolerance "
        f"of {_percent(tolerance)}."
    )


def _share(curve: Curve, point: Point) -> float | None:
    error = point.errors.get(curve.error)
    return error.share if error else None


def _percent(share: float | None) -> str:
    return "0 %" if not share else f"{100.0 * share:.2g} %"
