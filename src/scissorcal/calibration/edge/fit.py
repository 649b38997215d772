"""Fit a blade's edge to its photographs: families compared by their evidence."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from scissorcal.aliases import Array, Progress
from scissorcal.calibration.candidates import Account, compare
from scissorcal.calibration.edge.cells import EdgeCells, cells_each, edge_cells, merged_nicks
from scissorcal.calibration.edge.checks import blade_verdicts
from scissorcal.calibration.edge.model import (
    FAMILIES,
    MOST_EVALUATIONS,
    CellData,
    EdgeEvidence,
    Family,
    basis_of,
    search,
)
from scissorcal.calibration.edge.result import (
    Band,
    BladeFit,
    EdgeCandidate,
    PhotographRow,
)
from scissorcal.errors import InputError, check_known
from scissorcal.inference import Effort, InferOptions, Optimum
from scissorcal.inference.infer import infer
from scissorcal.inference.problem import SamplingStatus
from scissorcal.model import Edge, EdgeDistribution, draw_edges, edge_height
from scissorcal.recipe.priors import BladePriors
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
    recipe: Recipe | None = None,
    *,
    effort: Effort = "standard",
    rng: np.random.Generator,
    blade: Blade = Blade(),
    progress: Progress | None = None,
) -> BladeFit:
    """Fit one blade's edge to its measurements, one for each photograph.

    ``measured`` is what `scissorcal.vision.measure_edge` measured; ``recipe`` gives the priors and
    the openings and contacts over which the edge's height is given, None the usual priors and no
    height. ``effort`` is "draft", "standard" or "thorough", ``blade`` the name and, for shapes
    without a scale, the length.

    Raises UnknownNameError where there is no such effort, InputError without any measurement, or
    where photographs with and without a scale are mixed.

    Two rendered photographs; the true edge is in the 90 % band, e(s) in metres:

    >>> import numpy as np
    >>> from scissorcal.vision import (
    ...     BLADE_MAT, BladeShape, Camera, Lens, Looks, SimPose, blade_layer, measure_edge, render,
    ...     target_layers,
    ... )
    >>> camera = Camera(900.0, 900.0, 499.5, 374.5, (0.0,) * 5, 1000, 750)
    >>> lens = Lens(900.0, (499.5, 374.5), 1000, 750)
    >>> shape = BladeShape(length_m=0.075, taper_rad=0.035, back_slope=-np.tan(0.035))
    >>> measured = []
    >>> for n in range(2):
    ...     pose = SimPose.looking_at((0.126, 0.09), 0.275, tilt=0.1, azimuth=3.0 * n)
    ...     layers = [*target_layers(BLADE_MAT, pose), blade_layer(shape, pose, (0.062, 0.0885))]
    ...     picture = render(layers, lens, Looks(), np.random.default_rng(n))
    ...     measured += measure_edge(picture, camera).measured
    >>> fit = fit_blade(measured, effort="draft", rng=np.random.default_rng(0))
    >>> truth = shape.edge_at(fit.station)
    >>> fit.family, bool(((fit.offset.q05 < truth) & (truth < fit.offset.q95)).all())
    ('line', True)
    """
    check_known("effort of a fit", effort, _COUNT)
    if not measured:
        raise InputError("No photograph of a blade could be measured, so there is nothing to fit.")
    for measurement in measured:
        if not isinstance(measurement, BladeMeasurement):
            raise InputError(
                f"{type(measurement).__name__} is no measurement of one blade: give one of "
                "``measured`` of what scissorcal.vision.measure_edge returns."
            )
    sized = tuple(_sized(measurement, blade.length_m) for measurement in measured)
    if len({measurement.metric for measurement in sized}) > 1:
        raise InputError(
            "Photographs with and without a scale cannot be fitted together: give --length-mm, or "
            "leave one kind out."
        )
    metric = sized[0].metric
    priors = recipe.fit.blade.priors if recipe else BladePriors()
    lengths = np.array([measurement.length for measurement in sized])
    length = float(np.median(lengths))
    cells = tuple(edge_cells(measurement, cells_each(len(sized))) for measurement in sized)
    best = compare_edges(CellData(cells, length), effort, rng, priors=priors, progress=progress)
    first = min(float(c.station[0]) for c in cells)
    last = max(float(c.station[-1]) for c in cells)
    station = np.linspace(first, last, PLACES)
    edges = best.edge_posterior.with_values(best.draws)
    rows = _rows(sized, cells, best)
    opening, contact, height = _height(best.edge_posterior, recipe, rng) if metric else _no_height()
    pivot = [
        float(
            np.sqrt(
                np.mean(
                    np.sum(np.square(measurement.modes[:, _columns(measurement, "pivot")]), axis=1)
                )
            )
        )
        for measurement in sized
    ]
    fit = BladeFit(
        blade.name,
        best.edge_posterior,
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


def _sized(measurement: BladeMeasurement, length_m: float | None) -> BladeMeasurement:
    """The measurement in metres, or in blade lengths where nobody knows its size.

    The error of the length that gives the size stretches the edge along and across: a mode.
    """
    if measurement.metric:
        return measurement
    factor = (length_m or 1.0) / (measurement.unit_length or measurement.length)
    station, offset = measurement.station * factor, measurement.offset * factor
    slope = smooth_slope(station, offset) if len(station) > 4 else 0.0
    size = measurement.unit_length_sd * (offset - station * slope)
    return replace(
        measurement,
        station=station,
        offset=offset,
        sd=measurement.sd * factor,
        modes=np.column_stack([measurement.modes * factor, size]),
        mode_names=(*measurement.mode_names, "size"),
        length=measurement.length * factor,
        hole_radius=measurement.hole_radius * factor,
        metric=length_m is not None,
    )


def _columns(measurement: BladeMeasurement, name: str) -> list[int]:
    return [index for index, known in enumerate(measurement.mode_names) if known == name]


def _band(draws: Array) -> Band:
    low, high = np.quantile(draws, [0.05, 0.95], axis=0)
    return Band(draws.mean(axis=0), draws.std(axis=0, ddof=1), low, high)


def _height(
    edge_posterior: EdgeDistribution, recipe: Recipe | None, rng: np.random.Generator
) -> tuple[Array, Array, Band | None]:
    """phi over the scene's openings and contacts."""
    if recipe is None:
        return _no_height()
    opening = np.radians(np.linspace(*recipe.scene.opening_deg, 7))
    contact = 1e-3 * np.linspace(*recipe.scene.contact_mm, 9)
    edges = draw_edges(edge_posterior, rng, HEIGHT_DRAWS)
    x, theta = np.meshgrid(contact, opening)
    view = edge_height(edges, x.ravel(), theta.ravel() / recipe.rig.moving_blades)
    shape = (-1, len(opening), len(contact))
    return opening, contact, _band(view.height.reshape(shape))


def _no_height() -> tuple[Array, Array, Band | None]:
    return np.empty(0), np.empty(0), None


def _rows(
    measured: Sequence[BladeMeasurement], cells: Sequence[EdgeCells], best: "EdgeComparison"
) -> tuple[PhotographRow, ...]:
    rows = []
    begin = 0
    for measurement, own in zip(measured, cells, strict=True):
        count = len(own.station)
        residual = best.residual[begin : begin + count]
        begin += count
        own_modes = [
            k for k, name in enumerate(own.mode_names) if name not in ("tone", "shared mapping")
        ]
        spread = float(np.sqrt(np.mean(np.sum(own.modes[:, own_modes] ** 2, axis=1))))
        rows.append(
            PhotographRow(
                measurement.source,
                len(measurement.station),
                measurement.edge.blur_px,
                measurement.edge.good_share,
                own.spoilt,
                measurement.length,
                float(residual.mean()),
                float(np.hypot(spread, best.best.between_m)),
                measurement.uncertainty,
                tuple(own.station.tolist()),
                tuple(residual.tolist()),
            )
        )
    return tuple(rows)


def _notes(
    measured: Sequence[BladeMeasurement], best: "EdgeComparison", metric: bool
) -> tuple[str, ...]:
    notes = list(dict.fromkeys(measurement.uncertainty for measurement in measured))
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


POLYNOMIAL = ("offset_m", "taper_rad", "curvature_per_m", "bend_per_m2")

_COUNT = {"draft": 200, "standard": 300, "thorough": 600}


@dataclass(frozen=True)
class EdgeComparison:
    """All families compared, their errors' sizes at the optimum, and the chosen one fitted.

    ``edge_posterior`` is the edge with its covariance, ``draws`` (n, k) are of its parameters,
    ``residual`` (n,) is of all cells in the order of the photographs. ``status`` and ``sentence``
    are the sampler's, ``evaluations`` counts those of the likelihood over all families.
    """

    rows: tuple[EdgeCandidate, ...]
    edge_posterior: EdgeDistribution
    draws: Array
    residual: Array
    status: SamplingStatus
    sentence: str
    evaluations: int

    @property
    def best(self) -> EdgeCandidate:
        return next(row for row in self.rows if row.chosen)


def compare_edges(
    data: CellData,
    effort: Effort,
    rng: np.random.Generator,
    families: tuple[Family, ...] = FAMILIES,
    priors: BladePriors = BladePriors(),
    progress: Progress | None = None,
) -> EdgeComparison:
    """Compare families of edges by their evidence, and fit the chosen one.

    Cells are normal about the edge with five kinds of error: their own noise; roughness of the
    edge, which neighbours share and every photograph sees; what neighbours of one photograph share
    (its compression, its light); what moves a whole photograph (its pivot, centreline, mapping);
    and what is alike in all of them (the print, the camera, its tone curve). All that is linear is
    integrated in closed form. The sizes of the errors are inferred with it: in every family by
    their optimum, in the chosen one at the ``effort`` asked for. Evaluations have a limit
    (`MOST_EVALUATIONS`, `SEARCH_EVALUATIONS`), and ``sentence`` says what came of it.
    """
    tell = progress or (lambda done, sentence: None)
    optima, logs, evidences = [], [], []
    for number, family in enumerate(families):
        tell(0.4 * number / len(families), f"comparing edges: {family}")
        evidences.append(EdgeEvidence(data, basis_of(data, family, priors), priors))
        optimum, log_evidence = search(evidences[-1])
        optima.append(optimum)
        logs.append(log_evidence)
    sizes = [evidence.basis.columns.shape[1] for evidence in evidences]
    chosen = _chosen(families, sizes, logs)
    rows = tuple(
        _row(data, family, optima[index], logs[index], index == chosen)
        for index, family in enumerate(families)
    )
    evidence = evidences[chosen]
    posterior = infer(
        evidence.problem(),
        effort,
        rng,
        count=_COUNT[effort],
        optimum=optima[chosen],
        options=InferOptions(
            budget=MOST_EVALUATIONS[effort] or None,
            progress=lambda done, sentence: tell(0.4 + 0.5 * done, sentence),
        ),
    )
    draws = np.stack([_draw(evidence, u, rng) for u in posterior.draws])
    residual = data.offset - evidence.basis.columns @ draws.mean(axis=0)
    edge_posterior, natural = _edge_posterior(data, families[chosen], draws)
    others = sum(o.evaluations for index, o in enumerate(optima) if index != chosen)
    tell(1.0, f"edge fitted: {families[chosen]}")
    return EdgeComparison(
        rows,
        edge_posterior,
        natural,
        residual,
        posterior.status,
        posterior.sentence,
        posterior.evaluations + others,
    )


def _row(
    data: CellData, family: Family, optimum: Optimum, log_evidence: float, chosen: bool
) -> EdgeCandidate:
    noise, rough, length, _, *more = (float(size) for size in np.exp(optimum.point))
    between = more[0] if data.several else 0.0
    return EdgeCandidate(family, log_evidence, chosen, noise, rough, length, between)


def _chosen(families: Sequence[Family], sizes: Sequence[int], evidences: Sequence[float]) -> int:
    """The simplest family that the evidence does not distinguish from the best.

    The evidence is the log density of all cells, each predicted from those before it: one unit, as
    photographs of one blade share its roughness.
    """
    rows = compare(families, sizes, [Account(np.array(evidences)[:, None])])
    return next(index for index, row in enumerate(rows) if row.chosen)


def _draw(evidence: EdgeEvidence, u: Array, rng: np.random.Generator) -> Array:
    """The edge's parameters given the sizes of the errors: a draw from their exact posterior."""
    from scipy.linalg import cho_factor, cho_solve

    covariance, prior = evidence.covariances(u)
    factor = cho_factor(covariance, lower=True)
    columns = evidence.basis.columns
    scale = np.sqrt(np.diag(prior))
    information = columns.T @ cho_solve(factor, columns) * np.outer(scale, scale)
    information += np.linalg.pinv(prior / np.outer(scale, scale), rcond=1e-12, hermitian=True)
    pull = columns.T @ cho_solve(factor, evidence.data.offset) * scale
    levels, vectors = np.linalg.eigh(0.5 * (information + information.T))
    levels = np.maximum(levels, 1e-12 * levels.max())
    mean = vectors @ ((vectors.T @ pull) / levels)
    return np.asarray(
        scale * (mean + vectors @ (rng.standard_normal(len(levels)) / np.sqrt(levels)))
    )


def _edge_posterior(data: CellData, family: Family, draws: Array) -> tuple[EdgeDistribution, Array]:
    """The normal distribution that the draws amount to, and the draws in the edge's parameters."""
    natural = draws.copy()
    if family == "spline":
        names = tuple(f"spline_m_{index}" for index in range(draws.shape[1]))
    else:
        names = POLYNOMIAL[: draws.shape[1]]
        natural[:, 1] = np.arctan(draws[:, 1])
    blank = Edge(
        family,
        0.0,
        0.0,
        data.length,
        spline_m=(0.0,) * draws.shape[1] if family == "spline" else (),
        spline_start_m=data.start if family == "spline" else 0.0,
    )
    covariance = np.atleast_2d(np.cov(natural, rowvar=False))
    edge = EdgeDistribution(blank, names, covariance).with_values(natural.mean(axis=0))
    return EdgeDistribution(edge, names, covariance), natural
