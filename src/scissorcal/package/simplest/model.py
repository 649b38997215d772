"""The simplest model that is enough for a scene: what a package is compiled from."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.parameters import FittedParameter
from scissorcal.calibration.result import FitResult
from scissorcal.package.bound import SHARE_OF_TOLERANCE
from scissorcal.package.compile import Compiled
from scissorcal.package.exact import ExactModel, FitDraws, central_model
from scissorcal.package.friction_tables import least_factor
from scissorcal.package.simplest.law import Law, column
from scissorcal.package.simplest.project import Projection, Reference
from scissorcal.package.simplest.record import AspectRecord, RigFriction, Simplification
from scissorcal.package.simplest.walk import Walked, cost_of, walk
from scissorcal.package.smallest_tables import package_tables
from scissorcal.package.table_cost import table_bytes
from scissorcal.recipe.schema import Recipe

SHARE_OF_OMISSIONS = 0.5
"""Of the scene's tolerance, for everything that is left out together. Tables may use
`SHARE_OF_TOLERANCE`, a tenth, and the rest, two fifths, is the posterior's."""

UNITS = {
    "edge_offset_m": "m",
    "edge_taper_rad": "rad",
    "edge_curvature_per_m": "1/m",
    "edge_bend_per_m2": "1/m^2",
}


@dataclass(frozen=True)
class Simplified:
    """The fits with the laws that the scene needs, and the record of what was left out.

    ``cut`` and ``friction`` are the fits with the structure, parameters, MAP point and draws of the
    projected law; ``draws`` are what the package stores. ``tables`` are those of the fits as they
    stand, then those after each omission; the last are the package's. ``walked`` has what the
    record does not: the projections themselves.
    """

    cut: FitResult
    friction: FitResult | None
    draws: dict[str, Array]
    record: Simplification
    tables: tuple[Compiled, ...]
    walked: tuple[Walked, ...]

    @property
    def central(self) -> ExactModel:
        """The exact model at the MAP point: what the tables are compiled of."""
        friction = FitDraws.centre(self.friction) if self.friction else None
        return central_model(FitDraws.centre(self.cut), friction)


def simplest_model(
    recipe: Recipe,
    cut: FitResult,
    friction: FitResult | None,
    draws: Mapping[str, Array],
    *,
    tolerance: float | None = None,
) -> Simplified:
    """Leave out of the fitted laws what the scene does not need.

    ``draws`` are the posterior draws that a package keeps (:func:`~scissorcal.package.build.
    pick_draws`). Everything that is left out together changes the torque by no more than half of
    the scene's tolerance, with its confidence over these draws, at the places looked at where
    torque can be felt. With ``scene.simplify = false`` the fits come back as they are. Tables of
    the fitted law and after each omission are those that a package would get, made with
    ``tolerance`` where it is given.
    Raises InputError where the fitted law cannot be compiled.
    """
    scene = recipe.scene
    felt_share, confidence = scene.tolerance_percent / 100.0, scene.confidence_percent / 100.0
    allowed = SHARE_OF_OMISSIONS * felt_share
    law = Law.of_fits(cut, friction, draws)
    walked: tuple[Walked, ...] = ()
    rows: list[AspectRecord] = []
    tables = [package_tables(law.central(), recipe, tolerance)]
    sizes = [_bytes(law, tables[0])]
    facts: dict[str, Any] = {}
    if scene.simplify:
        reference = Reference.of(law, recipe)
        walked = walk(reference, allowed, confidence)
        for one in walked:
            if one.after is not one.before:
                tables.append(package_tables(one.after.law.central(), recipe, tolerance))
                sizes.append(_bytes(one.after.law, tables[-1]))
            rows.append(_row(one, sizes))
        last = walked[-1].after
        facts = {
            "places": len(reference.judging.points.opening),
            **_within(reference, last, felt_share, confidence),
        }
        if last.law is not law:
            facts["joint"] = cost_of(last.difference, allowed, confidence)
    used = walked[-1].after.law if walked else law
    record = Simplification(
        asked=scene.simplify,
        tolerance=felt_share,
        confidence=confidence,
        allowed_share=allowed,
        tables_share=SHARE_OF_TOLERANCE * felt_share,
        draws=law.rows - 1,
        places=facts.pop("places", 0),
        aspects=tuple(rows),
        bytes_before=sizes[0],
        bytes_after=sizes[-1],
        rig_friction=None
        if friction is None or used.friction is law.friction
        else _rig_friction(friction, law, recipe),
        **facts,
    )
    if used is law:
        return Simplified(cut, friction, dict(draws), record, tuple(tables), walked)
    new_cut = _with_law(cut, law.cut, used.cut)
    new_friction = None
    kept = {"draws/cut.npy": used.cut.draws[1:]}
    if friction is not None and law.friction is not None and used.friction is not None:
        new_friction = _with_law(friction, law.friction, used.friction)
        kept["draws/friction.npy"] = used.friction.draws[1:]
    return Simplified(new_cut, new_friction, kept, record, tuple(tables), walked)


def _bytes(law: Law, tables: Compiled) -> int:
    """Bytes of the tables and draws of a law as a package stores them."""
    parts = [law.cut] + ([law.friction] if law.friction else [])
    return table_bytes(tables) + sum(part.draws[1:].nbytes for part in parts)


def _row(one: Walked, sizes: Sequence[int]) -> AspectRecord:
    """The record of an aspect; ``sizes`` are the bytes after each omission so far."""
    return AspectRecord(
        aspect=one.aspect,
        fitted=one.fitted.name,
        used=one.used.name,
        tried=one.tried,
        alone=one.alone,
        saved_bytes=sizes[-2] - sizes[-1] if one.after is not one.before else 0,
    )


def _within(
    reference: Reference, last: Projection, tolerance: float, confidence: float
) -> dict[str, float | None]:
    """Shares of the felt places within the tolerance, before and after anything is left out."""
    fitted, used = reference.felt, last.felt
    scale, tail = fitted.scale[0], 0.5 * (1.0 - confidence)
    low, high = np.quantile(fitted.torque[1:], [tail, 1.0 - tail], axis=0)
    band = 0.5 * (high - low) / np.where(scale > 0.0, scale, 1.0)
    away = np.abs(used.torque - fitted.torque) / np.where(fitted.scale > 0.0, fitted.scale, 1.0)
    omitted = np.quantile(away[1:], confidence, axis=0, method="higher")
    counted = np.abs(fitted.torque[0]) >= scale
    counted &= fitted.clear[0] & fitted.reached[0] & (scale > 0.0)
    if not counted.any():
        return {"within_before": None, "within_after": None}
    before = band + SHARE_OF_TOLERANCE * tolerance
    shares = [float(np.mean(each[counted] <= tolerance)) for each in (before, before + omitted)]
    return {"within_before": shares[0], "within_after": shares[1]}


def _rig_friction(friction: FitResult, law: Law, recipe: Recipe) -> RigFriction:
    fitted = law.central().friction
    assert fitted is not None
    levels = {
        row.name: max(row.q05, 0.0)
        for row in friction.parameters
        if row.name.startswith(("coulomb", "viscous"))
    }
    inertia = [row.q50 for row in friction.parameters if row.name == "inertia"]
    return RigFriction(
        levels=levels,
        inertia_kg_m2=max(inertia[0], 0.0) if inertia else 0.0,
        least_factor=max(least_factor(fitted, recipe), 0.0),
    )


def _with_law(fit: FitResult, fitted: FitDraws, used: FitDraws) -> FitResult:
    """The fit with a projected law: its structure, and its parameters with their new draws.

    What the projection did not change keeps the summary of all of the fit's draws.
    """
    if used is fitted:
        return fit
    known = {parameter.name: parameter for parameter in fit.parameters}
    rows = []
    for name in used.names:
        values = column(used, name)
        if name in known and np.array_equal(values, column(fitted, name)):
            rows.append(known[name])
            continue
        q05, q50, q95 = (float(q) for q in np.quantile(values[1:], [0.05, 0.5, 0.95]))
        rows.append(
            FittedParameter(
                name=name,
                unit=known[name].unit if name in known else UNITS[name],
                mean=float(values[1:].mean()),
                sd=float(values[1:].std()),
                q05=q05,
                q50=q50,
                q95=q95,
                identifiability=math.nan,
            )
        )
    return replace(
        fit,
        structure=dict(used.structure),
        parameters=tuple(rows),
        draws=used.draws[1:],
        map_point=used.draws[0],
    )
