"""The tables of each posterior draw, on the knots of the package's own."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.parameters import moments_agree
from scissorcal.kernel import ModelTables, Table
from scissorcal.package.model_package import ModelPackage
from scissorcal.package.records import Parameter
from scissorcal.package.variations import central_values, variations

STEEPEST = 3.0
"""A cubic between two knots never falls where its slopes lie between 0 and 3 times the chord's
(Fritsch and Carlson 1980, doi:10.1137/0717021)."""


@dataclass(frozen=True)
class DrawTables:
    """Models of a package's draws and of its posterior means, and their parameters.

    ``models`` has one for each draw and then that of the means, ``varied`` the tables that differ
    between them. ``parameters`` (1 + draws + 1, parameters) begins with the package's own;
    ``limited`` counts the models of which a response's slope was held to what keeps it from
    falling.
    """

    models: tuple[ModelTables, ...]
    varied: tuple[str, ...]
    parameters: Array
    limited: int


def draw_tables(package: ModelPackage) -> DrawTables:
    """The exact law of each draw, and at the means, where the package's tables have their knots.

    The knots were chosen for the package's own parameters, so that the bound of its tables holds
    for these alone. Laws that no draw changes keep the package's tables.
    """
    friction_draws = package.arrays.get("draws/friction.npy")
    cut = package.arrays["draws/cut.npy"]
    if friction_draws is not None:
        cut = cut[: len(friction_draws)]
        friction_draws = friction_draws[: len(cut)]
    record = package.manifest.provenance
    cut = np.vstack([cut, _means(record.cut.parameters)])
    if friction_draws is not None:
        assert record.friction is not None
        friction_draws = np.vstack([friction_draws, _means(record.friction.parameters)])
    law = variations(package, cut, friction_draws)
    own, limited = package.tables, 0
    varied = [
        name
        for name, rows in law.rows.items()
        if name != "mean_energy" and np.any(np.ptp(rows, axis=0))
    ]
    models = []
    for draw in range(len(cut)):
        tables: dict[str, Any] = {}
        for name in varied:
            table = _table(getattr(own, name).x, *law.rows[name][draw], monotone=name == "response")
            limited += name == "response" and bool(
                np.any(table.slope != law.rows[name][draw, 1].astype(np.float32))
            )
            tables[name] = table
        models.append(
            replace(
                own,
                **tables,
                fracture_energy=float(law.fracture_energy[draw]) if own.fracture_energy else 0.0,
                kappa=float(law.kappa[draw]) if own.fracture_energy else 1.0,
                rate_damping=float(law.rate_damping[draw]),
            )
        )
    centre = [values for values in central_values(package) if values is not None]
    columns = cut if friction_draws is None else np.hstack([cut, friction_draws])
    return DrawTables(
        tuple(models), tuple(varied), np.vstack([np.concatenate(centre), columns]), limited
    )


def _means(parameters: Sequence[Parameter]) -> Array:
    """Posterior means; the median where mean and sd do not say what the quantiles say."""
    return np.array(
        [p.mean if moments_agree(p.mean, p.sd, p.q05, p.q95) else p.q50 for p in parameters]
    )


def _table(x: Array, y: Array, slope: Array, *, monotone: bool) -> Table:
    if monotone:
        chords = np.diff(y) / np.diff(x)
        most = STEEPEST * np.minimum(np.append(chords, chords[-1]), np.append(chords[0], chords))
        slope = np.clip(slope, 0.0, most)
    return Table(*(np.asarray(row, dtype=np.float32) for row in (x, y, slope)))
