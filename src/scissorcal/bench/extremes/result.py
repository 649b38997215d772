"""What a run of `bench extremes` ends in, as its JSON twin holds it."""

import json
import math
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from datetime import datetime
from typing import Literal

import numpy as np

from scissorcal.bench.extremes.cells import Cell, Outcome, Part
from scissorcal.bench.extremes.compare import Compared, Subject
from scissorcal.bench.extremes.quantities import QUANTITIES, Quantity
from scissorcal.bench.extremes.states import State
from scissorcal.bench.extremes.study import PAIRS, Done, Tried, unit_of
from scissorcal.bench.run import Run
from scissorcal.verdicts import Check, Verdict

ExtremesFormat = Literal["scissorcal-extremes/1"]
FORMAT: ExtremesFormat = "scissorcal-extremes/1"
Band = Literal["everyday", "extreme"]

SUBJECTS: tuple[Subject, ...] = ("model", "kernel", "tables")
OUTPUTS = ("torque", "force", "crack", "energy", "fracture", "arrest")
OUTCOMES: tuple[Outcome, ...] = ("right", "refused", "flagged", "not compared", "wrong")
MOST_WRONG = 50
Number = float | None
WRONG = Check(
    "bench wrong", "answers of model and kernel: those neither right nor refused", at_most=0.0
)


@dataclass(frozen=True)
class Largest:
    """Largest errors of one output over the states that were right."""

    output: str
    relative: float
    absolute: float


@dataclass(frozen=True)
class Total:
    """A subject over the states of the everyday, or of the extremes.

    ``median_relative`` is the torque's; ``displaced`` is the share of right states whose torque is
    explained by its own rounding alone, and ``roundings`` the largest displacement that one needed.
    """

    subject: Subject
    band: Band
    states: int
    outcomes: Mapping[Outcome, int]
    largest: tuple[Largest, ...]
    median_relative: Number
    undisplaced: Number
    roundings: Number


@dataclass(frozen=True)
class SweepPoint:
    """One value of a swept quantity: relative errors of the torque, and outcomes."""

    value: float
    subject: Subject
    largest: Number
    median: Number
    outcomes: Mapping[Outcome, int]


@dataclass(frozen=True)
class Sweep:
    """One quantity over its extreme range, all others everyday."""

    quantity: str
    unit: str
    log: bool
    points: tuple[SweepPoint, ...]


@dataclass(frozen=True)
class MapCell:
    """One place of a map: the torque's relative error where it is right, and the outcome."""

    first: float
    second: float
    error: Number
    outcome: Outcome


@dataclass(frozen=True)
class ErrorMap:
    """A pair of quantities over their extreme ranges, all others everyday."""

    first: str
    second: str
    subject: Subject
    cells: tuple[MapCell, ...]


@dataclass(frozen=True)
class Refusal:
    """Why a subject refuses, flags or is not compared, how often, and where it begins.

    ``begins`` names each swept quantity and the first and last of its values that got it.
    """

    subject: Subject
    outcome: Outcome
    sentence: str
    states: int
    begins: Mapping[str, tuple[float, float]]


@dataclass(frozen=True)
class Wrong:
    """A state at which a subject was wrong."""

    subject: Subject
    sentence: str
    state: State


@dataclass(frozen=True)
class CellRow:
    """A cell and what it found."""

    name: str
    part: Part
    extreme: str
    stated: str
    truth: str
    outcome: Outcome
    sentence: str
    error: Number
    allowed: Number
    states: int


@dataclass(frozen=True)
class Extremes:
    """A whole run. ``planned`` states were to be tried; a run with a time limit tries fewer.

    ``left_out`` names the cells that were not run: a reduced run leaves slow ones out, and one
    with a time limit those that did not fit. ``wrong`` are the first states at which something was
    wrong, at most `MOST_WRONG`.
    """

    format: ExtremesFormat
    created: datetime
    scissorcal_version: str
    machine: str
    workers: int
    seed: int
    seconds: float
    budget_s: Number
    planned: int
    states: int
    sentence: str
    quantities: tuple[Quantity, ...]
    totals: tuple[Total, ...]
    sweeps: tuple[Sweep, ...]
    maps: tuple[ErrorMap, ...]
    refusals: tuple[Refusal, ...]
    wrong: tuple[Wrong, ...]
    cells: tuple[CellRow, ...]
    left_out: tuple[str, ...] = ()

    @property
    def wrong_states(self) -> int:
        """How many wrong answers states have; ``wrong`` lists the first."""
        return sum(total.outcomes["wrong"] for total in self.totals)

    @property
    def verdicts(self) -> tuple[Verdict, ...]:
        """One verdict: nothing is wrong."""
        if not self.states and not self.cells:
            why = "No state was tried within the budget: allow more with --budget."
            return (WRONG.not_evaluated(why),)
        cells = sum(cell.outcome == "wrong" for cell in self.cells)
        count = self.wrong_states + cells
        listed = "Each is listed in the page"
        if self.wrong_states > len(self.wrong):
            first = f"The first {len(self.wrong)} of {self.wrong_states} wrong answers of states"
            listed = f"{first} are listed in the page" + (", and each wrong cell" if cells else "")
        remedy = f"{self.sentence} {listed}: report them."
        return (WRONG.judge(count, self.sentence, remedy),)


def summarise(run: Run, done: Iterable[Done], cells: Sequence[Cell]) -> Extremes:
    """Everything that a run found, from what its jobs found."""
    finished = list(done)
    tried = [one for part in finished for one in part.tried]
    rows = _cell_rows(finished, cells)
    ran = {row.name for row in rows}
    totals = tuple(
        _total(subject, band, tried) for subject in SUBJECTS for band in ("everyday", "extreme")
    )
    return Extremes(
        FORMAT,
        run.created,
        run.version,
        run.machine,
        run.workers,
        run.seed,
        run.seconds,
        run.budget_s,
        run.planned,
        len(tried),
        _sentence(totals, rows, (len(tried), run.planned), len(cells)),
        tuple(QUANTITIES.values()),
        totals,
        tuple(_sweep(name, tried) for name in dict.fromkeys(_swept(tried))),
        tuple(_map(pair, subject, tried) for pair in PAIRS for subject in SUBJECTS),
        _refusals(tried),
        _wrong(tried),
        rows,
        tuple(cell.name for cell in cells if cell.name not in ran),
    )


def extremes_text(result: Extremes) -> str:
    """The JSON twin."""
    from pydantic import TypeAdapter

    plain = TypeAdapter(Extremes).dump_python(result, mode="json")
    return json.dumps(plain, ensure_ascii=False, allow_nan=False, separators=(",", ":")) + "\n"


def _of(tried: Tried, subject: Subject) -> Compared:
    return next(one for one in tried.compared if one.subject == subject)


def _total(subject: Subject, band: Band, tried: Sequence[Tried]) -> Total:
    states = [one for one in tried if (one.state.plan == "everyday") == (band == "everyday")]
    found = [_of(one, subject) for one in states]
    right = [one for one in found if one.outcome == "right"]
    torque = [one.relative["torque"] for one in right if "torque" in one.relative]
    largest = []
    for name in OUTPUTS:
        relative = [one.relative[name] for one in right if name in one.relative]
        absolute = [one.absolute[name] for one in right if name in one.absolute]
        if absolute:
            largest.append(Largest(name, max(relative, default=0.0), max(absolute)))
    return Total(
        subject,
        band,
        len(states),
        _counted(found),
        tuple(largest),
        float(np.median(torque)) if torque else None,
        float(np.mean([one.roundings == 0.0 for one in right])) if right else None,
        max((one.roundings for one in right), default=None),
    )


def _counted(found: Sequence[Compared]) -> dict[Outcome, int]:
    counts = Counter(one.outcome for one in found)
    return {outcome: counts[outcome] for outcome in OUTCOMES}


def _swept(tried: Sequence[Tried]) -> list[str]:
    order = list(QUANTITIES)
    names = {one.state.swept[0] for one in tried if one.state.plan == "one"}
    return sorted(names, key=order.index)


def _sweep(name: str, tried: Sequence[Tried]) -> Sweep:
    groups: dict[tuple[float, Subject], list[Compared]] = defaultdict(list)
    for one in tried:
        if one.state.plan == "one" and one.state.swept == (name,):
            for compared in one.compared:
                groups[one.state.values[name], compared.subject].append(compared)
    points = []
    for (value, subject), found in sorted(groups.items()):
        errors = [one.relative["torque"] for one in found if _counts(one)]
        points.append(
            SweepPoint(
                value,
                subject,
                max(errors, default=None),
                float(np.median(errors)) if errors else None,
                _counted(found),
            )
        )
    log = QUANTITIES[name].spacing not in ("linear", "sign-log")
    return Sweep(name, unit_of(name), log, tuple(points))


def _map(pair: tuple[str, str], subject: Subject, tried: Sequence[Tried]) -> ErrorMap:
    cells = []
    for one in tried:
        if one.state.plan == "pair" and one.state.swept == pair:
            found = _of(one, subject)
            error = found.relative["torque"] if _counts(found) else None
            first, second = (one.state.values[name] for name in pair)
            cells.append(MapCell(first, second, error, found.outcome))
    return ErrorMap(*pair, subject, tuple(sorted(cells, key=lambda c: (c.first, c.second))))


def _counts(one: Compared) -> bool:
    return one.outcome in ("right", "flagged") and math.isfinite(
        one.relative.get("torque", math.nan)
    )


def _refusals(tried: Sequence[Tried]) -> tuple[Refusal, ...]:
    counts: Counter[tuple[Subject, Outcome, str]] = Counter()
    places: dict[tuple[Subject, Outcome, str], dict[str, list[float]]] = {}
    for one in tried:
        for found in one.compared:
            if found.outcome in ("right", "wrong"):
                continue
            key = (found.subject, found.outcome, _without_numbers(found.sentence))
            counts[key] += 1
            if one.state.plan == "one":
                name = one.state.swept[0]
                values = places.setdefault(key, {}).setdefault(name, [])
                values.append(one.state.values[name])
    return tuple(
        Refusal(
            *key,
            count,
            {name: (min(v), max(v)) for name, v in sorted(places.get(key, {}).items())},
        )
        for key, count in sorted(counts.items(), key=lambda item: (item[0][0], -item[1]))
    )


def _without_numbers(sentence: str) -> str:
    """A sentence less its own numbers, so that those of many states are one."""
    return " ".join(
        "..." if any(c.isdigit() for c in word) and not word.startswith("1e") else word
        for word in sentence.split()
    )


def _wrong(tried: Sequence[Tried]) -> tuple[Wrong, ...]:
    found = [
        Wrong(one.subject, one.sentence, tried_one.state)
        for tried_one in tried
        for one in tried_one.compared
        if one.outcome == "wrong"
    ]
    return tuple(found[:MOST_WRONG])


def _cell_rows(done: Sequence[Done], cells: Sequence[Cell]) -> tuple[CellRow, ...]:
    found = {one.cell: one.found for one in done if one.found is not None}
    rows = []
    for cell in cells:
        one = found.get(cell.name)
        if one is not None:
            facts = asdict(one) | {"error": _finite(one.error), "allowed": _finite(one.allowed)}
            own = {
                key: getattr(cell, key) for key in ("name", "part", "extreme", "stated", "truth")
            }
            rows.append(CellRow(**own, **facts))
    return tuple(rows)


def _finite(value: float) -> Number:
    return float(value) if math.isfinite(value) else None


def _sentence(
    totals: Sequence[Total], cells: Sequence[CellRow], states: tuple[int, int], every_cell: int
) -> str:
    """The run in a sentence; ``states`` are those tried and those planned."""
    counts = Counter(
        {
            o: sum(t.outcomes[o] for t in totals) + sum(c.outcome == o for c in cells)
            for o in OUTCOMES
        }
    )
    sum_of = sum(counts.values())
    tried = f"{states[0]} states and {len(cells)} cells"
    if states[0] < states[1] or len(cells) < every_cell:
        tried = f"{states[0]} of {states[1]} states and {len(cells)} of {every_cell} cells"
    return (
        f"{tried} were tried: of {sum_of} answers {counts['right']} are right to their stated "
        f"error, {counts['refused']} refused in a sentence, {counts['flagged']} marked as not to "
        f"be used, {counts['not compared']} not compared, and {counts['wrong']} wrong."
    )
