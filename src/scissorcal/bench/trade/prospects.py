"""Which measurements can lead to a recommendation: a budget is spent on them before others."""

from collections.abc import Iterable, Sequence

from scissorcal.bench.trade.assemble import (
    captures_of,
    limit_of,
    measured_curve,
    on_captures,
)
from scissorcal.bench.trade.case import Case
from scissorcal.bench.trade.knob import make_knob
from scissorcal.bench.trade.recommend import barred, unsimulated
from scissorcal.bench.trade.study import Record, Task, records_of


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
