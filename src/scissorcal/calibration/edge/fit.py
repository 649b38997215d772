"""A blade's edge from photographs: a posterior of e(s), alpha(s) and the height over the scene."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from scissorcal.aliases import Array, Progress
from scissorcal.calibration.edge.candidates import EdgeComparison, compare_edges
from scissorcal.calibration.edge.cells import EdgeCells, FoundNick, cells_each, edge_cells
from scissorcal.calibration.edge.checks import blade_verdicts
from scissorcal.calibration.edge.model import CellData
from scissorcal.calibration.edge.result import Band, BladeFit, PhotographRow
from scissorcal.errors import InputError
from scissorcal.inference import Effort
from scissorcal.model import EdgeBelief, draw_edges, edge_height
from scissorcal.recipe.photograph_priors import BladePriors
from scissorcal.recipe.schema import Recipe
from scissorcal.vision.blade.measure import BladeMeasurement
from scissorcal.vision.blade.modes import smooth_slope

PLACES = 41
HEIGHT_DRAWS = 400


@dataclass(frozen=True)
class Blade:
    """Which blade is fitted; its length, where known, gives shapes without a scale their size."""

    name: str = "blade"
    length_m: float | None = None


def fit_blade(
    measured: Sequence[BladeMeasurement],
    recipe: Recipe | None,
    *,
    effort: Effort = "standard",
    rng: np.random.Generator,
    blade: Blade = Blade(),
    progress: Progress | None = None,
) -> BladeFit:
    """Fit one blade's edge to its measurements, one for each photograph.

    Raises InputError without any measurement, or where photographs with and without a scale are
    mixed.
    """
    if not measured:
        raise InputError("No photograph of a blade could be measured, so there is nothing to fit.")
    sized = tuple(_sized(one, blade.length_m) for one in measured)
    if len({one.metric for one in sized}) > 1:
        raise InputError(
            "Photographs with and without a scale cannot be fitted together: give --length-mm, or "
            "leave one kind out."
        )
    metric = sized[0].metric
    priors = recipe.fit.blade.priors if recipe else BladePriors()
    lengths = np.array([one.length for one in sized])
    length = float(np.median(lengths))
    cells = tuple(edge_cells(one, cells_each(len(sized))) for one in sized)
    best = compare_edges(CellData(cells, length), effort, rng, priors=priors, progress=progress)
    first = min(float(c.station[0]) for c in cells)
    last = max(float(c.station[-1]) for c in cells)
    station = np.linspace(first, last, PLACES)
    edges = best.belief.with_values(best.draws)
    rows = _rows(sized, cells, best)
    opening, contact, height = _height(best.belief, recipe, rng) if metric else _no_height()
    pivot = [
        float(np.sqrt(np.mean(np.sum(np.square(one.modes[:, _columns(one, "pivot")]), axis=1))))
        for one in sized
    ]
    fit = BladeFit(
        blade.name,
        best.belief,
        best.draws,
        best.rows,
        station,
        _band(edges.offset_at(station)),
        _band(np.arctan(edges.slope_at(station))),
        merged_nicks(cells),
        rows,
        float(lengths.std(ddof=1)) if len(lengths) > 1 else 0.0,
        float(np.median(pivot)),
        metric,
        opening,
        contact,
        height,
        (),
        _notes(sized, best, metric),
    )
    verdicts = blade_verdicts(fit, best.best, best.status, best.sentence, effort)
    return replace(fit, verdicts=verdicts)


def merged_nicks(photographs: Sequence[EdgeCells]) -> tuple[FoundNick, ...]:
    """Nicks as all photographs show them: one row each, those of one place averaged."""
    every = sorted((n for cells in photographs for n in cells.nicks), key=lambda n: n.station_m)
    groups: list[list[FoundNick]] = []
    for nick in every:
        last = groups[-1][-1] if groups else None
        near = last is not None and nick.station_m - last.station_m < 0.5 * (
            nick.width_m + last.width_m
        )
        if near:
            groups[-1].append(nick)
        else:
            groups.append([nick])
    return tuple(
        FoundNick(
            float(np.mean([n.station_m for n in group])),
            float(np.mean([n.width_m for n in group])),
            float(np.mean([n.depth_m for n in group])),
            ", ".join(dict.fromkeys(n.source for n in group)),
        )
        for group in groups
    )


def _sized(one: BladeMeasurement, length_m: float | None) -> BladeMeasurement:
    """The measurement in metres, or in blade lengths where nobody knows its size.

    The error of the length that gives the size stretches the edge along and across: a mode.
    """
    if one.metric:
        return one
    factor = (length_m or 1.0) / (one.unit_length or one.length)
    station, offset = one.station * factor, one.offset * factor
    slope = smooth_slope(station, offset) if len(station) > 4 else 0.0
    size = one.unit_length_sd * (offset - station * slope)
    return replace(
        one,
        station=station,
        offset=offset,
        sd=one.sd * factor,
        modes=np.column_stack([one.modes * factor, size]),
        mode_names=(*one.mode_names, "size"),
        length=one.length * factor,
        hole_radius=one.hole_radius * factor,
        metric=length_m is not None,
    )


def _columns(one: BladeMeasurement, name: str) -> list[int]:
    return [index for index, known in enumerate(one.mode_names) if known == name]


def _band(draws: Array) -> Band:
    low, high = np.quantile(draws, [0.05, 0.95], axis=0)
    return Band(draws.mean(axis=0), draws.std(axis=0, ddof=1), low, high)


def _height(
    belief: EdgeBelief, recipe: Recipe | None, rng: np.random.Generator
) -> tuple[Array, Array, Band | None]:
    """phi over the scene's openings and contacts."""
    if recipe is None:
        return _no_height()
    opening = np.radians(np.linspace(*recipe.scene.opening_deg, 7))
    contact = 1e-3 * np.linspace(*recipe.scene.contact_mm, 9)
    edges = draw_edges(belief, rng, HEIGHT_DRAWS)
    x, theta = np.meshgrid(contact, opening)
    view = edge_height(edges, x.ravel(), theta.ravel() / recipe.rig.moving_blades)
    shape = (-1, len(opening), len(contact))
    return opening, contact, _band(view.height.reshape(shape))


def _no_height() -> tuple[Array, Array, Band | None]:
    return np.empty(0), np.empty(0), None


def _rows(
    measured: Sequence[BladeMeasurement], cells: Sequence[EdgeCells], best: EdgeComparison
) -> tuple[PhotographRow, ...]:
    rows = []
    begin = 0
    for one, own in zip(measured, cells, strict=True):
        count = len(own.station)
        residual = best.residual[begin : begin + count]
        begin += count
        own_modes = [
            k for k, name in enumerate(own.mode_names) if name not in ("tone", "shared mapping")
        ]
        spread = float(np.sqrt(np.mean(np.sum(own.modes[:, own_modes] ** 2, axis=1))))
        rows.append(
            PhotographRow(
                one.source,
                len(one.station),
                one.edge.blur_px,
                one.edge.good_share,
                own.spoilt,
                one.length,
                float(residual.mean()),
                float(np.hypot(spread, best.best.between_m)),
                one.uncertainty,
                tuple(own.station.tolist()),
                tuple(residual.tolist()),
            )
        )
    return tuple(rows)


def _notes(
    measured: Sequence[BladeMeasurement], best: EdgeComparison, metric: bool
) -> tuple[str, ...]:
    notes = list(dict.fromkeys(one.uncertainty for one in measured))
    if not metric:
        notes.append(
            "The edge is known up to its size: lengths are in blade lengths. Give the blade's "
            "length (--length-mm) or the scale (--scale) to make it an edge that can be used."
        )
    first, last = (100.0 * share for share in measured[0].parts.halved)
    notes.append(
        f"The centreline is the line through the pivot that halves the blade between {first:.0f} "
        f"and {last:.0f} % of its length; the rig's opening must count from where the blades' "
        "centrelines meet."
    )
    notes.append(f"{best.sentence} {best.evaluations} evaluations of the edge's likelihood.")
    return tuple(notes)
