"""The ladder of a cut's laws: response families, damping, smooth and rippled fracture."""

import itertools
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from scissorcal.calibration.cut_data import FrictionPrior, geometry_of
from scissorcal.calibration.cut_experiment import CutExperiment
from scissorcal.calibration.cut_layout import CutLaw, material_layout
from scissorcal.calibration.cut_motion import CutMotion
from scissorcal.calibration.ladder import Climbed, Rung, climb
from scissorcal.model import EdgeBelief
from scissorcal.recipe.schema import Recipe

Progress = Callable[[float, str], None]

STARTING_KAPPAS = (0.9, 0.6)


def cut_designs(
    motion: CutMotion, friction: FrictionPrior, recipe: Recipe, belief: EdgeBelief
) -> list[CutExperiment]:
    """Every law that the recipe allows over one set of motions, cheapest first."""
    return [cut_design(motion, friction, recipe, belief, law) for law in allowed_laws(recipe)]


def cut_design(
    motion: CutMotion,
    friction: FrictionPrior,
    recipe: Recipe,
    belief: EdgeBelief,
    law: CutLaw,
) -> CutExperiment:
    """One law over one set of motions, with priors from the recipe and the data's own size."""
    return CutExperiment(
        motion=motion,
        friction=friction,
        structure={**law.key, **geometry_of(recipe, belief.edge)},
        material=material_layout(recipe, law, float(np.std(motion.bins.drive))),
        belief=belief,
    )


def climb_cut_ladder(designs: list[CutExperiment], progress: Progress) -> list[Climbed]:
    """Fit every law to its own data; each begins where the law nearest to it ended."""
    climbed: list[Climbed] = []
    for index, design in enumerate(designs):
        progress(index / len(designs), f"trying {design.name}")
        neighbour = _nearest(design, climbed)
        rung = design.rung(design.observed)
        begun = _with_kappas(_from_neighbour(rung, neighbour) if neighbour else rung, neighbour)
        climbed.append(climb(begun, design.series, design.strokes))
    return climbed


def allowed_laws(recipe: Recipe) -> list[CutLaw]:
    """The laws that a recipe lets the ladder have, cheapest first."""
    settings = recipe.fit.cut
    families = ("power", "exponential") if settings.response == "auto" else (settings.response,)
    fractures: tuple[str, ...] = ("smooth", "rippled")
    if not recipe.scene.cut:
        fractures = ("none",)
    elif settings.fracture != "auto":
        fractures = (settings.fracture,)
    dampings = {"none": (False,), "fit": (True,), "auto": (False, True)}[settings.rate_damping]
    laws = itertools.product(fractures, dampings, families)
    return [CutLaw(family, fracture, damped) for fracture, damped, family in laws]


def _nearest(design: CutExperiment, climbed: list[Climbed]) -> Climbed | None:
    """The climbed rung that shares most discrete choices, the latest of equals."""
    shared = [sum(c.rung.key[k] == design.structure.get(k) for k in c.rung.key) for c in climbed]
    return climbed[max(range(len(shared)), key=lambda i: (shared[i], i))] if climbed else None


def _from_neighbour(rung: Rung, neighbour: Climbed) -> Rung:
    """Start a rung where its neighbour ended, in the parameters that mean the same in both."""
    names = list(neighbour.rung.layout.names)
    same_family = rung.key["response"] == neighbour.rung.key["response"]
    start = rung.starts[0].copy()
    for index, name in enumerate(rung.layout.names):
        if name in names and (same_family or name != "response_exponent"):
            start[index] = neighbour.optimum.point[names.index(name)]
    return replace(rung, starts=start[None, :])


def _with_kappas(rung: Rung, neighbour: Climbed | None) -> Rung:
    """Start at several strengths of the ripple, each with the energy that keeps the mean force.

    A ripple lowers the mean force for a given fracture energy.
    """
    names = rung.layout.names
    if "kappa" not in names or (neighbour and "kappa" in neighbour.rung.layout.names):
        return rung
    where, energy = names.index("kappa"), names.index("fracture_energy")
    rows = []
    for kappa in STARTING_KAPPAS:
        row = rung.starts[0].copy()
        before = 1.0 / (1.0 + np.exp(-row[where])) if neighbour is None else 1.0
        row[where] = np.log(kappa) - np.log1p(-kappa)
        row[energy] -= np.log((0.5 + 0.5 * kappa) / (0.5 + 0.5 * before))
        rows.append(row)
    return replace(rung, starts=np.stack(rows))
