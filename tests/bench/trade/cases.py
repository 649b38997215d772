"""Cases of synthetic fits: what a benchmark starts from, without a recording of any length."""

from dataclasses import replace
from typing import Any

import numpy as np

from scissorcal.bench.trade.case import Case
from scissorcal.device import identity_facts
from scissorcal.recipe import Recipe
from scissorcal.recording import SAMPLE_DTYPE, Kind, Recording
from tests.device.conftest import IDENTITY
from tests.package.fits import cut_fit, friction_fit, recipe


def recording(kind: Kind) -> Recording:
    """A recording without samples that states its rig."""
    return Recording(kind, np.zeros(0, SAMPLE_DTYPE), device=identity_facts(IDENTITY))


def case(chosen: Recipe | None = None, **fit: Any) -> Case:
    """A case whose fits are synthetic; keywords go to the cut's."""
    chosen = chosen or recipe()
    return Case(
        recipe=chosen,
        friction=(recording("friction"),),
        cut=(recording("cut"),),
        edge=None,
        edge_verdicts=(),
        friction_fit=friction_fit(symmetric=False),
        cut_fit=cut_fit(chosen, **fit),
        effort="draft",
        simulated=True,
    )


def pressing(**scene: Any) -> Case:
    """A pad that is pressed, without rendered friction: a torque that is smooth and rate-free."""
    chosen = recipe("press-only", render_friction=False, **scene)
    return case(chosen, energy=None, force=5.0)


def linear() -> Case:
    """A linear joint, which renders nothing."""
    one = case()
    rig = one.recipe.rig.model_copy(update={"joint": "linear"})
    return replace(one, recipe=one.recipe.model_copy(update={"rig": rig}), cut_fit=None)
