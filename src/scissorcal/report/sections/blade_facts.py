"""What is known of a blade, as facts: edge, taper and height with their bands, nicks, views."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from scissorcal.calibration.edge.result import Band, BladeFit, BladeResult
from scissorcal.report.numbers import Number, finite, finite_each


@dataclass(frozen=True)
class EdgeBand:
    """A quantity by place: mean, standard deviation, 5 % and 95 %."""

    mean: tuple[Number, ...]
    sd: tuple[Number, ...]
    q05: tuple[Number, ...]
    q95: tuple[Number, ...]


@dataclass(frozen=True)
class EdgeParameter:
    """One parameter of the edge with its standard deviation; SI units, as its name says."""

    name: str
    value: Number
    sd: Number


@dataclass(frozen=True)
class EdgeRung:
    """A family of edges: logarithm of its evidence, and what is left beyond it."""

    family: str
    evidence: Number
    noise_factor: Number
    roughness_m: Number
    roughness_length_m: Number
    between_m: Number
    chosen: bool


@dataclass(frozen=True)
class Nick:
    """Metal missing from the edge: where, how wide and deep, and the photographs that show it."""

    station_m: Number
    width_m: Number
    depth_m: Number
    source: str


@dataclass(frozen=True)
class BladeView:
    """One photograph; ``station_m`` and ``residual_m`` are its points beside the joint edge."""

    name: str
    points: int
    blur_px: Number
    clear_share: Number
    spoilt_share: Number
    length_m: Number
    away_m: Number
    away_sd_m: Number
    station_m: tuple[Number, ...]
    residual_m: tuple[Number, ...]
    seen: str


@dataclass(frozen=True)
class BladeEdge:
    """One blade. Lengths are metres where ``metric``, else blade lengths.

    ``height_m`` is that of the edge, row by row of ``opening_rad``, over ``contact_m``.
    """

    name: str
    family: str
    metric: bool
    length_m: Number
    length_sd_m: Number
    pivot_sd_m: Number
    parameters: tuple[EdgeParameter, ...]
    covariance: tuple[tuple[Number, ...], ...]
    station_m: tuple[Number, ...]
    offset_m: EdgeBand
    taper_rad: EdgeBand
    opening_rad: tuple[Number, ...]
    contact_m: tuple[Number, ...]
    height_m: EdgeBand | None
    nicks: tuple[Nick, ...]
    rungs: tuple[EdgeRung, ...]
    views: tuple[BladeView, ...]
    notes: tuple[str, ...]


@dataclass(frozen=True)
class SeenOpen:
    """The angle between both blades' centrelines in one photograph."""

    name: str
    opening_rad: Number


@dataclass(frozen=True)
class BladeSection:
    """What is said of the blade, or of both. ``pictures`` are the files that the fit drew."""

    edges: tuple[BladeEdge, ...]
    openings: tuple[SeenOpen, ...]
    inputs_hash: str
    pictures: tuple[str, ...]


def take_blade(result: BladeResult, pictures: Sequence[Path]) -> BladeSection:
    """Gather the facts on a blade's fit."""
    return BladeSection(
        tuple(_edge(fit) for fit in result.blades),
        tuple(SeenOpen(seen.source, finite(seen.opening_rad)) for seen in result.openings),
        result.inputs_hash,
        tuple(path.name for path in pictures),
    )


def _edge(fit: BladeFit) -> BladeEdge:
    belief = fit.belief
    sd = np.sqrt(np.maximum(np.diag(belief.covariance), 0.0))
    return BladeEdge(
        fit.name,
        fit.family,
        fit.metric,
        finite(belief.edge.length_m),
        finite(fit.length_sd),
        finite(fit.pivot_sd),
        tuple(
            EdgeParameter(name, finite(value), finite(spread))
            for name, value, spread in zip(belief.names, belief.mean, sd, strict=True)
        ),
        tuple(finite_each(row) for row in belief.covariance.tolist()),
        finite_each(fit.station),
        _band(fit.offset),
        _band(fit.taper),
        finite_each(fit.opening),
        finite_each(fit.contact),
        None if fit.height is None else _band(fit.height),
        tuple(
            Nick(finite(nick.station_m), finite(nick.width_m), finite(nick.depth_m), nick.source)
            for nick in fit.nicks
        ),
        tuple(
            EdgeRung(
                rung.family,
                finite(rung.evidence),
                finite(rung.noise_factor),
                finite(rung.roughness_m),
                finite(rung.roughness_length_m),
                finite(rung.between_m),
                rung.chosen,
            )
            for rung in fit.rungs
        ),
        tuple(
            BladeView(
                row.source,
                row.points,
                finite(row.blur_px),
                finite(row.clear_share),
                finite(row.spoilt_share),
                finite(row.length),
                finite(row.away),
                finite(row.away_sd),
                finite_each(row.station, 5),
                finite_each(row.residual, 4),
                row.seen,
            )
            for row in fit.photographs
        ),
        tuple(note for note in fit.notes if note not in {row.seen for row in fit.photographs}),
    )


def _band(band: Band) -> EdgeBand:
    rows = (band.mean, band.sd, band.q05, band.q95)
    return EdgeBand(*(finite_each(np.ravel(row)) for row in rows))
