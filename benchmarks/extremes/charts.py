"""How errors grow over one quantity: a line for each subject, and marks where it gives none."""

from collections import defaultdict

from benchmarks.extremes.quantities import QUANTITIES

from scissorcal.bench.extremes.compare import Judgement, Outcome
from scissorcal.bench.extremes.states import State
from scissorcal.report.extremes import LEAST_ERROR, WRONG_LOOK, error_of
from scissorcal.report.panel import Axis, Chart, Look, Series

LOOKS: dict[str, Look] = {"model": "blue", "kernel": "vermillion", "tables": "green"}
MARKED: tuple[tuple[str, tuple[Outcome, ...], float], ...] = (
    ("some refused or marked", ("refused", "flagged", "not compared"), 0.5),
    ("some wrong", ("wrong",), 2.5),
)
"""Marks at the foot: name, outcomes, and decades above `LEAST_ERROR`."""


def sweep_chart(name: str, answers: list[tuple[State, Judgement]]) -> Chart:
    """Largest relative error of the torque over one quantity, a line for each subject."""
    quantity = QUANTITIES[name]
    log = quantity.spacing not in ("linear", "sign-log")
    groups: dict[str, dict[float, list[Judgement]]] = {
        subject: defaultdict(list) for subject in LOOKS
    }
    for state, answer in answers:
        if state.swept == (name,):
            groups[answer.subject][state.values[name]].append(answer)
    least = min((v for values in groups.values() for v in values if v > 0.0), default=1.0)

    def place(value: float) -> float:
        """Where a value stands; on a logarithmic axis 0 stands a decade before the least."""
        return 0.1 * least if log and value <= 0.0 else value

    series = []
    for row, (subject, look) in enumerate(LOOKS.items()):
        values = sorted(groups[subject])
        x = tuple(place(value) for value in values)
        y = tuple(_drawn(groups[subject][value]) for value in values)
        series += [Series(subject, kind, x, y, look=look) for kind in ("line", "points")]
        for mark, outcomes, decades in MARKED:
            is_wrong = outcomes == ("wrong",)
            marked = [v for v in values if any(a.outcome in outcomes for a in groups[subject][v])]
            height = LEAST_ERROR * 10.0 ** (decades + 0.5 * row)
            series.append(
                Series(
                    f"{subject}, {mark}" if is_wrong else mark,
                    "points",
                    tuple(place(value) for value in marked),
                    (height,) * len(marked),
                    look=WRONG_LOOK if is_wrong else look,
                    style="full" if is_wrong else "open",
                )
            )
    label, unit = name.replace("_", " "), "" if quantity.unit == "1" else quantity.unit
    return Chart(
        f"sweep-{name}",
        label,
        Axis(label, unit, log=log),
        Axis("relative error of the torque", log=True, low=LEAST_ERROR, high=10.0),
        tuple(entry for entry in series if entry.x),
    )


def _drawn(answers: list[Judgement]) -> float | None:
    errors = [error for error in map(error_of, answers) if error is not None]
    return min(max(max(errors), LEAST_ERROR), 10.0) if errors else None
