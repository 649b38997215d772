"""What a workspace's scene needs of its fits, as it was worked out last."""

from typing import TYPE_CHECKING

from scissorcal.errors import InputError
from scissorcal.foreign import read_foreign, reading
from scissorcal.foreign.formats import STATE
from scissorcal.workday.engine import Engine

if TYPE_CHECKING:
    from scissorcal.package.simplest.choice import SceneChoice

STEP = "package build"
"""The step whose identity it has: the same fits and recipe give the same choice."""


def known_scene_choice(engine: Engine) -> "SceneChoice | None":
    """What was worked out of the fits and recipe as they are now; None where nothing was."""
    path = engine.workspace.scene_choice_path
    if not path.is_file():
        return None
    from scissorcal.package.simplest.choice import SceneChoice

    try:
        with reading(path, STATE):
            found = SceneChoice.model_validate_json(read_foreign(path, STATE))
    except InputError:
        return None  # of another version, or damaged: it is worked out again
    return found if found.identity == engine.identity(STEP) else None
