"""The manifest: everything a package states about itself."""

from __future__ import annotations

import json
from itertools import pairwise
from typing import Annotated, Any, Literal

from pydantic import AliasChoices, Field, Strict, model_validator

from scissorcal.identity import bytes_digest
from scissorcal.package.layer_pieces import Pieces
from scissorcal.package.review import Digest, KeySignature, Review
from scissorcal.package.simplest.record import Simplification
from scissorcal.package.table_record import (
    Bound,
    Finite,
    Name,
    NonNegative,
    Positive,
    Range,
    Section,
    StoredRow,
    Text,
)
from scissorcal.recipe.euler_angles import EulerAngles, Quaternion, angles_alone, one_rotation
from scissorcal.recipe.schema import FrictionLawName, FrictionTerm

FORMAT = "scissorcal-package/1"

_NOT_HASHED = ("content_hash", "review", "signature")
LARGEST_MEMBER = 4_000_000
"""Bytes; a package of 200 draws and five tables has some 40 kB."""


class Member(Section):
    """One file of the archive besides the manifest: an array as .npy.

    Tables have shape (3, knots): x, y and slope. Draws have shape (draws, parameters). A table in
    16-bit numbers has ``rows``, which say how each of its three is decoded.
    """

    file: Annotated[str, Field(pattern=r"^(tables|draws)/[a-z_]{1,40}\.npy$")]
    dtype: Literal["<f4", "<f8", "<i2"]
    shape: tuple[Annotated[int, Field(ge=1)], Annotated[int, Field(ge=1)]]
    bytes: Annotated[int, Field(ge=1, le=LARGEST_MEMBER)]
    sha256: Digest
    rows: tuple[StoredRow, StoredRow, StoredRow] | None = None

    @model_validator(mode="after")
    def _rows_belong_to_int16(self) -> Member:
        if (self.dtype == "<i2") != (self.rows is not None):
            raise ValueError("an array has rows where it is in 16-bit numbers only")
        if self.rows is not None and not (self.file.startswith("tables/") and self.shape[0] == 3):
            raise ValueError("only a table of three rows is stored in 16-bit numbers")
        return self


class Ranges(Section):
    """The scene: where the package may be used, and where its bound was checked.

    ``opening_rate_rad_per_s`` is a magnitude, for closing and opening alike.
    """

    opening_rad: Range
    opening_rate_rad_per_s: Range
    contact_m: Range

    @model_validator(mode="after")
    def _ascend(self) -> Ranges:
        for name in ("opening_rad", "opening_rate_rad_per_s", "contact_m"):
            low, high = getattr(self, name)
            if not 0 <= low < high:
                raise ValueError(f"{name} must be [low, high] with 0 <= low < high")
        return self


class Limits(Section):
    """What the loop never exceeds, whatever the model's output."""

    torque_Nm: Positive
    torque_slew_Nm_per_s: Positive
    force_N: Positive
    force_slew_N_per_s: Positive
    engagement_ramp_s: Positive


class Fracture(Section):
    """When the crack advances. Absent from a package that only presses.

    The crack starts at ``energy_J_per_m`` (toughness times thickness) and stops at kappa times
    that. Where kappa < 1, ``tables/mean_energy.npy`` holds what it costs on average over such
    cycles, in J/m against the opening.
    """

    energy_J_per_m: Positive
    kappa: Annotated[float, Field(gt=0, le=1, allow_inf_nan=False)]


class Friction(Section):
    """Rendered friction. Absent from a package that renders none.

    Below ``rate_eps_rad_per_s`` friction is linear in the rate, so that it cannot chatter.
    """

    rate_eps_rad_per_s: Positive


class Mechanics(Section):
    """The scalars that the kernel needs besides the tables."""

    moving_blades: Literal[1, 2]
    upper_face_m: NonNegative
    handle_radius_m: Positive
    tip_station_m: Positive
    closure: Literal["work", "eq4"]
    rate_damping_s_per_m: NonNegative
    loop_rate_Hz: Positive
    render: tuple[Literal["torque", "handle_force", "translation_force"], ...]
    fracture: Fracture | None
    friction: Friction | None


class EdgeStructure(Section):
    """The edge that a cut was fitted with, from the recipe or photographs.

    Parameters of the fit that begin with ``edge_`` take the place of what stands here.
    """

    family: Literal["line", "arc", "cubic", "spline"]
    offset_m: Finite
    taper_rad: Finite
    length_m: Positive
    curvature_per_m: Finite
    bend_per_m2: Finite = 0.0
    spline_m: Annotated[tuple[Finite, ...], Strict(False), Field(max_length=64)] = ()
    spline_start_m: Finite = 0.0

    @model_validator(mode="after")
    def _spline_has_weights(self) -> EdgeStructure:
        if (self.family == "spline") != (len(self.spline_m) > 0):
            raise ValueError('an edge has weights in spline_m where its family is "spline" only')
        return self


class CutStructure(Section):
    """The discrete choices of a cut fit."""

    response: Literal["power", "exponential", "spline"]
    response_knots_m: Annotated[tuple[Positive, ...], Strict(False), Field(max_length=16)] = ()
    rate_damping: bool = False
    fracture: Literal["none", "smooth", "rippled"]
    closure: Literal["work", "eq4"]
    reference_indentation_m: Positive
    moving_blades: Literal[1, 2]
    upper_face_m: NonNegative
    edge: EdgeStructure

    @model_validator(mode="after")
    def _knots_ascend(self) -> CutStructure:
        knots = self.response_knots_m
        ascend = all(low < high for low, high in pairwise(knots))
        if (self.response == "spline") != (len(knots) > 2) or not ascend:
            raise ValueError("response_knots_m belong to a spline, ascend, and are three or more")
        return self


class FrictionStructure(Section):
    """The discrete choices of a friction fit."""

    law: FrictionLawName
    symmetric: bool
    angle_center: Finite
    adopt: Annotated[tuple[FrictionTerm, ...], Strict(False)] = ()


class Parameter(Section):
    """A fitted parameter: ``value`` is what the tables were compiled at, the rest its posterior."""

    name: Annotated[str, Field(pattern=r"^[a-z0-9_^*|()]{1,40}$")]
    unit: Annotated[str, Field(max_length=40)]
    value: Finite
    mean: Finite
    sd: NonNegative
    q05: Finite
    q50: Finite
    q95: Finite


class FitRecord(Section):
    """A fit that went into the package; its draws stand in ``draws/<what>.npy``.

    ``parameters`` are in the order of the draws' columns. ``warnings`` are the fit's failed
    verdicts, word for word, ``left_out`` the parts of its law that the tables do not render.
    """

    candidate: Annotated[Text, Field(validation_alias=AliasChoices("candidate", "rung"))]
    effort: Literal["draft", "standard", "thorough"]
    inputs_hash: Annotated[str, Field(max_length=200)]
    sources: tuple[Text, ...]
    parameters: Annotated[tuple[Parameter, ...], Field(min_length=1, max_length=128)]
    warnings: tuple[Text, ...]
    left_out: tuple[Text, ...] = ()


class CutRecord(FitRecord):
    structure: CutStructure


class FrictionRecord(FitRecord):
    structure: FrictionStructure


class Provenance(Section):
    """Where a package comes from.

    ``recipe`` is the recipe as canonical JSON, every default written out, ``recipe_sha256`` its
    hash. ``inputs_hash`` is the workspace's identity of recipe, fits and algorithm: equal hashes,
    equal package. It is all zeros for a package that was built outside a workspace.
    """

    scissorcal_version: Annotated[str, Field(max_length=40)]
    recipe: Annotated[str, Field(max_length=200_000)]
    recipe_sha256: Digest
    inputs_hash: Digest
    cut: CutRecord
    friction: FrictionRecord | None


class DataReach(Section):
    """How deep (m) and hard (N at the edge) the data of the cut and the scene press.

    ``crossed_share`` and ``through_share`` are shares of the scene's pressed places at which the
    blades' edges have crossed, and at which they would sink in deeper than the thickness; both 0
    where something is cut. ``tolerance`` is the scene's, as a share.
    """

    data_depth_m: Positive
    data_force_N: NonNegative
    scene_depth_m: NonNegative
    scene_force_N: NonNegative
    crossed_share: Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)]
    through_share: Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)]
    tolerance: Positive


class RigRecord(Section):
    """The rig of the recordings that a package is made from, as it stated itself."""

    name: Annotated[str, Field(max_length=40)]
    serial: Annotated[str, Field(max_length=40)]
    torque_limit_Nm: NonNegative
    force_limit_N: NonNegative


class PoseRecord(Section):
    """Where the plate stands, where the scene asks for it: T_rig_plate, or T_camera_plate.

    ``quaternion`` is (w, x, y, z), ``covariance`` (6, 6) over a rotation vector in the outer frame
    (rad), then the translation (m). ``euler_angles`` are the same rotation in degrees, null in
    older packages; either may stand alone, and the quaternion counts. ``warnings`` are the verdicts
    that its fit failed.
    """

    frame: Literal["rig", "camera"]
    euler_angles: EulerAngles | None = None
    quaternion: Quaternion = Field(default_factory=angles_alone)
    translation_m: tuple[float, float, float]
    covariance: tuple[tuple[float, ...], ...]
    target: Text
    inputs_hash: Annotated[str, Field(max_length=200)]
    warnings: tuple[Text, ...] = ()

    @model_validator(mode="after")
    def _is_a_pose(self) -> PoseRecord:
        one_rotation(self.quaternion, self.euler_angles, "a plate's pose")
        if abs(sum(part**2 for part in self.quaternion) - 1.0) > 1e-6:
            raise ValueError("a plate's quaternion has length one")
        rows = self.covariance
        if len(rows) != 6 or any(len(row) != 6 for row in rows):
            raise ValueError("a plate's covariance has six rows of six")
        if any(rows[index][index] < 0.0 for index in range(6)):
            raise ValueError("a plate's covariance has variances below zero")
        return self


class Manifest(Section):
    """The whole manifest, ``manifest.json`` in the archive.

    ``content_hash`` is the SHA-256 of the canonical JSON of everything here except itself,
    ``review`` and ``signature``; through ``members`` it covers every byte of every array.
    ``review`` is the signature under the report of the package's fits, null as long as there is
    none. ``signature`` is a key's, of content hash and review together. ``simplification`` says
    which simpler laws were enough for the scene, so that they stand here in the place of the fits'
    own: structure, parameters and draws are of the law that is rendered. It is null in packages
    that were built before there was such a choice. ``plate_pose`` is the scene's: "estimated" makes
    a rendering follow the plate, from ``plate`` where no tracker does. ``pieces`` are a drawn plate
    along the line of the cut, null for the uniform sheet that was calibrated. ``rig`` is the rig of
    the recordings, null where they do not state one, as imported ones, and in older packages.
    ``reach`` says how far data and scene reach, null where no data press and in older packages.
    """

    format: Literal["scissorcal-package/1"]
    name: Name
    units: dict[str, str]
    ranges: Ranges
    limits: Limits
    mechanics: Mechanics
    bound: Bound
    provenance: Provenance
    members: Annotated[tuple[Member, ...], Field(min_length=1, max_length=16)]
    plate_pose: Literal["known", "estimated"] = "known"
    plate: PoseRecord | None = None
    pieces: Pieces | None = None
    simplification: Simplification | None = None
    rig: RigRecord | None = None
    reach: DataReach | None = None
    review: Review | None
    signature: KeySignature | None = None
    content_hash: Digest

    @model_validator(mode="after")
    def _consistent(self) -> Manifest:
        files = [member.file for member in self.members]
        if len(set(files)) != len(files):
            raise ValueError("members name a file twice")
        if set(files) != expected_files(self):
            odd = sorted(set(files) ^ expected_files(self))
            raise ValueError(f"members do not fit what the package says it renders: {odd}")
        structure = self.provenance.cut.structure
        if (structure.fracture == "none") != (self.mechanics.fracture is None):
            raise ValueError("mechanics.fracture and the cut fit's fracture contradict each other")
        if (self.provenance.friction is None) != (self.mechanics.friction is None):
            raise ValueError("mechanics.friction and provenance.friction contradict each other")
        if self.pieces is not None and self.plate_pose == "estimated":
            raise ValueError("pieces of a plate do not go together with an estimated pose of it")
        return self

    @property
    def failed_checks(self) -> tuple[str, ...]:
        """The checks that the fits in the package failed, each as "scope, check: reason"."""
        record = self.provenance
        parts = (record.cut, record.friction, self.plate)
        return tuple(reason for part in parts if part for reason in part.warnings)

    @property
    def fit_hashes(self) -> dict[str, str]:
        """Inputs hash of each fit in the package."""
        cut, friction = self.provenance.cut, self.provenance.friction
        return {"cut": cut.inputs_hash} | ({"friction": friction.inputs_hash} if friction else {})


def units_of(mechanics: Mechanics) -> dict[str, str]:
    """Units of the quantities in a package."""
    units = {
        "opening": "rad",
        "opening_rate": "rad/s",
        "contact": "m",
        "station": "m",
        "edge_offset": "m",
        "indentation": "m",
        "response": "N",
        "torque": "N m",
    }
    if mechanics.fracture is not None:
        units["fracture_energy"] = "J/m"
    if mechanics.friction is not None:
        units["friction"] = "N m"
    return units


def expected_files(manifest: Manifest) -> set[str]:
    """The arrays that a package with this manifest has: no more and no fewer."""
    files = {"tables/edge.npy", "tables/response.npy", "draws/cut.npy"}
    if manifest.mechanics.friction is not None:
        files |= {f"tables/friction_{part}.npy" for part in ("opening", "closing", "angle")}
        files.add("draws/friction.npy")
    if manifest.mechanics.fracture is not None and manifest.mechanics.fracture.kappa < 1.0:
        files.add("tables/mean_energy.npy")
    return files


def content_hash(facts: dict[str, Any]) -> str:
    """Hash of a manifest given as plain JSON, but for hash, review and signature."""
    kept = {key: value for key, value in facts.items() if key not in _NOT_HASHED}
    return bytes_digest(canonical(kept))


def canonical(facts: Any) -> bytes:
    """The canonical bytes of a JSON value: keys sorted, no spaces, UTF-8, no NaN."""
    text = json.dumps(
        facts, sort_keys=True, separators=(",", ":"), allow_nan=False, ensure_ascii=False
    )
    return text.encode("utf-8")


def manifest_schema_text() -> str:
    """The JSON Schema of ``manifest.json``: the text of data_schemas/manifest.schema.json."""
    schema = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": "manifest.schema.json",
        **Manifest.model_json_schema(),
    }
    return json.dumps(schema, indent=2, ensure_ascii=False) + "\n"
