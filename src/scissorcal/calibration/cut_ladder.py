"""The ladder of a cut's laws: response families, smooth and rippled fracture."""

import itertools
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.cut_data import CrackHistory, CutData, cutting_from
from scissorcal.calibration.cut_likelihood import MaterialModel, make_blocks, split
from scissorcal.calibration.ladder import Climbed, Likelihood, Rung, climb
from scissorcal.calibration.layout import Layout, Parameter
from scissorcal.recipe.schema import Recipe

Array = NDArray[np.float64]
Progress = Callable[[float, str], None]

STARTS = 3
RIPPLE_FREEDOM = 0.4
"""Prior standard deviation of two logarithms: a rig that yields to the ripple shows less of it, and
more slowly, than blades that close steadily."""

NUISANCE = (
    "noise",
    "slow_noise",
    "variation",
    "ripple_visibility",
    "ripple_period",
)
"""Parameters that describe the noise of a cut, not the cut."""


def climb_cut_ladder(data: CutData, recipe: Recipe, progress: Progress) -> list[Climbed]:
    """Fit every rung that the recipe allows, cheapest first.

    A rippled rung needs to know when the crack advanced and when it rested; that comes from the
    smooth rung of the same family, once, so that the likelihood stays smooth in its parameters.
    """
    wanted = _allowed(recipe)
    climbed: list[Climbed] = []
    smooth: dict[str, Climbed] = {}
    for index, (fracture, family) in enumerate(wanted):
        if fracture == "rippled" and family not in smooth:
            progress(index / len(wanted), f"finding the advances of the crack, {family}")
            smooth[family] = _climb(data, _rung(data, recipe, family, "smooth", None), climbed)
        history = _history(data, smooth[family]) if fracture == "rippled" else None
        rung = _rung(data, recipe, family, fracture, history)
        progress(index / len(wanted), f"trying {rung.name}")
        climbed.append(_climb(data, rung, [*climbed, *smooth.values()]))
        if fracture == "smooth":
            smooth[family] = climbed[-1]
    return climbed


def _allowed(recipe: Recipe) -> list[tuple[str, str]]:
    settings = recipe.fit.cut
    families = ("power", "exponential") if settings.response == "auto" else (settings.response,)
    fractures: tuple[str, ...] = ("smooth", "rippled")
    if not recipe.scene.cut:
        fractures = ("none",)
    elif settings.fracture != "auto":
        fractures = (settings.fracture,)
    return [(fracture, family) for fracture in fractures for family in families]


def _climb(data: CutData, rung: Rung, before: list[Climbed]) -> Climbed:
    neighbour = _nearest(rung, before)
    begun = _from_neighbour(rung, neighbour) if neighbour else rung
    return climb(begun, data.bins.series, data.strokes)


def _history(data: CutData, smooth: Climbed) -> CrackHistory:
    values = smooth.rung.layout.natural(smooth.optimum.point)
    return data.history(cutting_from({**smooth.rung.key, **data.geometry}, values))


def _rung(
    data: CutData, recipe: Recipe, family: str, fracture: str, history: CrackHistory | None
) -> Rung:
    material = _material_layout(data, recipe, fracture)
    layout = Layout(material.parameters + data.friction_layout.parameters)
    key = {"response": family, "fracture": fracture}
    structure = {**key, **data.geometry}
    own = len(material.parameters)
    blocks = make_blocks(data.runs)
    material_model = MaterialModel(data, structure, material, history)

    def residuals(u: Array) -> Array:
        return data.material_torque(u) - material_model(u[:own]).mean

    def normal(u: Array) -> tuple[Array, Array]:
        return split(residuals(u), material_model(u[:own]), blocks)

    precision = np.zeros((len(layout.names),) * 2)
    precision[:own, :own] = np.diag(1 / material.sd**2)
    precision[own:, own:] = data.friction_precision
    likelihood = Likelihood(residuals, normal)
    return Rung(
        name=f"{family} response, " + {"none": "no fracture"}.get(fracture, f"{fracture} fracture"),
        key=key,
        layout=layout,
        likelihood=likelihood,
        starts=_starts(data, material, residuals, likelihood),
        prior_mean=np.concatenate([material.mean, data.friction_mean]),
        prior_precision=precision,
    )


def _material_layout(data: CutData, recipe: Recipe, fracture: str) -> Layout:
    settings = recipe.fit.cut
    force, exponent = settings.response_force_N, settings.response_exponent
    rows = [
        Parameter(
            "response_force",
            "N",
            "log",
            float(np.log(force.median)),
            force.log_sd,
            f"force at {settings.reference_indentation_mm:g} mm of indentation",
        ),
        Parameter(
            "response_exponent",
            "1",
            "log",
            float(np.log(exponent.median)),
            exponent.log_sd,
            "how the response stiffens",
        ),
    ]
    if fracture != "none":
        toughness = settings.toughness_J_per_m2
        assert toughness is not None
        energy = toughness.median * recipe.material.thickness_mm * 1e-3
        rows.append(
            Parameter(
                "fracture_energy",
                "J/m",
                "log",
                float(np.log(energy)),
                toughness.log_sd,
                "toughness times thickness: energy per length of cut",
            )
        )
    if fracture == "rippled":
        rows.append(
            Parameter(
                "kappa",
                "1",
                "logit",
                0.85,
                1.0,
                "share of the fracture energy at which a running crack stops",
            )
        )
    noise = float(np.std(data.bins.drive)) * 0.1
    if fracture == "rippled":
        rows += [
            Parameter(
                "ripple_visibility", "1", "log", 0.0, RIPPLE_FREEDOM, "size of the ripple as seen"
            ),
            Parameter(
                "ripple_period", "1", "log", 0.0, RIPPLE_FREEDOM, "periods of it in a bin as seen"
            ),
        ]
    rows += [
        Parameter("noise", "N m", "log", float(np.log(noise)), 2.8, "noise of single bins"),
        Parameter("slow_noise", "N m", "log", float(np.log(noise)), 2.8, "noise of blocks"),
        Parameter("variation", "1", "log", float(np.log(0.03)), 1.0, "unevenness of the material"),
    ]
    return Layout(tuple(rows))


def _nearest(rung: Rung, climbed: list[Climbed]) -> Climbed | None:
    """The climbed rung that shares most discrete choices, the latest of equals."""
    shared = [sum(c.rung.key[k] == v for k, v in rung.key.items()) for c in climbed]
    return climbed[max(range(len(shared)), key=lambda i: (shared[i], i))] if climbed else None


def _from_neighbour(rung: Rung, neighbour: Climbed) -> Rung:
    """Start a rung where its neighbour ended, in the parameters that mean the same in both.

    A ripple lowers the mean force for a given fracture energy, so that rungs with one start at
    several strengths of it, each with the energy that keeps the mean.
    """
    names = list(neighbour.rung.layout.names)
    same_family = rung.key["response"] == neighbour.rung.key["response"]
    start = rung.starts[0].copy()
    for index, name in enumerate(rung.layout.names):
        if name in names and (same_family or name != "response_exponent"):
            start[index] = neighbour.optimum.point[names.index(name)]
    if "kappa" not in rung.layout.names or "kappa" in names:
        return replace(rung, starts=start[None, :])
    rows = []
    where, energy = rung.layout.names.index("kappa"), rung.layout.names.index("fracture_energy")
    for kappa in (0.9, 0.6):
        row = start.copy()
        row[where] = np.log(kappa) - np.log1p(-kappa)
        row[energy] -= np.log(0.5 + 0.5 * kappa)
        rows.append(row)
    return replace(rung, starts=np.stack(rows))


def _starts(
    data: CutData, material: Layout, residuals: Callable[[Array], Array], likelihood: Likelihood
) -> Array:
    """The best three of a coarse grid over stiffness, its growth and fracture energy.

    The noise at each place of the grid is what that place leaves; friction starts at its mean.
    """
    grid = {"response_force": (-1.2, -0.8, -0.4, 0.0, 0.4, 0.8), "response_exponent": (-0.5, 0.5)}
    if "fracture_energy" in material.names:
        grid["fracture_energy"] = (-1.2, -0.8, -0.5, -0.25, 0.0, 0.25, 0.5, 0.8, 1.2)
    found = []
    for steps in itertools.product(*grid.values()):
        point = np.concatenate([material.mean, data.friction_mean])
        for name, step in zip(grid, steps, strict=True):
            index = material.names.index(name)
            point[index] += step * material.sd[index]
        left = float(np.log(max(float(np.std(residuals(point))), 1e-9)))
        for name in ("noise", "slow_noise"):
            point[material.names.index(name)] = left
        found.append((float(likelihood.terms(point).sum()), point))
    best = sorted(found, key=lambda pair: -pair[0])
    return np.stack([point for _, point in best[:STARTS]])
