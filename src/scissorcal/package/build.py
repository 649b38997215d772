"""Build a package from a recipe and its fits."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.plate.result import PlateFit
from scissorcal.calibration.result import FitResult
from scissorcal.errors import InputError, MissingError, VerdictError
from scissorcal.identity import VERSION, bytes_digest
from scissorcal.package.archive import member_of, write_archive
from scissorcal.package.compile import scene_ranges
from scissorcal.package.exact import FitDraws, central_model, pick_draws
from scissorcal.package.friction_tables import cut_left_out, left_out
from scissorcal.package.layer_pieces import piece_records
from scissorcal.package.manifest import (
    CutRecord,
    CutStructure,
    Fracture,
    FrictionRecord,
    FrictionStructure,
    Limits,
    Manifest,
    Parameter,
    PoseRecord,
    Provenance,
    RigRecord,
    canonical,
    content_hash,
    units_of,
)
from scissorcal.package.model_package import ModelPackage
from scissorcal.package.review import Review
from scissorcal.package.signature import Sign, signed_text
from scissorcal.package.table_record import Bound
from scissorcal.recipe.edge import Edge, stated_curve
from scissorcal.recipe.schema import Recipe
from scissorcal.verdicts import Verdict, failed

if TYPE_CHECKING:
    from scissorcal.model.plate_pieces import LayerPiece
    from scissorcal.package.simplest.model import Simplified

SAME_M = 1e-9
"""Curves that are closer than this are one: solved on other computers they differ by rounding."""
UNHASHED = "0" * 64
NO_IDENTITY = "0" * 64
"""Identity of a package that is built outside a workspace: no workspace takes it as current."""


@dataclass(frozen=True)
class PackageSummary:
    """A package that was built: its file and manifest, the verdicts on it, and warnings.

    ``simplified`` is what it was compiled from: the laws that the scene needs, and their tables.
    """

    path: Path
    manifest: Manifest
    verdicts: tuple[Verdict, ...]
    warnings: tuple[str, ...]
    simplified: "Simplified"


@dataclass(frozen=True)
class PackageOptions:
    """What goes into a package beside recipe and fits.

    ``tolerance``, each table's as a share of its value, overrides what recipe and scene ask for.
    ``review`` is the signature under the fits' report; it changes nothing else in the package.
    ``plate`` is where the plate stands, stored as a pose with its covariance. ``drawn`` are the
    pieces of the recipe's drawn plate on the line of the cut, none for a uniform sheet. ``rig`` is
    that of the recordings: a rendering on another one is refused. ``inputs_hash`` is the identity
    that a workspace gives to recipe, fits and algorithm (`workday.engine`); where it has another
    one now, the package is stale. With ``allow_failed`` a fit may have failed checks; the manifest
    then lists them, and whatever uses the package reports it
    (docs/decisions/109-packages-from-failed-fits.md). ``sign`` signs content hash and review
    (`signature.signed_text`), such as `keys.signer` of a private key.
    """

    tolerance: float | None = None
    review: Review | None = None
    plate: PlateFit | None = None
    drawn: Sequence["LayerPiece"] = ()
    rig: RigRecord | None = None
    inputs_hash: str = NO_IDENTITY
    allow_failed: bool = False
    sign: Sign | None = None


def build_package(
    recipe: Recipe,
    friction: FitResult | None,
    cut: FitResult | None,
    path: Path,
    rng: np.random.Generator,
    options: PackageOptions = PackageOptions(),
) -> PackageSummary:
    """Compile the fits that a scene needs, check the result, and write it to ``path``.

    The tables hold the cut at the MAP point and a typical law of friction (docs/decisions/010,
    180).
    ``rng`` picks the posterior draws that the package keeps for the band, at most 200; the same
    fits, recipe and seed give the same bytes. Where ``scene.simplify`` is true the tables hold the
    simplest laws that are enough for the scene
    (:func:`~scissorcal.package.simplest.model.simplest_model`), the manifest says what was left
    out, and the tables are the smallest whose bound fits; else they are those of a fixed fine
    tolerance.

    Raises MissingError where a fit that the scene needs is not given, InputError where a fit
    belongs to another recipe or cannot be compiled, and VerdictError, writing nothing, where a fit
    failed a check or the tables are further from the model than the scene allows.
    """
    # the report imports this module to read packages; only a build needs what follows
    from scissorcal.package.by_load import rendered_fits
    from scissorcal.package.check import check_built
    from scissorcal.package.reach import data_reach
    from scissorcal.package.simplest.model import simplest_model
    from scissorcal.package.stated_bound import stated_bound

    plate, sign = options.plate, options.sign
    cut, friction = _wanted(recipe, friction, cut)
    if not options.allow_failed:
        _refuse_failed_fits(path, cut, friction, plate)
    cut, friction = rendered_fits(cut, friction)
    picked = pick_draws(cut, friction, rng)
    simplified = simplest_model(recipe, cut, friction, picked, tolerance=options.tolerance)
    compiled = simplified.tables[-1]
    ranges = scene_ranges(recipe)
    bound = stated_bound(simplified.central, compiled, recipe)
    arrays: dict[str, NDArray[Any]] = {**compiled.arrays, **simplified.draws}
    record = _provenance(recipe, simplified.cut, simplified.friction, options.inputs_hash)
    record = _with_left_out(record, cut, friction, bound)
    manifest = _hashed(
        Manifest(
            format="scissorcal-package/1",
            name=recipe.name,
            units=units_of(compiled.mechanics),
            ranges=ranges,
            limits=Limits.model_validate(
                recipe.limits.model_dump(include=set(Limits.model_fields))
            ),
            mechanics=compiled.mechanics,
            bound=bound,
            provenance=record,
            members=tuple(
                member_of(file, array, compiled.rows.get(file)) for file, array in arrays.items()
            ),
            plate_pose=recipe.scene.plate_pose,
            plate=_plate_record(plate) if plate else None,
            pieces=piece_records(recipe, options.drawn, _energy(compiled.mechanics.fracture)),
            simplification=simplified.record,
            rig=options.rig,
            reach=data_reach(recipe, cut),
            review=options.review,
            content_hash=UNHASHED,
        )
    )
    package = ModelPackage(manifest, arrays, str(path))
    verdicts = check_built(package)
    _refuse_failed(path, verdicts)
    if sign is not None:
        manifest = manifest.model_copy(update={"signature": sign(signed_text(manifest))})
        package = ModelPackage(manifest, arrays, str(path))
    write_archive(path, manifest, arrays)
    return PackageSummary(
        path=path,
        manifest=manifest,
        verdicts=verdicts,
        warnings=package.warnings,
        simplified=simplified,
    )


def _energy(fracture: Fracture | None) -> float:
    return fracture.energy_J_per_m if fracture else 0.0


def put_review(
    package: ModelPackage, review: Review | None, path: Path, sign: Sign | None = None
) -> ModelPackage:
    """Write an open package to ``path`` with another review, or none; nothing else changes.

    ``sign`` signs the result; without it a signature stays only where it is of the result. Raises
    InputError where the file cannot be written, and what ``sign`` raises.
    """
    # hashed anew: a package of an older version lacks keys that this version writes
    before = package.manifest
    manifest = _hashed(before.model_copy(update={"review": review}))
    signature = before.signature if signed_text(manifest) == signed_text(before) else None
    if sign is not None:
        signature = sign(signed_text(manifest))
    manifest = manifest.model_copy(update={"signature": signature})
    write_archive(path, manifest, package.arrays)
    return ModelPackage(manifest, package.arrays, str(path))


def _wanted(
    recipe: Recipe, friction: FitResult | None, cut: FitResult | None
) -> tuple[FitResult, FitResult | None]:
    """The fits that the scene needs, after checking that they match the recipe."""
    if recipe.rig.joint == "linear":
        raise InputError(
            f'The recipe "{recipe.name}" has rig.joint = "linear": a linear joint carries no '
            "blades, so there is no package to build from it."
        )
    if cut is None:
        raise MissingError(
            f'The scene of "{recipe.name}" renders {recipe.material.name}, and there is no fit of '
            "it yet: run 'scissorcal fit cut' first."
        )
    if not recipe.scene.render_friction:
        friction = None
    elif friction is None:
        raise MissingError(
            f'The scene of "{recipe.name}" renders friction, and there is no fit of it yet: run '
            "'scissorcal fit friction' first, or set scene.render_friction = false."
        )
    structure = cut.structure
    stated = {
        "scene.cut": (structure["fracture"] != "none", recipe.scene.cut),
        "scene.closure": (structure["closure"], recipe.scene.closure),
        "rig.moving": (structure["moving_blades"], recipe.rig.moving_blades),
        "material.thickness_mm": (structure["upper_face_m"], recipe.upper_face_m),
        **_stated_edge(structure["edge"], recipe.rig.edge),
    }
    for key, (fitted, wanted) in stated.items():
        if not _same(fitted, wanted):
            raise InputError(
                f"The fit of the cut was made with another {key} than the recipe now has: run "
                "'scissorcal fit' again."
            )
    return cut, friction


def _stated_edge(fitted: Mapping[str, Any], edge: Edge) -> dict[str, tuple[Any, Any]]:
    """The edge of a fit and the recipe's, which does not describe a photographed one."""
    if edge.source == "photographs":
        return {}
    wanted = stated_curve(edge).edge
    curve = (*fitted.get("spline_m", ()), fitted.get("spline_start_m", 0.0), fitted["length_m"])
    points = (*wanted.spline_m, wanted.spline_start_m, wanted.length_m)
    return {
        "rig.edge.family": (fitted["family"], wanted.family),
        **({"rig.edge.points_mm": (curve, points)} if wanted.family == "spline" else {}),
        "rig.edge.offset_mm": (fitted["offset_m"], wanted.offset_m),
        "rig.edge.taper_deg": (fitted["taper_rad"], wanted.taper_rad),
        "rig.edge.length_mm": (fitted["length_m"], wanted.length_m),
        "rig.edge.curvature_per_m": (fitted["curvature_per_m"], wanted.curvature_per_m),
    }


def _same(fitted: Any, wanted: Any) -> bool:
    """Numbers but for their last digits, shapes of a curve within a nanometre."""
    if isinstance(wanted, tuple):
        return len(fitted) == len(wanted) and bool(
            np.allclose(fitted, wanted, rtol=0.0, atol=SAME_M)
        )
    return math.isclose(fitted, wanted) if isinstance(wanted, float) else bool(fitted == wanted)


def _plate_record(plate: PlateFit) -> PoseRecord:
    """The plate's pose in the rig's frame, or in the camera's if that is all that was fitted."""
    pose = plate.rig_plate or plate.camera_plate
    if pose.covariance is None:
        raise InputError(
            "The plate's fit has no covariance of its pose: run 'scissorcal fit plate --force'."
        )
    return PoseRecord(
        frame="rig" if plate.rig_plate else "camera",
        quaternion=pose.quaternion,
        euler_angles=pose.euler_angles,
        translation_m=pose.translation_m,
        covariance=tuple(tuple(float(value) for value in row) for row in pose.covariance),
        target=plate.target,
        inputs_hash=plate.inputs_hash,
        warnings=_warnings(plate.verdicts),
    )


def _provenance(
    recipe: Recipe, cut: FitResult, friction: FitResult | None, inputs_hash: str
) -> Provenance:
    text = canonical(json.loads(recipe.model_dump_json()))
    return Provenance(
        scissorcal_version=VERSION,
        recipe=text.decode("utf-8"),
        recipe_sha256=bytes_digest(text),
        inputs_hash=inputs_hash,
        cut=CutRecord(
            **_record(cut), structure=CutStructure(**_known(cut.structure, CutStructure))
        ),
        friction=None
        if friction is None
        else FrictionRecord(
            **_record(friction),
            structure=FrictionStructure(**_known(friction.structure, FrictionStructure)),
        ),
    )


def _with_left_out(
    record: Provenance, cut: FitResult, friction: FitResult | None, bound: Bound
) -> Provenance:
    """The record with the parts of both fitted laws that no table renders.

    They are of the fits as they stand: a simpler law that lacks load or presliding does not end
    them. Where friction as a whole is left out, what is said of it stands with the cut.
    """
    rendered = friction is not None
    said = cut_left_out(cut, bound.scene_torque_Nm, bound.allowed_share, rendered=rendered)
    of_friction: tuple[str, ...] = ()
    if friction is not None:
        fitted = central_model(FitDraws.centre(cut), FitDraws.centre(friction)).friction
        assert fitted is not None
        of_friction = left_out(fitted, bound.scene_torque_Nm)
    update: dict[str, Any] = {}
    if record.friction:
        update["friction"] = record.friction.model_copy(update={"left_out": of_friction})
    else:
        said += of_friction
    update["cut"] = record.cut.model_copy(update={"left_out": said})
    return record.model_copy(update=update)


def _known(structure: Mapping[str, Any], kind: type[CutStructure | FrictionStructure]) -> Any:
    """The part of a fit's structure that a manifest stores."""
    return {key: structure[key] for key in kind.model_fields if key in structure}


def _record(fit: FitResult) -> dict[str, Any]:
    parameters = tuple(
        Parameter(
            name=parameter.name,
            unit=parameter.unit,
            value=float(value),
            **{
                name: float(getattr(parameter, name))
                for name in ("mean", "sd", "q05", "q50", "q95")
            },
        )
        for parameter, value in zip(fit.parameters, fit.map_point, strict=True)
    )
    return {
        "candidate": fit.candidate,
        "effort": fit.effort,
        "inputs_hash": fit.inputs_hash,
        "sources": fit.sources,
        "parameters": parameters,
        "warnings": _warnings(fit.verdicts),
    }


def _warnings(verdicts: tuple[Verdict, ...]) -> tuple[str, ...]:
    return tuple(f"{verdict.scope}, {verdict.check}: {verdict.why}" for verdict in failed(verdicts))


def _hashed(manifest: Manifest) -> Manifest:
    facts = json.loads(manifest.model_dump_json())
    return manifest.model_copy(update={"content_hash": content_hash(facts)})


def _refuse_failed_fits(
    path: Path, cut: FitResult, friction: FitResult | None, plate: PlateFit | None
) -> None:
    fits = (("friction", friction), ("cut", cut), ("plate", plate))
    wrong = {what: reasons for what, fit in fits if fit and (reasons := _warnings(fit.verdicts))}
    if not wrong:
        return
    sentences = " ".join(reason for reasons in wrong.values() for reason in reasons)
    again = " and ".join(f"'scissorcal fit {what}'" for what in wrong)
    count = sum(map(len, wrong.values()))
    raise VerdictError(
        f"{path} was not written: its fits failed {count} check{'s' if count > 1 else ''}. "
        f"{sentences} Correct that and run {again} again, or build it all the same with "
        "'scissorcal package build --allow-failed': the package then warns on every use."
    )


def _refuse_failed(path: Path, verdicts: tuple[Verdict, ...]) -> None:
    from scissorcal.package.check import FAILED_FITS, REVIEW

    left_to_caller = (FAILED_FITS.name, REVIEW.name)
    refused = [verdict for verdict in failed(verdicts) if verdict.check not in left_to_caller]
    if refused:
        reasons = " ".join(verdict.why for verdict in refused)
        raise VerdictError(f"{path} was not written: {reasons}")
