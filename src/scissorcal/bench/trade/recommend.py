"""Which setting to use, in sentences with the numbers of the run."""

from collections.abc import Sequence
from dataclasses import replace

from scissorcal.bench.trade.point import Curve, Point, Spread


def recommend(curve: Curve, limit: float, tolerance: float) -> Curve:
    """Mark the recommended setting of a curve and say why, as its first sentence.

    It is the cheapest one by the main cost whose main error is at most ``limit``, a share of the
    scene's largest torque, that fails no check which the present setting passes, and whose guarded
    errors are allowed or no larger than the present setting's. Where the range of its cost overlaps
    that of the present one's, the present setting stays.
    Nothing is recommended where the error is not one of torque, where nothing but the reference
    was measured, or where no setting is within the limit. ``tolerance`` is the scene's.
    """
    able = [p for p in curve.points if not p.failed and curve.cost in p.costs]
    further = [f"{p.setting.label} gave no result: {p.failed}" for p in curve.points if p.failed]
    if curve.unmeasured:
        further.append(f"Not measured within the budget: {'; '.join(curve.unmeasured)}.")
    judged = [p for p in able if _share(curve, p) is not None]
    if not able and not curve.points:
        return replace(curve, sentences=("No setting was measured within the budget.", *further))
    if not [p for p in judged if not p.reference]:
        return replace(curve, sentences=(_silent(curve, able), *further))
    present = next((p for p in able if p.setting.present), None)
    passed = set(present.rejected) if present else set()
    within = [
        p
        for p in able
        if (p.reference or _within(curve, p, limit))
        and set(p.rejected) <= passed
        and not _beyond_guard(p, present)
    ]
    if not within:
        lowest = min(judged, key=lambda p: _share(curve, p) or 0.0)
        said = (
            f"No measured setting keeps the {curve.error} within {_percent(limit)} of the scene's "
            f"largest torque: {lowest.setting.label} comes nearest with "
            f"{_percent(_share(curve, lowest))}."
        )
        return replace(curve, sentences=(said, *further))
    chosen = min(within, key=lambda p: p.costs[curve.cost].median)
    if present in within and _overlap(present.costs[curve.cost], chosen.costs[curve.cost]):
        chosen = present
    points = tuple(replace(p, recommended=p is chosen) for p in curve.points)
    reason = f"{_reason(curve, able, chosen, present)} {_limit(curve, chosen, limit, tolerance)}"
    return replace(curve, points=points, sentences=(reason, *further))


def choices_of(curves: Sequence[Curve]) -> tuple[tuple[str, str], ...]:
    """The recommended label of each knob that has one."""
    return tuple(
        (curve.knob, point.setting.label)
        for curve in curves
        for point in curve.points
        if point.recommended
    )


def together_sentence(curve: Curve) -> str:
    """What all recommended settings give at once, beside the present ones."""
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
    return (
        f"All recommended settings at once, measured: {costs}; {curve.error} "
        f"{_percent(_share(curve, chosen))} of the scene's largest torque in place of "
        f"{_percent(_share(curve, present))}."
    )


def _silent(curve: Curve, able: Sequence[Point]) -> str:
    """Why nothing is recommended although nothing failed."""
    if any(curve.error in p.errors and not p.reference for p in able):
        return f"The {curve.error} is no share of the torque, so no setting is recommended."
    return "Too few settings were measured to recommend one."


def _reason(curve: Curve, able: Sequence[Point], chosen: Point, present: Point | None) -> str:
    """Whether the present setting stays, and what changes where another is enough."""
    cost, label = chosen.costs[curve.cost], chosen.setting.label
    if chosen.setting.present:
        cheaper = [p for p in able if p.costs[curve.cost].high < cost.low]
        best = min(cheaper, key=lambda p: _share(curve, p) or 0.0, default=None)
        if best is None:
            return f"{label} stays: no measured setting costs less {curve.cost}."
        saved = _percent(1.0 - best.costs[curve.cost].median / cost.median)
        why = f"its {curve.error} is {_percent(_share(curve, best))}"
        if best.rejected:
            why = f"it fails the check {', '.join(best.rejected)}"
        elif guard := _beyond_guard(best, chosen):
            why = f"its {guard}"
        return f"{label} stays: {best.setting.label} would save {saved} {curve.cost}, but {why}."
    if present is None:
        return f"{label} is enough, for {cost.words} {curve.cost}."
    own = present.costs[curve.cost]
    change = f"{cost.words} {curve.cost} in place of {own.words} with {present.setting.label}"
    if cost.median > own.median:
        return f"{label} is needed: {change}, which is not within the limit."
    return f"{label} is enough: {change}, {_percent(1.0 - cost.median / own.median)} less."


def _beyond_guard(point: Point, present: Point | None) -> str:
    """Which guarded error of a setting is beyond 1 and the present one's; empty where none is."""
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
        return "Errors are counted against it."
    return (
        f"Its {curve.error} is {_percent(share)} of the scene's largest torque against "
        f"{curve.against}; the limit of one knob is {_percent(limit)}, its part of the tolerance "
        f"of {_percent(tolerance)}."
    )


def _share(curve: Curve, point: Point) -> float | None:
    error = point.errors.get(curve.error)
    return error.share if error else None


def _within(curve: Curve, point: Point, limit: float) -> bool:
    share = _share(curve, point)
    return share is not None and share <= limit


def _overlap(a: Spread, b: Spread) -> bool:
    return a.low <= b.high and b.low <= a.high


def _percent(share: float | None) -> str:
    return "0 %" if not share else f"{100.0 * share:.2g} %"
