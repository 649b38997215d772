"""From records to curves: spreads, errors, the Pareto front and the recommended setting."""

import math
from collections.abc import Sequence
from dataclasses import replace
from statistics import median

from scissorcal.bench.trade.case import Case
from scissorcal.bench.trade.knob import Knob, scene_knobs
from scissorcal.bench.trade.pareto import pareto_front
from scissorcal.bench.trade.point import Curve, Error, Point, Sample, Setting, Spread
from scissorcal.bench.trade.recommend import recommend
from scissorcal.bench.trade.study import Record, sample_of


def limit_of(case: Case) -> float:
    """The share of the scene's largest torque by which one knob may be wrong.

    The scene's tolerance over the number of knobs that it has: errors of that size in all of them
    stay within the tolerance even where they add up.
    """
    return case.recipe.scene.tolerance_percent / 100.0 / max(len(scene_knobs(case)), 1)


def curve_of(case: Case, knob: Knob, records: Sequence[Record], limit: float) -> Curve:
    """The curve of one knob from its records, with the setting that is recommended.

    Settings without a record are named as unmeasured. ``limit`` is that of one knob (`limit_of`).
    """
    curve = measured_curve(case, knob, records)
    if curve.missing:
        return curve
    return recommend(curve, limit, case.recipe.scene.tolerance_percent / 100.0)


def measured_curve(
    case: Case, knob: Knob, records: Sequence[Record], against: Sample | None = None
) -> Curve:
    """The curve of one knob without a recommendation.

    ``against`` is a reference from elsewhere, in place of the knob's own.
    """
    curve = Curve(knob.name, knob.title, knob.cost, knob.error, against=knob.against)
    if why := knob.missing(case):
        return replace(curve, missing=why)
    own = {setting.label: setting for setting in knob.settings(case)}
    made = {label: [r for r in records if r["label"] == label] for label in own}
    best = _reference(own, made) if against is None else ""
    known = sample_of(_first(made[best])) if best else against
    points = [
        _point(case, knob, setting, made[label], known, best == label)
        for label, setting in own.items()
        if made[label]
    ]
    return replace(
        curve,
        points=_with_front(knob, points),
        against=f"{knob.against} ({best})" if best else knob.against,
        unmeasured=tuple(label for label in own if not made[label]),
    )


def reference_sample(case: Case, knob: Knob, records: Sequence[Record]) -> Sample | None:
    """The sample that errors of a knob are counted against; None where none was measured."""
    own = {setting.label: setting for setting in knob.settings(case)}
    made = {label: [r for r in records if r["label"] == label] for label in own}
    best = _reference(own, made)
    return sample_of(_first(made[best])) if best else None


def _first(records: Sequence[Record]) -> Record:
    """The record of the lowest repeat that did not fail."""
    return min((r for r in records if "failed" not in r), key=lambda r: r["repeat"])


def _reference(own: dict[str, Setting], made: dict[str, list[Record]]) -> str:
    """The label of the most accurate setting that was measured; empty where there is none.

    A setting that fails a check which the present one passes is no reference.
    """
    good = {label: [r for r in made[label] if "failed" not in r] for label in own}
    present = next((label for label in own if own[label].present and good[label]), "")
    passed = _rejected(good[present]) if present else None
    able = [
        setting
        for label, setting in own.items()
        if setting.accuracy > 0
        and good[label]
        and (passed is None or _rejected(good[label]) <= passed)
    ]
    return max(able, key=lambda one: one.accuracy).label if able else ""


def _rejected(records: Sequence[Record]) -> set[str]:
    return {check for record in records for check in record["rejected"]}


def _point(
    case: Case,
    knob: Knob,
    setting: Setting,
    records: Sequence[Record],
    reference: Sample | None,
    is_reference: bool,
) -> Point:
    good = sorted((r for r in records if "failed" not in r), key=lambda r: r["repeat"])
    if not good:
        return Point(setting, {}, {}, failed=records[0]["failed"])
    samples = [sample_of(record) for record in good]
    baseline = median(record["baseline_s"] for record in good)
    costs = {
        name: Spread.of([one.costs[name] for one in samples], baseline)
        for name in samples[0].costs
        if all(name in one.costs for one in samples)
    }
    # the first repeat of the reference is what errors are counted against: it has none itself
    judged = samples[1:] if is_reference else samples
    every = [knob.errors(case, one, reference) for one in judged]
    found = [{n: e for n, e in own.items() if math.isfinite(e.value)} for own in every]
    return Point(
        setting,
        costs,
        {name: _middle([one[name] for one in found if name in one]) for name in _names(found)},
        reference=is_reference,
        notes=tuple(dict.fromkeys(note for one in samples for note in one.notes)),
        rejected=tuple(dict.fromkeys(check for one in samples for check in one.rejected)),
    )


def _names(found: Sequence[object]) -> list[str]:
    return list(dict.fromkeys(name for one in found for name in one))  # type: ignore[attr-defined]


def _middle(errors: Sequence[Error]) -> Error:
    """The median of repeats."""
    shares = [error.share for error in errors if error.share is not None]
    return Error(
        float(median(error.value for error in errors)),
        errors[0].unit,
        float(median(shares)) if shares else None,
        errors[0].guarded,
    )


def _with_front(knob: Knob, points: Sequence[Point]) -> tuple[Point, ...]:
    """The points, with those on the Pareto front of main cost and main error marked.

    A reference that was measured once counts as free of error.
    """
    able = [
        point
        for point in points
        if knob.cost in point.costs and (knob.error in point.errors or point.reference)
    ]
    flags = pareto_front(
        [point.costs[knob.cost].median for point in able],
        [point.errors[knob.error].value if knob.error in point.errors else 0.0 for point in able],
    )
    on = {point.setting.label for point, flag in zip(able, flags, strict=True) if flag}
    return tuple(replace(point, front=point.setting.label in on) for point in points)
