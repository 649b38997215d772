"""The ladder of a cut's laws: response families, damping, smooth and rippled fracture."""

import itertools
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.cut_data import FrictionPrior, geometry_of
from scissorcal.calibration.cut_experiment import CutExperiment
from scissorcal.calibration.cut_layout import CutLaw, material_layout
from scissorcal.calibration.cut_motion import CutMotion
from scissorcal.calibration.ladder import Climbed, Rung, climb
from scissorcal.calibration.layout import Layout
from scissorcal.inference import Stop, find_optimum
from scissorcal.model import EdgeBelief, edge_height
from scissorcal.recipe.schema import Recipe

Array = NDArray[np.float64]
Progress = Callable[[float, str], None]

STARTING_KAPPAS = (0.9, 0.6)
KNOTS, SPAN, DEEPEST = 5, 8.0, 0.99


def cut_designs(
    motion: CutMotion, friction: FrictionPrior, recipe: Recipe, belief: EdgeBelief
) -> list[CutExperiment]:
    """Every law that the recipe allows over one set of motions, cheapest first.

    The knots of a spline are placed, and its search begins, by a power law that is fitted first.
    """
    laws = allowed_laws(recipe)
    if all(law.response != "spline" for law in laws):
        return [cut_design(motion, friction, recipe, belief, law) for law in laws]
    scouting = CutLaw("power", "smooth" if recipe.scene.cut else "none")
    scout = cut_design(motion, friction, recipe, belief, scouting)
    point = _explored(scout)
    knots = place_knots(scout, point)
    designs = []
    for law in laws:
        spline = law.response == "spline"
        chosen = replace(law, knots_m=knots) if spline else law
        design = cut_design(motion, friction, recipe, belief, chosen)
        begin = _carried_over(scout.layout, point, design.layout)
        designs.append(replace(design, begin=tuple(begin.tolist())) if spline else design)
    return designs


def place_knots(design: CutExperiment, point: Array) -> tuple[float, ...]:
    """Knots (m) of a spline over the indentations that data reach by a law at ``point`` (p,).

    Evenly in the logarithm, up to the deepest (the 99 % quantile) from an eighth of it: below, a
    response bears little that is felt.
    """
    motion = design.motion
    contact = design.expected(point).contact
    view = edge_height(design.belief.edge, contact, motion.bins.opening / motion.moving_blades)
    depth = float(design.structure["upper_face_m"]) - view.height
    pressed = depth[depth > 0.0]
    reference = float(design.structure["reference_indentation_m"])
    deepest = float(np.quantile(pressed, DEEPEST)) if len(pressed) else reference
    return tuple(float(f"{knot:.4g}") for knot in np.geomspace(deepest / SPAN, deepest, KNOTS))


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


def climb_cut_ladder(
    designs: list[CutExperiment], progress: Progress, stop: Stop | None = None
) -> list[Climbed]:
    """Fit every law to its own data; each begins where the law nearest to it ended."""
    climbed: list[Climbed] = []
    for index, design in enumerate(designs):
        progress(index / len(designs), f"trying {design.name}")
        neighbour = _nearest(design, climbed)
        rung = design.rung(design.observed)
        begun = _with_kappas(_from_neighbour(rung, neighbour) if neighbour else rung, neighbour)
        climbed.append(climb(begun, design.series, design.strokes, stop))
    return climbed


def allowed_laws(recipe: Recipe) -> list[CutLaw]:
    """The laws that a recipe lets the ladder have, cheapest first."""
    settings = recipe.fit.cut
    families = {
        "auto": ("power", "exponential"),
        "auto+spline": ("power", "exponential", "spline"),
    }.get(settings.response, (settings.response,))
    fractures: tuple[str, ...] = ("smooth", "rippled")
    if not recipe.scene.cut:
        fractures = ("none",)
    elif settings.fracture != "auto":
        fractures = (settings.fracture,)
    dampings = {"none": (False,), "fit": (True,), "auto": (False, True)}[settings.rate_damping]
    laws = itertools.product(fractures, dampings, families)
    return [CutLaw(family, fracture, damped) for fracture, damped, family in laws]


def _explored(scout: CutExperiment) -> Array:
    """Where a law is most likely, by the best of its starts alone."""
    rung = scout.rung(scout.observed)
    return find_optimum(replace(rung, starts=rung.starts[:1]).problem(scout.series)).point


def _carried_over(source: Layout, point: Array, target: Layout) -> Array:
    """A point of one layout (p,) in another (q,), whose own parameters start at their priors."""
    start = target.mean.copy()
    for index, name in enumerate(target.names):
        if name in source.names:
            start[index] = point[source.names.index(name)]
    return start


def _nearest(design: CutExperiment, climbed: list[Climbed]) -> Climbed | None:
    """The climbed rung that shares most discrete choices, the latest of equals."""
    shared = [sum(c.rung.key[k] == design.structure.get(k) for k in c.rung.key) for c in climbed]
    return climbed[max(range(len(shared)), key=lambda i: (shared[i], i))] if climbed else None


def _from_neighbour(rung: Rung, neighbour: Climbed) -> Rung:
    """Start a rung where its neighbour ended, in the parameters that mean the same in both."""
    names = list(neighbour.rung.layout.names)
    families = {rung.key["response"], neighbour.rung.key["response"]}
    alike = len(families) == 1 or "exponential" not in families
    start = rung.starts[0].copy()
    for index, name in enumerate(rung.layout.names):
        if name in names and (alike or name != "response_exponent"):
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
