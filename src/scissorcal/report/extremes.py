"""The panels of `bench extremes`: where numbers stop being right, and what is said there."""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from scissorcal.report.numbers import short
from scissorcal.report.panel import Axis, Chart, Look, Panel, Row, Series, count, number, words
from scissorcal.verdicts import Check

if TYPE_CHECKING:
    from scissorcal.bench.extremes.compare import Judgement
    from scissorcal.bench.extremes.states import State

    Tried = Sequence[tuple[State, Sequence[Judgement]]]
    Answers = Sequence[tuple[State, Judgement]]

WRONG = Check("bench wrong", "answers that are neither right nor refused", at_most=0.0)
PART = "extremes"
OUTCOMES = ("right", "refused", "flagged", "not compared", "wrong")
LOOKS: Mapping[str, Look] = {"model": "blue", "kernel": "vermillion", "package": "green"}
WRONG_LOOK: Look = "purple"
"""How states are drawn at which something is wrong."""
LEAST_ERROR = 1e-17
"""Errors below are drawn here: no float64 number is closer."""


def extremes_panels(tried: Tried, long_run: Judgement) -> list[Panel]:
    """All panels, in order: totals with the verdict, the long run, refusals, maps."""
    answers = [(state, answer) for state, judgements in tried for answer in judgements]
    subjects = dict.fromkeys(answer.subject for _, answer in answers)
    maps = [_maps_panel([a for a in answers if a[1].subject == name]) for name in subjects]
    said = f"{long_run.outcome.capitalize()}: {long_run.sentence}."
    run = Panel("long-run", PART, "A long run", said)
    return [totals_panel(answers, [long_run.outcome]), run, refusals_panel(answers), *maps]


def totals_panel(answers: Answers, outcomes: Sequence[str] = ()) -> Panel:
    """How many answers are right, and their largest errors, by subject and band.

    ``outcomes`` of what is no single state count in the sentence and in the verdict.
    """
    groups: dict[str, list[Judgement]] = defaultdict(list)
    for state, answer in answers:
        groups[f"{answer.subject}, {state.band}"].append(answer)
    of = Counter([*outcomes, *(answer.outcome for _, answer in answers)])
    sentence = (
        f"Of {of.total()} answers {of['right']} are right to their stated error, {of['refused']} "
        f"refused in a sentence, {of['flagged']} marked as not to be used, {of['not compared']} "
        f"not compared, and {of['wrong']} wrong."
    )
    remedy = f"{sentence} What is wrong is listed: report it."
    return Panel(
        "totals", PART, "Largest errors", sentence,
        tuple(_total(name, group) for name, group in groups.items()),
        verdicts=(WRONG.judge(of["wrong"], sentence, remedy),),
        caption="Largest errors over the states that were right, by output. Near the first contact "
        "a torque is a difference of nearly equal lengths, so its relative error grows without "
        "limit while it is right for a plate that stands a few roundings elsewhere. Roundings: the "
        "largest such displacement that was needed.",
    )  # fmt: skip


def _total(name: str, answers: Sequence[Judgement]) -> Row:
    right = [answer for answer in answers if answer.outcome == "right"]
    errors = [answer.error for answer in right if math.isfinite(answer.error)]
    absolute = [answer.error_Nm for answer in right if math.isfinite(answer.error_Nm)]
    of = Counter(str(answer.outcome) for answer in answers)
    values = (
        count("states", len(answers)),
        *(count(outcome, of[outcome]) for outcome in OUTCOMES),
        number("torque, median relative", np.median(errors) if errors else None, digits=2),
        number("torque, relative", max(errors, default=None), digits=2),
        number("torque", max(absolute, default=None), "N m", digits=2),
        number("roundings", max((answer.roundings for answer in right), default=None), digits=2),
    )
    return Row(name, values)


def _maps_panel(answers: Answers) -> Panel:
    """Maps of one subject's errors over pairs of quantities."""
    subject = answers[0][1].subject
    pairs = dict.fromkeys(state.swept for state, _ in answers if len(state.swept) == 2)
    return Panel(
        f"maps-{subject}", PART, f"Maps: {subject}",
        "Numbers are decimal logarithms of the torque's relative error; dots are refused states, "
        "purple diamonds wrong ones; a blank place has no torque to compare. Values, in SI units, "
        "are spaced evenly in number, from one end of the extreme range to the other.",
        charts=tuple(map_chart([a for a in answers if a[0].swept == pair]) for pair in pairs),
    )  # fmt: skip


def map_chart(answers: Answers) -> Chart:
    """Decimal logarithm of the torque's relative error over a pair; dots where it has none."""
    pair, subject = answers[0][0].swept, answers[0][1].subject
    axes = [sorted({state.values[name] for state, _ in answers}) for name in pair]
    kinds: tuple[tuple[str, Look], ...] = (("refused", "muted"), ("wrong", WRONG_LOOK))
    chosen = {name: [a for a in answers if a[1].outcome == name] for name, _ in kinds}
    chosen["log10 of the relative error"] = [a for a in answers if error_of(a[1]) is not None]
    series = []
    for name, look in (("log10 of the relative error", LOOKS.get(subject, "green")), *kinds):
        x, y = (
            tuple(float(axis.index(state.values[key])) for state, _ in chosen[name])
            for axis, key in zip(axes, pair, strict=True)
        )
        errors = [max(error_of(answer) or 0.0, LEAST_ERROR) for _, answer in chosen[name]]
        logs = () if name in OUTCOMES else tuple(math.log10(error) for error in errors)
        series.append(Series(name, "cells" if logs else "points", x, y, value=logs, look=look))
    across, up = (
        f"{_plain(name)}, {short(axis[0])} to {short(axis[-1])}"
        for name, axis in zip(pair, axes, strict=True)
    )
    return Chart(
        f"map-{subject}-{'-'.join(pair)}",
        " and ".join(map(_plain, pair)),
        Axis(f"{across} (number of the value)", low=-0.6, high=len(axes[0]) - 0.4),
        Axis(up, low=-0.6, high=len(axes[1]) - 0.4),
        tuple(entry for entry in series if entry.x),
    )


def refusals_panel(answers: Answers) -> Panel:
    """Each sentence of what is not right, how often, and where it begins; what is wrong first."""
    groups: dict[tuple[str, str, str], list[State]] = defaultdict(list)
    for state, answer in answers:
        if answer.outcome == "wrong":
            numbers = ", ".join(f"{name} {value!r}" for name, value in state.values.items())
            groups[answer.subject, "wrong", f"{answer.sentence} ({numbers})"].append(state)
        elif answer.outcome != "right":
            groups[answer.subject, answer.outcome, answer.sentence].append(state)
    rows = []
    order = sorted(groups, key=lambda key: (key[1] != "wrong", key[0], -len(groups[key])))
    for place, key in enumerate(order):
        spans: dict[str, list[float]] = defaultdict(list)
        for state in groups[key]:
            if len(state.swept) == 1:
                spans[state.swept[0]].append(state.values[state.swept[0]])
        begins = [f"{_plain(n)} {short(min(v))} to {short(max(v))}" for n, v in spans.items()]
        where = "; ".join(sorted(begins)) or "only where several quantities are extreme"
        if any(state.band == "scene" and not state.swept for state in groups[key]):
            where = "within the scene"
        cells = (count("states", len(groups[key])), words("where it begins", where))
        name = f"{place + 1}, {key[0]}, {key[1]}"
        rows.append(Row(name, cells, note=key[2], marked=key[1] == "wrong"))
    return Panel(
        "refusals", PART, "Where refusals begin",
        "Each sentence, how often it was given, and the first and last value of each quantity that "
        "got it while all others were ordinary.", tuple(rows),
    )  # fmt: skip


def error_of(answer: Judgement) -> float | None:
    """The torque's relative error where there is a number to be used or to be warned of."""
    known = answer.outcome in ("right", "flagged") and math.isfinite(answer.error)
    return answer.error if known else None


def _plain(name: str) -> str:
    return name.replace("_", " ")
