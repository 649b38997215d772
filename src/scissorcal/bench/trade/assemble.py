"""From records to curves: spreads, errors, the Pareto front and the recommended setting."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from statistics import median
from typing import NamedTuple

from scissorcal.bench.trade.case import Case
from scissorcal.bench.trade.knob import SAME_FITS, Knob, make_knob, scene_knobs
from scissorcal.bench.trade.next_capture import (
    FEWEST_CAPTURES,
    PRESENT_CHOICE,
    by_choice,
    next_capture,
    upper_limit,
)
from scissorcal.bench.trade.point import Curve, Error, Point, Sample, Setting, Spread
from scissorcal.bench.trade.recommend import Captures, barred, recommend, unsimulated
from scissorcal.bench.trade.study import Record, Task, records_of, sample_of
from scissorcal.bench.trade.torque import BAND_WORST, WORST

SCATTERING = (BAND_WORST,)
"""Main errors of fits against fits of the same capture: those that another capture changes."""


def limit_of(case: Case) -> float:
    """The share of the scene's largest torque by which one knob may be wrong.

    The scene's tolerance over the number of its knobs whose main error is one of torque. A cautious
    convention and no guarantee: knobs judge different errors (worst, average, of the band, of the
    ripple), whose sum bounds none of them.
    """
    count = sum(make_knob(name).of_torque for name in scene_knobs(case))
    return case.recipe.scene.tolerance_percent / 100.0 / max(count, 1)


def curve_of(
    case: Case,
    knob: Knob,
    records: Sequence[Record],
    limit: float,
    captures: Sequence[Record] = (),
) -> Curve:
    """The curve of one knob from its records, with the setting that is recommended.

    Settings without a record are named as unmeasured. ``limit`` is that of one knob (`limit_of`);
    ``captures`` hold the records of simulated captures.
    """
    curve = on_captures(measured_curve(case, knob, records), captures)
    if curve.missing:
        return curve
    found = _reference(case, knob, records)
    unsure = ""
    if found.gaps and not knob.stand_in:
        unsure = (
            f"No setting is recommended, since {found.gaps}: errors are to be counted against "
            f"{knob.against}."
        )
    tolerance = case.recipe.scene.tolerance_percent / 100.0
    return recommend(curve, limit, tolerance, unsure, captures_of(case, knob, captures))


def on_captures(curve: Curve, captures: Sequence[Record]) -> Curve:
    """The curve with what each setting gave on simulated captures, where two or more were made."""
    tried = by_choice(captures, WORST)
    known = tried.get(PRESENT_CHOICE, {})

    def judged(point: Point) -> Point:
        setting = point.setting
        key = PRESENT_CHOICE if setting.present else (curve.knob, setting.label)
        own = tried.get(key, {})
        both = sorted(known.keys() & own.keys())
        if len(both) < FEWEST_CAPTURES:
            return point
        found = next_capture([known[k] for k in both], [own[k] for k in both])
        return replace(point, next_capture=found)

    return replace(curve, points=tuple(judged(point) for point in curve.points))


def captures_of(case: Case, knob: Knob, captures: Sequence[Record]) -> Captures:
    """Whether a knob's settings need simulated captures, and how far its main error scatters.

    Settings that change the fits need them, where a capture can be simulated.
    """
    tried = by_choice(captures, knob.error if knob.error in SCATTERING else WORST)
    shares = list(tried.get(PRESENT_CHOICE, {}).values())
    fitted = knob.error in SCATTERING and len(shares) >= FEWEST_CAPTURES
    return Captures(
        refits(knob) and case.friction_fit is not None,
        upper_limit(shares) if fitted else None,
    )


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
    found = _Reference(knob.against) if against else _reference(case, knob, records)
    points = [
        _point(case, knob, setting, made[label], against or found.sample, found.label == label)
        for label, setting in own.items()
        if made[label]
    ]
    return replace(
        curve,
        points=_with_front(knob, points),
        against=found.against,
        unmeasured=tuple(label for label in own if not made[label]),
    )


def reference_of(case: Case, knob: Knob, records: Sequence[Record]) -> tuple[Sample | None, str]:
    """The sample that errors of a knob are counted against, None where there is none; in words."""
    found = _reference(case, knob, records)
    return found.sample, found.against


class _Reference(NamedTuple):
    """What errors are counted against: in words, its label and sample (none where it has neither).

    ``gaps`` say of each more accurate setting why it is not the reference; empty without any.
    """

    against: str
    label: str = ""
    sample: Sample | None = None
    gaps: str = ""


def _reference(case: Case, knob: Knob, records: Sequence[Record]) -> _Reference:
    """The most accurate setting that was measured.

    A setting that fails a check which the present one passes is no reference.
    """
    settings = knob.settings(case)
    good = {
        one.label: [r for r in records if r["label"] == one.label and "failed" not in r]
        for one in settings
    }
    tried = {r["label"] for r in records}
    present = next((one.label for one in settings if one.present and good[one.label]), "")
    passed = _rejected(good[present]) if present else None
    gaps: list[str] = []
    for one in sorted(settings, key=lambda one: -one.accuracy):
        if one.accuracy <= 0:
            break
        failed = _rejected(good[one.label]) - passed if passed is not None else set()
        if good[one.label] and not failed:
            first = min(good[one.label], key=lambda r: r["repeat"])
            said, label = "; ".join(gaps), one.label
            whole = f"{knob.against} ({label})"
            against = f"{label}, in place of {knob.against} ({said})" if gaps else whole
            return _Reference(against, label, sample_of(first), said)
        if failed:
            gaps.append(f"{one.label} fails the check {', '.join(sorted(failed))}")
        else:
            why = "gave no result" if one.label in tried else "was not measured"
            gaps.append(f"{one.label} {why}")
    return _Reference(knob.against, gaps="; ".join(gaps))


def _rejected(records: Sequence[Record]) -> set[str]:
    return {check for record in records for check in record["rejected"]}


def refits(knob: Knob) -> bool:
    """Whether settings of a knob change the fits, so that the next capture may judge otherwise."""
    return knob.combined and knob.name not in SAME_FITS


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
    unbounded = [
        f"{name} is {'infinite' if math.isinf(error.value) else 'not known'}"
        for own in every
        for name, error in own.items()
        if error.guarded and not math.isfinite(error.value)
    ]
    return Point(
        setting,
        costs,
        {name: _middle([one[name] for one in found if name in one]) for name in _names(found)},
        reference=is_reference,
        notes=tuple(dict.fromkeys(note for one in samples for note in one.notes)),
        rejected=tuple(dict.fromkeys(check for one in samples for check in one.rejected)),
        unbounded=tuple(dict.fromkeys(unbounded)),
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


def pareto_front(costs: Sequence[float], errors: Sequence[float]) -> tuple[bool, ...]:
    """Which of the points (n,) no other one dominates: lower in one, no higher in the other.

    >>> pareto_front([1.0, 2.0, 3.0], [0.5, 0.6, 0.1])
    (True, False, True)
    """
    points = list(zip(costs, errors, strict=True))
    return tuple(
        not any(a <= cost and b <= error and (a, b) != (cost, error) for a, b in points)
        for cost, error in points
    )


def without_prospect(case: Case, names: Sequence[str], records: Iterable[Record]) -> set[Task]:
    """The tasks of the knobs named that can lead to no recommendation; all others come first.

    A setting can be recommended where the error is one of torque and it is cheaper than the present
    one; the present setting and the reference are needed beside it. Once every cheaper setting of a
    knob that was measured fails a check, or needs more than is allowed, the others of it wait.
    Repeats wait too: they tell how certain a cost is, and the first measurement tells most of it.
    """
    every, found = list(records), set[Task]()
    for name in names:
        knob = make_knob(name)
        settings = knob.settings(case)
        place = next(i for i, one in enumerate(settings) if one.present)
        cheaper = {one.label for one in settings[:place]} if knob.of_torque else set[str]()
        best = max(settings, key=lambda one: one.accuracy)
        wanted = {*cheaper, settings[place].label, best.label} if cheaper else set[str]()
        own = records_of(case, name, every)
        bad = barred(measured_curve(case, knob, own))
        tried = cheaper & {record["label"] for record in own}
        if tried and tried <= bad:
            wanted = set()
        for setting in settings:
            for repeat in range(knob.repeats(case, setting)):
                if repeat or setting.label not in wanted:
                    found.add(Task(name, setting.label, repeat))
    return found


def to_simulate(
    case: Case, names: Sequence[str], records: Sequence[Record]
) -> list[tuple[str, str]]:
    """Of each knob named, the setting that is to be tried on simulated captures next, if any.

    As (knob, label): the cheapest one that would be recommended if it holds there.
    """
    limit, found = limit_of(case), []
    for name in names:
        knob = make_knob(name)
        curve = measured_curve(case, knob, records_of(case, name, records))
        judged = on_captures(curve, records)
        point = unsimulated(judged, limit, captures_of(case, knob, records))
        if point is not None:
            found.append((name, point.setting.label))
    return found
