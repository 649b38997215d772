"""The posterior: parameters, what it adds to the prior, correlations, diagnostics."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.caveats import (
    COLUMN,
    NOT_KNOWN,
    caveats_by_parameter,
    next_recording_sd,
    next_recording_sentence,
)
from scissorcal.calibration.parameters import FittedParameter
from scissorcal.calibration.result import PRIOR_ONLY, FitResult
from scissorcal.report.numbers import Number, finite, scalar, shown_unit, significant
from scissorcal.report.panel import (
    Axis,
    Chart,
    Panel,
    Row,
    Value,
    absent,
    count,
    curve,
    number,
    points,
    words,
)
from scissorcal.report.reduce import thinned

MOST_PAIRS = 6
MOST_DOTS = 150
STRONG = 0.8
"""Correlation from which two parameters are said to trade against each other."""
BINS = 40
WIDE = 20.0
"""A range whose ends differ by this factor is drawn over a logarithmic axis."""
NINETY_PERCENT = 4.605
"""Squared radius that holds 90 % of a normal distribution in the plane."""

MEANINGS = {
    "k_hat": "Tail of the importance weights, which the check k-hat judges.",
    "effective_samples": "Number of independent draws that the posterior's are worth.",
    "evaluations": "Number of evaluations of the model.",
    "observations": "Number of bins in the likelihood.",
    "independent_share": "Share of the bins that are independent.",
    "whiteness_p": "Probability of residuals at least this correlated if they were white.",
    "first_lag_autocorrelation": "Autocorrelation of the residuals at the first lag.",
    "largest_inflation": "Factor by which autocorrelation widened the widest interval.",
    "residual_rms": "Root mean square of measured minus model.",
    "relative_error": "The same over the root mean square of what was measured.",
    "r_squared": "Share of the variance of the data that the law explains.",
    "starts_agreeing": "Starts of the search that ended at the same place.",
    "search": "How the search ended.",
    "rate_floor": "Slower samples are left out, because the sign of their rate is noise.",
    "bin_s": "Length of a bin, s.",
    "noise": "Standard deviation of the residuals.",
    "step_version": "Version of the step that made the fit; another version may fit otherwise.",
}


@dataclass(frozen=True)
class Correlation:
    """Correlation of two parameters' posterior."""

    first: str
    second: str
    value: float


def parameters_panel(fit: FitResult, part: str) -> Panel:
    """One row per parameter, then what follows from them: mean, interval, data or prior."""
    caveats = caveats_by_parameter(fit)
    every = (*fit.parameters, *fit.derived)
    if not every:
        return absent(f"{part}-parameters", part, "Parameters", "The fit has no parameters.")
    rows = tuple(_row(fit, parameter, caveats.get(parameter.name, ())) for parameter in every)
    silent = prior_only(fit)
    sentence = (
        f"The data do not inform {', '.join(silent)}: the posterior repeats the prior."
        if silent
        else "The data inform every parameter."
    )
    sentence = f"{sentence} {next_recording_sentence(fit)}".strip()
    return Panel(
        f"{part}-parameters",
        part,
        "Parameters",
        sentence,
        rows,
        caption="Posterior mean ± standard deviation where they agree with the quantiles, and the "
        "interval that holds the truth with 90 % probability if the model is right. Next recording "
        "is the standard deviation by which single recordings differ. Posterior / prior is the "
        f"ratio of their standard deviations: up to {PRIOR_ONLY} the data identify the parameter, "
        "above it the value is the prior's.",
    )


def prior_only(fit: FitResult) -> tuple[str, ...]:
    """Names of the parameters whose posterior repeats the prior."""
    every = (*fit.parameters, *fit.derived)
    return tuple(p.name for p in every if _word(p) == "prior only")


def prior_panel(fit: FitResult, part: str) -> Panel:
    """Both densities by parameter, and their quantiles."""
    title, id_ = "Prior against posterior", f"{part}-prior"
    prior = fit.prior_draws
    if prior is None or len(prior) < 3 or not np.all(np.isfinite(fit.draws)):
        why = f"This fit keeps no draws of its prior: run `scissorcal fit {fit.words} --force`."
        return absent(id_, part, title, why)
    rows = []
    for i, parameter in enumerate(fit.parameters):
        scale, unit = shown_unit(parameter.unit)
        ends = [np.quantile(scale * draws[:, i], [0.05, 0.5, 0.95]) for draws in (prior, fit.draws)]
        narrowed = None if parameter.measured_prior else finite(parameter.identifiability)
        rows.append(
            Row(
                plain_name(parameter),
                (
                    number("prior median", ends[0][1], unit, low=ends[0][0], high=ends[0][2]),
                    number("posterior median", ends[1][1], unit, low=ends[1][0], high=ends[1][2]),
                    number("posterior / prior", narrowed, digits=2),
                ),
                marked=(narrowed or 0.0) > PRIOR_ONLY,
            )
        )
    silent = [row.name for row in rows if row.marked]
    sentence = (
        f"The data add nothing to the prior of {', '.join(silent)}."
        if silent
        else "The data narrow every parameter well beyond its prior."
    )
    charts = tuple(_density(fit, i, f"{id_}-{i}") for i in range(len(fit.parameters)))
    caption = "Medians with the interval that holds 90 %, before and after the data."
    return Panel(id_, part, title, sentence, tuple(rows), charts, caption=caption)


def correlate(fit: FitResult) -> tuple[Correlation, ...]:
    """Every pair of parameters, the most strongly correlated first; empty without numbers."""
    if len(fit.draws) < 3 or len(fit.parameters) < 2 or not np.all(np.isfinite(fit.draws)):
        return ()
    names = [parameter.name for parameter in fit.parameters]
    moving = fit.draws.std(axis=0) > 0
    with np.errstate(invalid="ignore", divide="ignore"):
        matrix = np.corrcoef(fit.draws, rowvar=False).reshape(len(names), len(names))
    found = [
        Correlation(names[i], names[j], float(matrix[i, j]))
        for i in range(len(names))
        for j in range(i)
        if moving[i] and moving[j] and np.isfinite(matrix[i, j])
    ]
    return tuple(sorted(found, key=lambda pair: -abs(pair.value)))


def correlations_panel(fit: FitResult, part: str) -> Panel:
    """Every pair with its correlation; the draws of the strongest pairs."""
    title, id_ = "Correlations of the posterior", f"{part}-pairs"
    pairs = correlate(fit)
    if not pairs:
        return absent(id_, part, title, "There are no two parameters with numbers to compare.")
    strong = [pair for pair in pairs if abs(pair.value) >= STRONG]
    if strong:
        named = ", ".join(
            f"{p.first} with {p.second} ({significant(p.value, 2)})" for p in strong[:6]
        )
        sentence = f"The sum or ratio of these is known better than either: {named}."
    else:
        top = pairs[0]
        sentence = (
            f"No correlation reaches {STRONG}; the strongest is {top.first} with {top.second}, "
            f"{significant(top.value, 2)}."
        )
    rows = tuple(
        Row(f"{p.first}, {p.second}", (number("correlation", p.value, digits=2),),
            marked=abs(p.value) >= STRONG)
        for p in pairs
    )  # fmt: skip
    charts = tuple(
        _pair(fit, pair, f"{id_}-{place}") for place, pair in enumerate(pairs[:MOST_PAIRS])
    )
    return Panel(id_, part, title, sentence, rows, charts)


def diagnostics_panel(fit: FitResult, part: str) -> Panel:
    """The diagnostics of the inference, each with what it tells, and the fit's notes."""
    title, id_ = "Diagnostics and notes", f"{part}-diagnostics"
    rows = tuple(
        Row(str(name), (_diagnostic(scalar(value)), words("meaning", MEANINGS.get(name, " "))))
        for name, value in fit.diagnostics.items()
        if not isinstance(value, list | tuple | dict)
    )
    if not rows and not fit.notes:
        return absent(id_, part, title, "The fit states none.")
    return Panel(id_, part, title, rows=rows, notes=fit.notes)


def plain_name(parameter: FittedParameter) -> str:
    """A parameter's name without a unit in which it is not shown."""
    return parameter.name.removesuffix("_rad") if parameter.unit == "rad" else parameter.name


def _word(parameter: FittedParameter) -> str:
    """In a word, where a parameter's value comes from."""
    ratio = finite(parameter.identifiability)
    if parameter.measured_prior:
        return "measured before"
    if ratio is None:
        return "not available"
    return "identified" if ratio <= PRIOR_ONLY else "prior only"


def _row(fit: FitResult, parameter: FittedParameter, caveats: tuple[str, ...]) -> Row:
    scale, unit = shown_unit(parameter.unit)

    def scaled(value: float) -> Number:
        known = finite(value)
        return None if known is None else scale * known

    word = _word(parameter)
    mean = Value("mean", scaled(parameter.mean), unit, sd=scaled(parameter.sd), digits=4)
    if mean.number is not None and parameter.moments is None:
        mean = words("mean", "see the median")
    apart = next_recording_sd(fit, parameter)
    another = words(COLUMN, NOT_KNOWN)
    if apart is not None:
        another = number(COLUMN, scaled(apart), unit, digits=2)
    return Row(
        plain_name(parameter),
        (
            words("meaning", parameter.meaning or " "),
            mean,
            Value(
                "median, 90 %",
                scaled(parameter.q50),
                unit,
                low=scaled(parameter.q05),
                high=scaled(parameter.q95),
            ),
            another,
            number("posterior / prior", parameter.identifiability, digits=2),
            words("data or prior", word),
        ),
        note=" ".join(f"Known to be poor: {sentence}" for sentence in caveats),
        marked=word == "prior only" or bool(caveats),
    )


def _diagnostic(value: object) -> Value:
    if isinstance(value, bool):
        return words("value", "yes" if value else "no")
    if isinstance(value, int):
        return count("value", value)
    if isinstance(value, str):
        return words("value", value or " ")
    return number("value", value, digits=4)


def _density(fit: FitResult, place: int, id_: str) -> Chart:
    assert fit.prior_draws is not None
    parameter = fit.parameters[place]
    scale, unit = shown_unit(parameter.unit)
    prior, after = scale * fit.prior_draws[:, place], scale * fit.draws[:, place]
    low, high = np.quantile(np.concatenate([prior, after]), [0.02, 0.98])
    low, high = min(low, after.min()), max(high, after.max())
    log = bool(low > 0 and high > WIDE * low)
    edges = np.linspace(low, high if high > low else low + 1.0, BINS)
    if log:
        edges = np.geomspace(low, high, BINS)
    series = []
    for name, values, look, style in (
        ("prior", prior, "vermillion", "dashed"),
        ("posterior", after, "blue", "full"),
    ):
        heights = np.histogram(values, edges)[0].astype(np.float64)
        steps = np.repeat(heights / max(float(heights.max()), 1.0), 2)
        series.append(curve(name, np.repeat(edges, 2)[1:-1], steps, look, style=style))  # type: ignore[arg-type]
    name = plain_name(parameter).replace("_", " ")
    return Chart(
        id_,
        name,
        Axis(name, unit, log=log),
        Axis("density, scaled", low=0.0),
        tuple(series),
        "Prior and posterior, each scaled to its own height.",
        small=True,
    )


def _pair(fit: FitResult, pair: Correlation, id_: str) -> Chart:
    names = [parameter.name for parameter in fit.parameters]
    ends, columns = [], []
    for name in (pair.first, pair.second):
        at = names.index(name)
        scale, unit = shown_unit(fit.parameters[at].unit)
        columns.append(scale * fit.draws[:, at])
        ends.append(Axis(plain_name(fit.parameters[at]).replace("_", " "), unit))
    some = thinned(np.arange(len(fit.draws)), MOST_DOTS)
    x, y = columns
    return Chart(
        id_,
        f"{ends[0].label} and {ends[1].label}",
        ends[0],
        ends[1],
        (points("draws", x[some], y[some]), curve("90 % if normal", *_ellipse(x, y))),
        f"Correlation {significant(pair.value, 2)}.",
        small=True,
    )


def _ellipse(x: Array, y: Array) -> tuple[Array, Array]:
    values, vectors = np.linalg.eigh(np.cov(x / x.std(), y / y.std()))
    angle = np.linspace(0, 2 * np.pi, 60)
    circle = np.stack([np.cos(angle), np.sin(angle)])
    ring = vectors @ (np.sqrt(NINETY_PERCENT * np.maximum(values, 0))[:, None] * circle)
    return x.mean() + x.std() * ring[0], y.mean() + y.std() * ring[1]
