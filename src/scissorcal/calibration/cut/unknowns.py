"""What a fit of cuts leaves unknown or does not state: toughness, and what a scene takes."""

from dataclasses import dataclass, replace

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.cut.structure import LOADED, cutting_from
from scissorcal.calibration.parameters import Layout, Parameter
from scissorcal.calibration.result import FitResult
from scissorcal.calibration.signals.zeros import DriveZero, idle_zero
from scissorcal.model import Cutting, edge_height, log_normal, settled_contact
from scissorcal.model.cutting import torque_at, within_thickness
from scissorcal.model.terms import LOG
from scissorcal.recipe.schema import Recipe
from scissorcal.recording.recording import Recording
from scissorcal.verdicts import STATED, TORQUE, Check, Verdict

BY_EYE_M = 0.5e-3
"""A blade's tip is rounded and worn: by eye or ruler its line is known to 0.5 mm
(docs/decisions/062-the-centreline-halves-the-blade.md)."""
OPENINGS, CONTACTS = 9, 7
SURE = 2.0
"""Standard deviations of a measured zero or a fitted share that a bound includes."""
UNKNOWNS = {
    name: Check(
        f"fit.cut {name}", f"{TORQUE}error of its mean over the scene, share of it", at_most=STATED
    )
    for name in ("opening zero", "torque zero", "edge shape", "friction by load")
}


@dataclass(frozen=True)
class Unknown:
    """One quantity that was not measured: the torque error it may cause, and the remedy.

    ``torque_Nm`` bounds the error of the mean torque over the scene, ``share`` is that over the
    mean itself. ``spread`` says how far the quantity may be off, and on what grounds;
    ``removed_by`` is the remedy, empty where nothing is unknown.
    """

    name: str
    torque_Nm: float
    share: float
    spread: str
    removed_by: str = ""


@dataclass(frozen=True)
class SceneMean:
    """Mean torque of the material over places (k,) of the scene's openings and contacts.

    ``rate`` (rad/s) is the middle of the scene's, with the blades closing. Torque is held to
    ``limit`` (N m), as the loop renders it.
    """

    cutting: Cutting
    opening: Array
    contact: Array
    rate: float
    limit: float = np.inf

    @classmethod
    def of(cls, fit: FitResult, recipe: Recipe, limit: float = np.inf) -> "SceneMean":
        """The scene of a recipe, and the model at a cut's best point.

        Places count where the blades can be: not where they would sink deeper than its thickness
        into what is only pressed. ``limit`` (N m) is the rig's, the recipe's holds in any case.
        """
        scene = recipe.scene
        grid = np.meshgrid(
            np.linspace(*scene.opening_rad, OPENINGS), np.linspace(*scene.contact_m, CONTACTS)
        )
        low, high = scene.opening_rate_rad_per_s
        values = {
            parameter.name: np.asarray(value)
            for parameter, value in zip(fit.parameters, fit.map_point, strict=True)
        }
        rate = -float(np.sqrt(max(low, 1e-3) * high))
        cutting = cutting_from(fit.structure, values)
        opening, contact = (axis.ravel() for axis in grid)
        view = edge_height(cutting.edge, contact, opening / cutting.moving_blades)
        bears = within_thickness(cutting, cutting.upper_face_m - view.height)
        held = min(limit, recipe.limits.torque_Nm)
        return cls(cutting, opening[bears], contact[bears], rate, held)

    def torque(self, away_rad: float = 0.0, **edge: float) -> float:
        """Mean torque (N m), with openings or fields of the edge larger by so much."""
        moved = {field: getattr(self.cutting.edge, field) + by for field, by in edge.items()}
        cutting = replace(self.cutting, edge=replace(self.cutting.edge, **moved))
        opening = self.opening + away_rad
        place = self.contact
        if cutting.fracture_energy is not None:
            place = np.maximum(place, settled_contact(cutting, opening))
        view = edge_height(cutting.edge, place, opening / cutting.moving_blades)
        reached = view.station < cutting.edge.length_m
        felt = np.where(reached, torque_at(cutting, opening, place, self.rate), 0.0)
        return float(np.mean(np.clip(felt, -self.limit, self.limit))) if len(felt) else 0.0

    def change(self, away_rad: float = 0.0, **edge: float) -> float:
        """The larger change (N m) of the mean torque, either way, for such an error."""
        here = self.torque()
        there = self.torque(away_rad, **edge)
        back = self.torque(-away_rad, **{field: -by for field, by in edge.items()})
        return max(abs(there - here), abs(back - here))


def with_unknowns(
    fit: FitResult, recipe: Recipe, friction: FitResult, recordings: tuple[Recording, ...]
) -> FitResult:
    """Add verdicts on what was not measured to a cut's fit, and the bounds as diagnostics.

    Each bound is the change of the scene's mean torque at the fitted parameters. A fit with another
    edge would adapt its parameters and come closer, so the bound is conservative where the scene
    lies within the data. A bound is no observed error: a large one rejects nothing; the check
    counts as not evaluated and names what to measure.
    """
    unknowns = _find_unknowns(fit, recipe, friction, recordings)
    limit = recipe.scene.tolerance_percent / 100.0
    facts = {"not_measured": [dict(vars(unknown)) for unknown in unknowns]}
    return replace(
        fit,
        verdicts=(*fit.verdicts, *(_verdict(unknown, limit) for unknown in unknowns)),
        diagnostics={**fit.diagnostics, **facts},
    )


def _find_unknowns(
    fit: FitResult, recipe: Recipe, friction: FitResult, recordings: tuple[Recording, ...]
) -> tuple[Unknown, ...]:
    """Bound the scene's mean torque by zeros, edge shape and friction by load."""
    scene = SceneMean.of(fit, recipe, _rig_limit(recordings))
    mean = scene.torque()
    rows = (
        ("opening zero", *_opening_zero(scene, recipe)),
        ("torque zero", *_torque_zero(recipe, friction, recordings)),
        ("edge shape", *_edge_shape(scene, fit, recipe)),
        ("friction by load", *_load(mean, fit, recipe, friction)),
    )
    return tuple(
        Unknown(name, torque, torque / mean if mean > 0.0 else 0.0, spread, cure)
        for name, torque, spread, cure in rows
    )


def _rig_limit(recordings: tuple[Recording, ...]) -> float:
    """The least torque limit (N m) that the rigs of the recordings state, infinite if none does."""
    stated = [recording.device.get("torque_limit") for recording in recordings]
    return min((float(limit) for limit in stated if isinstance(limit, float)), default=np.inf)


def _verdict(unknown: Unknown, limit: float) -> Verdict:
    size = (
        f"Error up to {unknown.share:.1%} of the scene's mean torque ({unknown.torque_Nm:.2g} N m)"
    )
    if unknown.torque_Nm == 0.0:
        size = "No torque error"
    why = f"{size}: {unknown.spread} {unknown.removed_by}".rstrip()
    if unknown.share > limit:
        return UNKNOWNS[unknown.name].not_evaluated(why, unknown.share, threshold=limit)
    return UNKNOWNS[unknown.name].judge(unknown.share, why, threshold=limit)


def _opening_zero(scene: SceneMean, recipe: Recipe) -> tuple[float, str, str]:
    cure = "Zero the opening with the centrelines together and state rig.opening_zero_sd_deg."
    spread = recipe.rig.moving_blades * BY_EYE_M / recipe.rig.edge.length_m
    stated = recipe.rig.opening_zero_sd_deg
    if stated is not None:
        spread, cure = SURE * float(np.radians(stated)), ""
        said = f"the opening's zero has a standard deviation of {stated:.2g} deg (recipe)."
    else:
        said = (
            f"the opening's zero may be off by {np.degrees(spread):.2g} deg, 0.5 mm at each "
            "blade tip."
        )
    return scene.change(spread), said, cure


def _torque_zero(
    recipe: Recipe, friction: FitResult, recordings: tuple[Recording, ...]
) -> tuple[float, str, str]:
    """The torque sensor's zero: it matters where friction with unequal levels is rendered."""
    if not recipe.scene.render_friction:
        return 0.0, "friction, which contains the torque's zero, is not rendered.", ""
    zero = DriveZero.from_dict(friction.diagnostics)
    if zero is not None and zero.measured:
        said = (
            f"zeros were measured at idle ({zero.drive:.2g} N m at the joint) and subtracted; what "
            f"is left of them (sd {zero.sd:.1g} N m) is in the intervals."
        )
        return SURE * zero.sd, said, ""
    levels = [p.mean for p in friction.parameters if p.name in ("coulomb_pos", "coulomb_neg")]
    if len(levels) < 2:
        return 0.0, "the friction fit has an offset parameter, which is not rendered.", ""
    known = idle_zero(recordings)
    if known is not None:
        said = f"the drive torque at idle is {known.mean:.2g} N m (sd {known.sd:.1g})."
        return abs(known.mean) + SURE * known.sd, said, ""
    half = 0.5 * abs(levels[0] - levels[1])
    said = (
        f"friction differs by {2 * half:.2g} N m between the directions, and a zero offset of the "
        "torque or force sensor would look the same."
    )
    cure = "Record one second at idle, motors and hands off, to separate the two."
    return half, said, cure


def _edge_shape(scene: SceneMean, fit: FitResult, recipe: Recipe) -> tuple[float, str, str]:
    fitted = {p.name.removeprefix("edge_") for p in fit.parameters if p.name.startswith("edge_")}
    if recipe.rig.edge.source == "photographs" or {"offset_m", "taper_rad"} <= fitted:
        said = "the intervals include the edge's uncertainty, from photographs or the recipe."
        return 0.0, said, ""
    length = scene.cutting.edge.length_m
    bend = 8.0 * BY_EYE_M / length**2
    changes = [scene.change(curvature_per_m=bend, taper_rad=-0.5 * bend * length)]
    if "offset_m" not in fitted:
        changes.append(scene.change(offset_m=BY_EYE_M))
    if "taper_rad" not in fitted:
        changes.append(scene.change(taper_rad=BY_EYE_M / length))
    said = (
        "the recipe states no standard deviation for the edge's offset or taper, so edge offset, "
        "tip and middle may each be off by 0.5 mm."
    )
    cure = (
        'Photograph the blade (rig.edge.source = "photographs"), or state rig.edge.offset_sd_mm '
        "and taper_sd_deg."
    )
    return float(np.linalg.norm(changes)), said, cure


def _load(
    mean: float, fit: FitResult, recipe: Recipe, friction: FitResult
) -> tuple[float, str, str]:
    cure = "Record loaded sweeps, with motor and handle against each other, to measure it."
    share = next((p for p in fit.nuisance if p.name == "load_share"), None)
    if share is not None:
        said = (
            f"the pivot's load-dependent friction is {share.words} of the "
            "cut's torque. A package that renders friction renders it with the material's torque, "
            "as closing blades feel it."
        )
        return 0.0, said, ""
    if any(parameter.name == "load_share" for parameter in friction.parameters):
        return 0.0, "loaded sweeps were recorded, and the friction fit includes it.", ""
    if any(LOADED in str(row["name"]) for row in fit.candidates):
        return 0.0, "candidates with and without it were compared; the strokes show none.", ""
    usual = recipe.fit.cut.priors.load_share.sd
    said = f"jaw tools lose up to {usual:.0%} of the load to friction, and none was fitted."
    return usual * mean, said, f'{cure} Or set fit.cut.load_share = "auto".'


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
    centre, spread = log_normal(1e-3 * material.thickness_mm, 1e-3 * material.thickness_sd_mm)
    log_thickness = centre + spread * rng.standard_normal(len(fit.draws))
    u = np.log(fit.column("fracture_energy")) - log_thickness
    row = Layout((Parameter("toughness", "J/m^2", LOG, *prior.normal(), MEANING),))
    draws = u[:, None]
    return replace(fit, derived=row.fitted(draws), derived_draws=row.columns(draws))
