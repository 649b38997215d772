"""What of fits is rendered: typical friction, and its part by load with the material.

A package's friction is that of an empty joint. The pivot's share mu of the cut's torque stands with
the material: closing blades feel (1 + mu) times its torque, which is what a capture measures best,
however it is divided between the two. A crack starts where force and energy are in the same ratio,
so both grow by the same factor and every crack stays where it is. Opening blades feel (1 - mu)
times the material's torque; that part is stated, not rendered.
"""

from dataclasses import replace

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration import FitResult
from scissorcal.calibration.friction.layout import at_typical
from scissorcal.calibration.parameters import FittedParameter
from scissorcal.package.friction_tables import LOAD_SHARE, share_of

GROWING = ("response_force", "fracture_energy")


def rendered_fits(cut: FitResult, friction: FitResult | None) -> tuple[FitResult, FitResult | None]:
    """The fits as a package renders them: typical friction, and a cut with its part by load."""
    return (cut, None) if friction is None else (as_closing(cut), at_typical(friction))


def as_closing(cut: FitResult) -> FitResult:
    """The fit with friction by load in force and energy, draw by draw; itself where there is none.

    A fit keeps no share at its MAP point, so that is scaled to the posterior's mean of what
    running costs (of the force where nothing is cut).
    """
    if share_of(cut) is None or cut.nuisance_draws is None:
        return cut
    names = [p.name for p in cut.parameters]
    place = [p.name for p in cut.nuisance].index(LOAD_SHARE)
    growth = 1.0 + np.asarray(cut.nuisance_draws[:, place], dtype=np.float64)
    columns = [names.index(name) for name in GROWING if name in names]
    draws, point = np.array(cut.draws, dtype=np.float64), np.array(cut.map_point, dtype=np.float64)
    cost = _cost(names, point[None, :])[0]
    point[columns] *= float(np.mean(growth * _cost(names, draws))) / cost
    draws[:, columns] *= growth[:, None]
    parameters = tuple(
        replace(p, **FittedParameter.summary_of(draws[:, i])) if i in columns else p
        for i, p in enumerate(cut.parameters)
    )
    return replace(cut, parameters=parameters, draws=draws, map_point=point)


def _cost(names: list[str], rows: Array) -> Array:
    """Mean energy of a running crack (rows,), or the response's force where nothing is cut."""
    if "fracture_energy" not in names:
        return rows[:, names.index("response_force")]
    kappa = rows[:, names.index("kappa")] if "kappa" in names else 1.0
    return np.asarray(0.5 * (1.0 + kappa) * rows[:, names.index("fracture_energy")])
