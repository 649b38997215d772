"""The fit of a cut: its run in a workspace, with friction and the edge that it builds on."""

from typing import TYPE_CHECKING

from scissorcal.errors import InputError
from scissorcal.verdicts import Verdict
from scissorcal.workday.recordings import used_recordings
from scissorcal.workday.runs.friction import finished

if TYPE_CHECKING:
    from scissorcal.calibration.result import FitResult
    from scissorcal.model import EdgeDistribution
    from scissorcal.model.edge import Edge
    from scissorcal.recipe.schema import Recipe
    from scissorcal.workday.engine import Engine
    from scissorcal.workday.runs.fit import Made, Request

STREAM = 1


def fit(engine: "Engine", request: "Request") -> "Made":
    """Fit the response, fracture and taper to the used recordings of cuts."""
    import numpy as np

    from scissorcal.calibration.cut.fit import fit_cut
    from scissorcal.calibration.fit_model import CutRun
    from scissorcal.workday.runs.fit import Made, load_result

    request.progress(0.0, "cut: reading recordings")
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
        run=CutRun(
            progress=request.progress,
            edge=edge,
            edge_verdicts=verdicts,
            checkpoint=request.checkpoint,
            last_chosen=request.last_model or None,
            stop=request.stop,
        ),
    )
    return Made(finished(result, request))


def edge_of_photographs(engine: "Engine") -> "tuple[EdgeDistribution | None, tuple[Verdict, ...]]":
    """The edge that photographs gave and the verdicts on it; None where the recipe states it.

    Raises MissingError where the recipe asks for photographs and the blade's fit is not current,
    InputError where its shape has no scale.
    """
    from scissorcal.workday.runs.fit import load_result

    if not engine.needed("fit blade"):
        return None, ()
    blade = load_result(engine, "blade")
    return blade.edge_posterior, blade.verdicts


def blade_edge(engine: "Engine", recipe: "Recipe") -> "Edge":
    """The edge of photographs, else the recipe's."""
    from scissorcal.calibration.cut.structure import edge_of

    edge_posterior, _ = edge_of_photographs(engine)
    return (edge_posterior or edge_of(recipe)).edge
