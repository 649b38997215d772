"""A package's tables and numbers at other parameters: what sliders and posterior draws show."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from scissorcal.aliases import Array
from scissorcal.package.compile import law_functions, mean_energy, table_file
from scissorcal.package.exact import central_model, exact_model
from scissorcal.package.model_package import ModelPackage, record_draws


@dataclass(frozen=True)
class Variations:
    """The law at n sets of parameters, on the knots of a package's tables.

    ``rows`` have, by table, values and slopes (n, 2, knots); of "mean_energy" values alone (n, 1,
    knots). ``fracture_energy`` (J/m, 0 where nothing is cut), ``kappa`` and ``rate_damping`` (s/m)
    have shape (n,).
    """

    rows: Mapping[str, Array]
    fracture_energy: Array
    kappa: Array
    rate_damping: Array


def central_values(package: ModelPackage) -> tuple[Array, Array | None]:
    """The parameters at which the tables were compiled: of the cut, and of friction if rendered."""
    record = package.manifest.provenance
    friction = record.friction
    return (
        np.array([parameter.value for parameter in record.cut.parameters]),
        np.array([p.value for p in friction.parameters]) if friction else None,
    )


def variations(package: ModelPackage, cut: Array, friction: Array | None) -> Variations:
    """Evaluate the exact law at n sets of parameters where the package's tables have their knots.

    ``cut`` (n, parameters) and ``friction`` (n, parameters; None where none is rendered) are in the
    order of the manifest's parameters, in SI. What the tables' own interpolation adds is not in
    it, so the rows at the package's own parameters differ from its tables by their tolerance.
    """
    record = package.manifest.provenance
    of_cut = record_draws(record.cut, cut)
    of_friction = None
    if record.friction is not None and friction is not None:
        of_friction = record_draws(record.friction, friction)
    model = exact_model(of_cut, of_friction)
    rows = {}
    for name, (law, derivative) in law_functions(model).items():
        file = table_file(name)
        if file in package.arrays:
            knots = package.arrays[file][0].astype(np.float64)
            both = [
                np.broadcast_to(part(knots), (len(cut), len(knots))) for part in (law, derivative)
            ]
            rows[name] = np.stack(both, axis=1)
    file = table_file("mean_energy")
    if file in package.arrays:
        knots = package.arrays[file][0].astype(np.float64)
        each = [record_draws(record.cut, row[None, :]) for row in cut]
        rows["mean_energy"] = np.array(
            [[mean_energy(central_model(one, None), knots)] for one in each]
        )
    cutting = model.cutting
    energy = 0.0 if cutting.fracture_energy is None else cutting.fracture_energy
    return Variations(
        rows, *(_flat(value, len(cut)) for value in (energy, cutting.kappa, cutting.rate_damping))
    )


def _flat(value: Array | float, count: int) -> Array:
    return np.broadcast_to(np.asarray(value, dtype=np.float64).reshape(-1), (count,)).copy()
