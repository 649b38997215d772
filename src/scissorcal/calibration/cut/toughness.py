"""Toughness J_c from a cut's fracture energy J_c h, where the thickness is known well enough."""

from dataclasses import replace

import numpy as np

from scissorcal.calibration.parameters import Layout, Parameter
from scissorcal.calibration.result import FitResult
from scissorcal.model.transforms import LOG
from scissorcal.recipe.schema import Recipe

MEANING = "fracture energy over thickness: energy per area of cut"


def with_toughness(fit: FitResult, recipe: Recipe, rng: np.random.Generator) -> FitResult:
    """Give a cut's fit its toughness, if the recipe says how well the thickness is known.

    Torque determines the product J_c h alone, so each draw of it is divided by its own draw of the
    thickness: log-normal, independent, with the recipe's mean and standard deviation. Its share of
    1 goes into the toughness as it is. The fit is returned as it came where nothing is cut or
    ``material.thickness_sd_mm`` is not given.
    """
    material, prior = recipe.material, recipe.fit.cut.toughness_J_per_m2
    if material.thickness_sd_mm is None or prior is None:
        return fit
    names = [parameter.name for parameter in fit.parameters]
    if "fracture_energy" not in names:
        return fit
    variance = float(np.log1p((material.thickness_sd_mm / material.thickness_mm) ** 2))
    centre = float(np.log(material.thickness_mm * 1e-3)) - 0.5 * variance
    thickness = centre + np.sqrt(variance) * rng.standard_normal(len(fit.draws))
    u = np.log(fit.column("fracture_energy")) - thickness
    row = Layout((Parameter("toughness", "J/m^2", LOG, *prior.normal(), MEANING),))
    draws = u[:, None]
    return replace(fit, derived=row.fitted(draws), derived_draws=row.columns(draws))
