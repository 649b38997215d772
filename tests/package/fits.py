"""Synthetic fits: what calibration would hand over, without fitting anything."""

import math
from dataclasses import replace
from typing import Any

import numpy as np

from scissorcal.calibration import FitResult, FitSeries, FittedParameter
from scissorcal.recipe import Recipe, builtin_recipe

UNITS = {"response_force": "N", "response_exponent": "1", "fracture_energy": "J/m", "kappa": "1"}
FRICTION = {
    "inertia": 6e-4,
    "offset": 0.001,
    "coulomb": 0.012,
    "viscous": 0.004,
    "stribeck": 0.006,
    "stribeck_rate": 0.08,
    "angle_slope": 0.15,
    "angle_curvature": -0.2,
}


def recipe(name: str = "paper-80gsm", **scene: Any) -> Recipe:
    """A recipe that comes with scissorcal, its scene changed where asked; nothing is simplified."""
    chosen = builtin_recipe(name)
    return chosen.model_copy(
        update={"scene": chosen.scene.model_copy(update={"simplify": False} | scene)}
    )


def cut_fit(
    chosen: Recipe,
    *,
    response: str = "power",
    force: float = 2.0,
    exponent: float = 1.5,
    energy: float | None = 0.5,
    kappa: float | None = None,
    damping: float | None = None,
    shape: tuple[float, ...] = (),
    spread: float = 0.03,
    seed: int = 1,
    draws: int = 400,
) -> FitResult:
    """A cut fit that agrees with a recipe; ``energy`` None for a scene that only presses.

    ``shape`` is a spline's, whose knots lie about the reference indentation.
    """
    reference = chosen.fit.cut.reference_indentation_mm * 1e-3
    values = {"response_force": force, "response_exponent": exponent}
    values |= {f"response_shape_{index}": step for index, step in enumerate(shape, 1)}
    fracture = "none"
    if energy is not None:
        values["fracture_energy"] = energy
        fracture = "smooth"
    if kappa is not None:
        values["kappa"] = kappa
        fracture = "rippled"
    if damping is not None:
        values["rate_damping"] = damping
    edge = chosen.rig.edge
    structure = {
        "response": response,
        "rate_damping": damping is not None,
        "fracture": fracture,
        "closure": chosen.scene.closure,
        "reference_indentation_m": reference,
        "moving_blades": chosen.rig.moving_blades,
        "upper_face_m": chosen.upper_face_m,
        "edge": {
            "family": edge.family,
            "offset_m": edge.offset_mm * 1e-3,
            "taper_rad": math.radians(edge.taper_deg),
            "length_m": edge.length_mm * 1e-3,
            "curvature_per_m": edge.curvature_per_m,
        },
    }
    if shape:
        structure["response_knots_m"] = [reference * 2.0**k for k in range(-2, len(shape))]
    return _result("cut", values, structure, spread, seed, draws)


LAW_PARAMETERS = {
    "coulomb": ("inertia", "offset", "coulomb"),
    "coulomb+viscous": ("inertia", "offset", "coulomb", "viscous"),
    "stribeck": ("inertia", "offset", "coulomb", "viscous", "stribeck", "stribeck_rate"),
    "stribeck+angle": tuple(FRICTION),
}


def friction_fit(
    *,
    law: str = "stribeck+angle",
    symmetric: bool = True,
    spread: float = 0.03,
    seed: int = 2,
    draws: int = 400,
    **values: float,
) -> FitResult:
    """A friction fit; keywords replace single parameters. Closing has 20 % more if asymmetric."""
    structure = {"law": law, "symmetric": symmetric, "joint": "rotary", "angle_center": 0.55}
    kept = {}
    for name, value in ({key: FRICTION[key] for key in LAW_PARAMETERS[law]} | values).items():
        if symmetric or name not in ("offset", "coulomb", "viscous"):
            kept[name] = value
        elif name != "offset":
            kept[f"{name}_pos"], kept[f"{name}_neg"] = value, 1.2 * value
    return _result("friction", kept, structure, spread, seed, draws)


def _result(
    what: Any,
    values: dict[str, float],
    structure: dict[str, Any],
    spread: float,
    seed: int,
    draws: int,
) -> FitResult:
    rng = np.random.default_rng(seed)
    centre = np.array(list(values.values()))
    factors = np.exp(spread * rng.standard_normal((draws, len(centre))))
    cloud = centre * factors
    if "kappa" in values:
        column = list(values).index("kappa")
        cloud[:, column] = np.minimum(cloud[:, column], 0.999)
    q05, q50, q95 = np.quantile(cloud, [0.05, 0.5, 0.95], axis=0)
    parameters = tuple(
        FittedParameter(
            name=name,
            unit=UNITS.get(name, "N m"),
            mean=float(cloud[:, i].mean()),
            sd=float(cloud[:, i].std()),
            q05=float(q05[i]),
            q50=float(q50[i]),
            q95=float(q95[i]),
            identifiability=0.1,
        )
        for i, name in enumerate(values)
    )
    nothing = np.zeros(0)
    none = np.zeros(0, dtype=np.int64)
    return FitResult(
        what=what,
        effort="standard",
        candidate="synthetic",
        structure=structure,
        parameters=parameters,
        draws=cloud,
        map_point=centre,
        series=FitSeries(
            nothing, none, none, nothing, nothing, nothing, nothing, nothing, nothing, nothing
        ),
        held_out=(),
        candidates=(),
        diagnostics={},
        verdicts=(),
        effort_unit="N m",
        position_unit="rad",
        inputs_hash=f"{what}-{seed}",
        sources=(f"{what}.mcap sha256:{seed:064x}",),
    )


def with_edge(fit: FitResult, edge: dict[str, Any], sds: dict[str, float]) -> FitResult:
    """A cut that was fitted with ``edge``, whose fields ``sds`` were drawn about their values.

    The best point is a third of a standard deviation away from the edge's own values.
    """
    rng = np.random.default_rng(7)
    rows, columns, centre = [], [], []
    for name, sd in sds.items():
        stem, _, index = name.partition("spline_m_")
        value = edge["spline_m"][int(index)] if index else edge[stem]
        centre.append(value + sd / 3.0)
        draws = centre[-1] + sd * rng.standard_normal(len(fit.draws))
        columns.append(draws)
        q05, q50, q95 = np.quantile(draws, [0.05, 0.5, 0.95])
        rows.append(
            FittedParameter(
                name=f"edge_{name}",
                unit="m",
                mean=float(draws.mean()),
                sd=float(draws.std()),
                q05=float(q05),
                q50=float(q50),
                q95=float(q95),
                identifiability=0.9,
            )
        )
    return replace(
        fit,
        structure={**fit.structure, "edge": edge},
        parameters=(*fit.parameters, *rows),
        draws=np.column_stack([fit.draws, *columns]),
        map_point=np.concatenate([fit.map_point, centre]),
    )
