"""Ready rigs and materials, and how a recipe is adapted to them."""

import math
from dataclasses import replace

from scissorcal.recipe import Recipe, builtin_recipe

from .parameters import Blades, Friction, Material, Mechanism, Motor, Rig, Sensors, Servo


def paper(**changes: object) -> Material:
    """Office paper of about 80 g/m^2; ``changes`` replace fields of the Material."""
    sheet = Material(
        "paper",
        0.10e-3,
        force_N=2.1,
        exponent=1.6,
        fracture_energy_N=0.52,
        kappa=0.75,
        variation=0.04,
        correlation_m=1.5e-3,
    )
    return replace(sheet, **changes)  # type: ignore[arg-type]


def cotton(**changes: object) -> Material:
    """Plain-weave cotton cloth, one layer."""
    sheet = Material(
        "cotton",
        0.35e-3,
        force_N=6.5,
        exponent=1.35,
        fracture_energy_N=2.135,
        kappa=0.65,
        variation=0.06,
        correlation_m=2.0e-3,
    )
    return replace(sheet, **changes)  # type: ignore[arg-type]


def pad(**changes: object) -> Material:
    """A soft pad that is pressed and let go, never cut."""
    sheet = Material(
        "pad",
        2.0e-3,
        force_N=4.6,
        exponent=1.4,
        reference_m=1.0e-3,
        law="exponential",
        damping_s_per_m=0.2,
        sheet_length_m=0.060,
    )
    return replace(sheet, **changes)  # type: ignore[arg-type]


def coarse(material: Material | None = None, load_share: float = 0.1) -> Rig:
    """A rig that is hard to fit: few counts, a late motor, presliding, load share, a bent edge."""
    return Rig(
        material or paper(),
        Mechanism(friction=Friction(presliding_rad=1.5e-3, load_share=load_share)),
        Motor(delay_ticks=1.1, lag_ticks=0.4, cogging_Nm=6e-4),
        Sensors(counts_per_turn=20_000, sledge_step_m=5e-6),
        Servo(rate_gain=0.022, position_gain=35.0, integral_gain=0.8, observer_hz=350.0),
        Blades(curvature_per_m=0.35),
    )


def fine(material: Material | None = None, load_share: float = 0.0) -> Rig:
    """A rig with 500,000 counts a turn, a quick motor, little cogging, rigid friction."""
    return Rig(
        material or paper(),
        Mechanism(friction=Friction(load_share=load_share)),
        Motor(delay_ticks=0.25, lag_ticks=0.25, cogging_Nm=2e-4),
    )


def smooth(rig: Rig) -> Rig:
    """The same rig with a crack that runs smoothly: kappa = 1."""
    return replace(rig, material=replace(rig.material, kappa=1.0))


RECIPES = {"paper": "paper-80gsm", "cotton": "cotton-cloth", "pad": "press-only"}


def recipe_for(rig: Rig, name: str | None = None, **capture: object) -> Recipe:
    """Give a built-in recipe the rig's own edge, blades and plate.

    ``name`` is a built-in recipe, by default the one of the rig's material; ``capture`` replaces
    keys of the recipe's capture.cut (sheets, strokes_per_sheet, speeds_rad_per_s). A cubic edge
    cannot be said in a recipe: it gets the arc without the cubic term.
    """
    recipe = builtin_recipe(name or RECIPES[rig.material.name])
    blades, sheet = rig.blades, rig.material
    edge = recipe.rig.edge.model_copy(
        update={
            "family": "arc" if blades.curvature_per_m else "line",
            "offset_mm": 1e3 * blades.offset_m,
            "taper_deg": math.degrees(blades.taper_rad),
            "curvature_per_m": blades.curvature_per_m,
            "length_mm": 1e3 * blades.length_m,
        }
    )
    update = {
        "rig": recipe.rig.model_copy(
            update={
                "moving": blades.moving,
                "edge": edge,
                "handle_radius_mm": 1e3 * rig.mechanism.handle_radius_m,
            }
        ),
        "material": recipe.material.model_copy(
            update={
                "thickness_mm": 1e3 * sheet.thickness_m,
                "sheet_length_mm": 1e3 * sheet.sheet_length_m,
            }
        ),
        "capture": recipe.capture.model_copy(
            update={"cut": recipe.capture.cut.model_copy(update=dict(capture))}
        ),
    }
    return recipe.model_copy(update=update)
