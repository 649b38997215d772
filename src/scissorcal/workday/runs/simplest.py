"""What a workspace's scene needs of its fits: worked out once, then read."""

from collections.abc import Mapping

import numpy as np

from scissorcal.calibration.result import FitResult
from scissorcal.errors import InputError
from scissorcal.files import replacing
from scissorcal.foreign import read_foreign, reading
from scissorcal.foreign.formats import STATE
from scissorcal.package.exact import pick_draws
from scissorcal.package.friction_tables import rendered_fits
from scissorcal.package.simplest.choice import SceneChoice, scene_choice
from scissorcal.package.simplest.model import Simplified, simplest_model
from scissorcal.workday.engine import Engine
from scissorcal.workday.runs.fit import available, load_result

NEEDED = ("friction", "cut")
SEED = 0
"""Picks the draws, as `scissorcal package build` does unless it is given another."""


def workspace_scene_choice(engine: Engine) -> SceneChoice | None:
    """What the scene needs of the fits, and what leaving the rest out saves.

    Steps are timed when it is worked out; it is then kept in package/scene-choice.json for as long
    as fits and recipe are the same. None where a fit is missing or stale, or where there is nothing
    to build. Raises InputError where the fitted law cannot be compiled.
    """
    if not engine.needed(STEP) or set(available(engine, NEEDED)) != set(NEEDED):
        return None
    found = known_scene_choice(engine)
    if found is not None:
        return found
    cut, friction = load_result(engine, "cut"), load_result(engine, "friction")
    wanted = friction if engine.recipe.scene.render_friction else None
    own, rendered = rendered_fits(cut, wanted)
    draws = pick_draws(own, rendered, np.random.default_rng(SEED))
    simplified = simplest_model(engine.recipe, own, rendered, draws)
    return store_scene_choice(engine, simplified, {"cut": cut, "friction": friction})


def store_scene_choice(
    engine: Engine, simplified: Simplified, fits: Mapping[str, FitResult | None]
) -> SceneChoice:
    """Keep what a scene needs of its fits (friction, cut) in package/scene-choice.json.

    Steps are timed here.
    """
    friction = fits["friction"] if engine.recipe.scene.render_friction else None
    found = scene_choice(
        engine.recipe,
        simplified,
        {"cut": fits["cut"], "friction": friction},
        engine.identity(STEP),
    )
    path = engine.workspace.scene_choice_path
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as part:
        part.write_text(found.model_dump_json(indent=1), encoding="utf-8")
    return found


STEP = "package build"
"""The step whose identity it has: the same fits and recipe give the same choice."""


def known_scene_choice(engine: Engine) -> SceneChoice | None:
    """What was worked out of the fits and recipe as they are now; None where nothing was."""
    path = engine.workspace.scene_choice_path
    if not path.is_file():
        return None

    try:
        with reading(path, STATE):
            found = SceneChoice.model_validate_json(read_foreign(path, STATE))
    except InputError:
        return None  # of another version, or damaged: it is worked out again
    return found if found.identity == engine.identity(STEP) else None
