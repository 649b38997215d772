"""The fit of a cut: its run in a workspace, with friction and the edge that it builds on."""

import numpy as np

from scissorcal.calibration.cut.fit import fit_cut
from scissorcal.calibration.cut.structure import edge_of
from scissorcal.calibration.fit_model import CutRun
from scissorcal.calibration.result import FitResult
from scissorcal.errors import InputError
from scissorcal.model import EdgeDistribution
from scissorcal.model.edge import Edge
from scissorcal.recipe.schema import Recipe
from scissorcal.verdicts import Verdict
from scissorcal.workday.engine import Engine
from scissorcal.workday.recordings import used_recordings
from scissorcal.workday.runs.fit import Made, Request, load_result
from scissorcal.workday.runs.friction import finished

STREAM = 1


def fit(engine: Engine, request: Request) -> Made:
    """Fit the response, fracture and taper to the used recordings of cuts."""
    request.run.tell(0.0, "cut: reading recordings")
    friction: FitResult = load_result(engine, "friction")
    if friction.position_unit != "rad":
        raise InputError(
            f"{engine.file('fit friction')} is of a linear joint. The fit of a cut needs the "
            "friction of the rig that cuts."
        )
    edge, verdicts = edge_of_photographs(engine)
    result = fit_cut(
        used_recordings(engine.workspace, engine.recipe, "cut", engine.index),
        engine.recipe,
        friction,
        effort=request.effort,
        rng=np.random.default_rng([request.seed, STREAM]),
        run=CutRun(**vars(request.run), edge=edge, edge_verdicts=verdicts),
    )
    return Made(finished(result, request))


def edge_of_photographs(engine: Engine) -> tuple[EdgeDistribution | None, tuple[Verdict, ...]]:
    """The edge that photographs gave and the verdicts on it; None where the recipe states it.

    Raises MissingError where the recipe asks for photographs and the blade's fit is not current,
    InputError where its shape has no scale.
    """
    if not engine.needed("fit blade"):
        return None, ()
    blade = load_result(engine, "blade")
    return blade.edge_posterior, blade.verdicts


def blade_edge(engine: Engine, recipe: Recipe) -> Edge:
    """The edge of photographs, else the recipe's."""
    edge_posterior, _ = edge_of_photographs(engine)
    return (edge_posterior or edge_of(recipe)).edge
