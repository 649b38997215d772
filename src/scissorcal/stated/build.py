"""A package from stated numbers: the same compiler, checks and proofs as from fits."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration import FitResult, FitSeries, FittedParameter
from scissorcal.errors import InputError
from scissorcal.model import as_pair, as_share, draw_columns, draw_share, spline_of
from scissorcal.package import STATED_SOURCE, ModelPackage, open_package, scene_depth
from scissorcal.package import build_package as build_from_fits
from scissorcal.recipe import Recipe, Scene, checked_recipe, stated_curve
from scissorcal.stated.numbers import Blades, Friction, Material

DRAWS = 200
"""What a package keeps of the stated spread."""

SHARE_OF_TOLERANCE = 0.1
"""A spline may be off from a law of one's own by this share of the scene's tolerance; the tables
take half of it, and what is left out takes the rest."""

UNITS = {
    "response_force": "N",
    "fracture_energy": "J/m",
    "coulomb": "N m",
    "viscous": "N m s/rad",
    "stribeck": "N m",
    "stribeck_rate": "rad/s",
}


def build_package(
    material: Material,
    blades: Blades,
    friction: Friction | None,
    path: Path | str,
    *,
    scene: Scene | None = None,
    seed: int = 0,
) -> ModelPackage:
    """Build a package from a material, blades and friction that are stated, not fitted.

    The package is rendered, exported and opened like any other; its warnings say that its numbers
    were stated. ``scene`` is what is rendered: by default openings of 12 to 50 degrees at 0.05 to
    1 rad/s, with the material from 20 to 80 % of the blades' length. Each stated number is drawn
    from a log-normal of its mean and standard deviation, and ``kappa``, a share, from a beta
    distribution; independently, by ``seed``.

    Raises InputError for numbers that make no recipe or a scene that presses deeper than a law
    of one's own was asked for, ModelError for a law that gives no number or falls, and VerdictError
    where the tables are further from the model than the scene allows.

    >>> from scissorcal import Blades, Friction, Material, build_package
    >>> paper = Material(force_N=(2.0, 0.1), exponent=1.4, toughness_J_per_m2=4000.0, kappa=0.8)
    >>> package = build_package(paper, Blades(), Friction(coulomb_Nm=0.01), "stated.zip")
    >>> round(float(package.torque(0.3, -0.3, 0.03)), 3)
    0.052
    """
    rng = np.random.default_rng(seed)
    recipe = _recipe(material, blades, friction, scene)
    cut = _cut(material, recipe, rng)
    _refuse_deeper(material, scene_depth(recipe, cut))
    pivot = None if friction is None else _friction(friction, recipe, rng)
    build_from_fits(recipe, pivot, cut, Path(path), rng)
    return open_package(Path(path))


def _refuse_deeper(material: Material, depth_m: float) -> None:
    """A law of one's own is not continued beyond the indentations that it was asked for at."""
    if material.law is None or 1e3 * depth_m <= material.depths_mm[1]:
        return
    raise InputError(
        f"The scene presses down to {1e3 * depth_m:.3g} mm, and Material.depths_mm ends at "
        f"{material.depths_mm[1]:.3g} mm: give depths_mm that reach that far, or a narrower scene."
    )


def _recipe(
    material: Material, blades: Blades, friction: Friction | None, scene: Scene | None
) -> Recipe:
    """The recipe that the numbers make; its priors are asked for, and nothing uses them."""
    cuts = material.toughness_J_per_m2 is not None
    stated: dict[str, Any] = {
        "opening_deg": (12.0, 50.0),
        "opening_rate_rad_per_s": (0.05, 1.0),
        "contact_mm": (0.2 * blades.length_mm, 0.8 * blades.length_mm),
    }
    stated |= {} if scene is None else scene.model_dump()
    stated |= {"cut": cuts, "render_friction": friction is not None}
    low, high = (float(depth) for depth in material.depths_mm)
    reference = (low * high) ** 0.5 if material.law else material.reference_mm
    fit: dict[str, Any] = {"reference_indentation_mm": float(reference)}
    if cuts:
        fit["toughness_J_per_m2"] = {"median": 5000.0, "factor_90": 10.0}
    return checked_recipe(
        {
            "format": "scissorcal-recipe/1",
            "name": "stated",
            "rig": blades.rig,
            "material": {"name": material.name, "thickness_mm": float(material.thickness_mm)},
            "scene": stated,
            "fit": {"cut": fit},
        },
        "the stated numbers",
    )


def _cut(material: Material, recipe: Recipe, rng: np.random.Generator) -> FitResult:
    from scissorcal.calibration.cut.structure import geometry_of

    response = _law(material, recipe, rng) if material.law else _power(material, rng)
    columns = dict(response.columns)
    structure = geometry_of(recipe, stated_curve(recipe.rig.edge).edge)
    structure |= {"rate_damping": False, "fracture": "none", **response.structure}
    if material.toughness_J_per_m2 is not None:
        toughness = {"J": as_pair("toughness", material.toughness_J_per_m2)}
        thickness_m = material.thickness_mm * 1e-3
        columns["fracture_energy"] = draw_columns(toughness, rng, DRAWS)["J"] * thickness_m
        structure["fracture"] = "smooth"
    if material.kappa is not None:
        columns["kappa"] = draw_share(*as_share("kappa", material.kappa), rng, DRAWS)
        structure["fracture"] = "rippled"
    return _as_fit("cut", response.words, columns, structure)


@dataclass(frozen=True)
class _Response:
    """Columns of draws by name, the first row at the stated numbers, and the choices of a law."""

    words: str
    columns: Mapping[str, Array]
    structure: Mapping[str, Any]


def _power(material: Material, rng: np.random.Generator) -> _Response:
    values = draw_columns(material.stated, rng, DRAWS)
    columns = {"response_force": values["force_N"], "response_exponent": values["exponent"]}
    return _Response("power response, stated", columns, {"response": "power"})


def _law(material: Material, recipe: Recipe, rng: np.random.Generator) -> _Response:
    assert material.law is not None
    low, high = (1e-3 * depth for depth in material.depths_mm)
    allowed = SHARE_OF_TOLERANCE * 0.01 * recipe.scene.tolerance_percent
    values = draw_columns(material.stated, rng, DRAWS)
    force, exponent, shape, knots, _ = spline_of(material.law, values, (low, high), allowed)
    columns = {"response_force": force, "response_exponent": exponent}
    columns |= {f"response_shape_{k}": shape[:, k - 1] for k in range(1, len(knots) - 1)}
    words = f"{type(material.law).__name__} response, stated"
    return _Response(words, columns, {"response": "spline", "response_knots_m": knots})


def _friction(friction: Friction, recipe: Recipe, rng: np.random.Generator) -> FitResult:
    stribeck, viscous = friction.stribeck_Nm is not None, friction.viscous_Nm_s_per_rad is not None
    law = "stribeck" if stribeck else "coulomb+viscous" if viscous else "coulomb"
    middle = float(np.mean(recipe.scene.opening_rad))
    structure = {"law": law, "symmetric": True, "joint": "rotary", "angle_center": middle}
    columns = draw_columns(friction.stated, rng, DRAWS)
    return _as_fit("friction", f"{law}, stated", columns, structure)


def _as_fit(
    what: Any, words: str, columns: Mapping[str, Array], structure: Mapping[str, Any]
) -> FitResult:
    """The numbers as what the compiler reads: draws and their centre, without any data."""
    rows = np.stack(list(columns.values()), axis=-1)
    centre, draws = rows[0], rows[1:]
    nothing, none = np.zeros(0), np.zeros(0, dtype=np.int64)
    return FitResult(
        what=what,
        effort="draft",
        candidate=words,
        structure=structure,
        parameters=tuple(
            FittedParameter(
                name,
                UNITS.get(name, "1"),
                identifiability=1.0,
                meaning="stated, not measured",
                **FittedParameter.summary_of(draws[:, column]),
            )
            for column, name in enumerate(columns)
        ),
        draws=draws,
        map_point=centre,
        series=FitSeries(nothing, none, none, *(nothing for _ in range(7))),
        held_out=(),
        candidates=(),
        diagnostics={},
        verdicts=(),
        effort_unit="N m",
        position_unit="rad",
        inputs_hash="0" * 64,
        sources=(STATED_SOURCE,),
    )
