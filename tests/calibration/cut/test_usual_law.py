"""The law that draft effort fits to cuts and presses where nothing was chosen before."""

from typing import Any

import pytest

from scissorcal.calibration.cut.structure import allowed_laws, usual_law
from scissorcal.recipe import builtin_recipe


@pytest.mark.parametrize(
    ("recipe", "settings", "wanted"),
    [
        ("paper-80gsm", {}, "power response, rippled fracture"),
        ("paper-80gsm", {"response": "auto+spline"}, "power response, rippled fracture"),
        ("paper-80gsm", {"fracture": "smooth"}, "power response, smooth fracture"),
        (
            "paper-80gsm",
            {"load_share": "fit"},
            "power response, rippled fracture, load-dependent friction",
        ),
        ("press-only", {"response": "auto"}, "exponential response, no fracture"),
        ("press-only", {"response": "power"}, "power response, no fracture"),
    ],
)
def test_the_usual_law_has_no_term_that_the_recipe_only_allows(
    recipe: str, settings: dict[str, Any], wanted: str
) -> None:
    found = builtin_recipe(recipe)
    cut = found.fit.cut.model_copy(update={**settings, "rate_damping": "auto"})
    changed = found.model_copy(update={"fit": found.fit.model_copy(update={"cut": cut})})
    assert usual_law(allowed_laws(changed)).name == wanted
