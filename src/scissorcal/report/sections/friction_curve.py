"""Friction itself over the rate: the law with its band, and what of the data belongs to it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scissorcal.calibration.result import FitResult
from scissorcal.model.friction import FrictionLaw, friction_torque
from scissorcal.report.numbers import Number, finite, finite_each, unit_text, with_unit
from scissorcal.report.reduce import Array, thinned
from scissorcal.report.sections.torque import effort_word, position_word
from scissorcal.report.strokes import StrokeSamples
from scissorcal.report.svg import INK, MUTED, PANEL, Svg, finish, look_of, new_axes

POINTS_EACH_WAY = 40
SLOWEST_SHARE = 5e-3
MOST_DRAWS = 300
MOST_DOTS = 900


@dataclass(frozen=True)
class FrictionCurve:
    """The law at one opening: arrays over ``rate``, in the fit's units.

    ``friction`` is the posterior mean, ``band_low`` and ``band_high`` its 5 % and 95 %.
    """

    opening: Number
    rate: tuple[Number, ...]
    friction: tuple[Number, ...]
    band_low: tuple[Number, ...]
    band_high: tuple[Number, ...]


def trace_friction(fit: FitResult) -> FrictionCurve | None:
    """The law from standstill to the fastest measured rate; None for a cut or without numbers."""
    rates = np.abs(fit.series.opening_rate)
    rates = rates[np.isfinite(rates)]
    if fit.what != "friction" or len(rates) == 0 or not np.all(np.isfinite(fit.draws)):
        return None
    fastest = float(rates.max())
    if fastest <= 0:
        return None
    one_way = np.geomspace(SLOWEST_SHARE * fastest, fastest, POINTS_EACH_WAY)
    rate = np.concatenate([-one_way[::-1], one_way])
    draws = fit.draws[thinned(np.arange(len(fit.draws)), MOST_DRAWS)]
    center = _center(fit)
    curves = friction_of(fit, draws[:, :, None], np.asarray(center), rate[None, :])
    low, high = np.quantile(curves, [0.05, 0.95], axis=0)
    return FrictionCurve(
        finite(center),
        finite_each(rate),
        finite_each(curves.mean(axis=0)),
        finite_each(low),
        finite_each(high),
    )


def draw_friction(
    fit: FitResult, strokes: tuple[StrokeSamples, ...], curve: FrictionCurve | None, anchor: str
) -> tuple[Svg, ...]:
    """The curve among partial residuals: what is measured, less all of the model but friction."""
    if curve is None:
        return ()
    figure, axes = new_axes(PANEL)
    series = fit.series
    own = friction_of(fit, fit.map_point[:, None], series.opening, series.opening_rate)
    partial = own + series.measured - series.predicted
    kinds = list(dict.fromkeys(stroke.name.kind for stroke in strokes))
    for kind in kinds:
        places = np.concatenate([s.places for s in strokes if s.name.kind == kind])
        some = thinned(places, MOST_DOTS // len(kinds))
        colour, marker = look_of(kind)
        axes.plot(
            series.opening_rate[some], partial[some], marker, color=colour, ms=2.6, mew=0, alpha=0.4
        )
    rate, middle, low, high = (
        np.array(values, dtype=np.float64)
        for values in (curve.rate, curve.friction, curve.band_low, curve.band_high)
    )
    for way in (rate < 0, rate > 0):
        axes.fill_between(rate[way], low[way], high[way], color=INK, alpha=0.25, lw=0)
        axes.plot(rate[way], middle[way], color=INK, lw=1.2)
    axes.axhline(0, color=MUTED, lw=0.8)
    axes.set_xlabel(f"{position_word(fit)} rate [{fit.position_unit}/s]")
    axes.set_ylabel(f"friction {effort_word(fit)} [{unit_text(fit.effort_unit)}]")
    caption = (
        f"The law at {with_unit(curve.opening, fit.position_unit)}. Dots are what was measured, "
        "less the model's inertia and offset."
    )
    reading = f"{caption} At the fastest closing and opening it is {_ends(fit, curve)}."
    title = f"Friction over the {position_word(fit)} rate"
    return (finish(figure, f"{anchor}-friction", title, caption, reading),)


def friction_of(fit: FitResult, columns: Array, opening: Array, rate: Array) -> Array:
    """The law for parameters ``columns``, whose axis of parameters is the last but one."""
    named = {p.name: np.take(columns, i, axis=-2) for i, p in enumerate(fit.parameters)}
    return friction_torque(FrictionLaw.of_fit(named, _center(fit)), opening, rate)


def _center(fit: FitResult) -> float:
    center = finite(fit.structure.get("angle_center"))
    return float(np.nanmedian(fit.series.opening)) if center is None else center


def _ends(fit: FitResult, curve: FrictionCurve) -> str:
    first, last = (with_unit(curve.friction[place], fit.effort_unit) for place in (0, -1))
    return f"{first} and {last}"
