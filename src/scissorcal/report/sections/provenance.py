"""Where everything comes from: recordings, hashes, devices, the recipe's text."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scissorcal.calibration.result import FitResult
from scissorcal.recipe.schema import Recipe
from scissorcal.report.inputs import Geometry, RecordingSummary
from scissorcal.report.numbers import Number, Scalar, finite, scalar
from scissorcal.report.strokes import split_source, summary_of


@dataclass(frozen=True)
class DeviceFact:
    """One line of the identity that a rig stated."""

    name: str
    value: Scalar


@dataclass(frozen=True)
class SourceRow:
    """One recording with its hash, and the fits that used it."""

    source: str
    content_hash: str
    kind: str
    joint: str
    samples: int | None
    duration_s: Number
    strokes: int | None
    used_by: tuple[str, ...]
    device: tuple[DeviceFact, ...]
    notes: tuple[str, ...]


@dataclass(frozen=True)
class FitOrigin:
    """A fit's inputs, and its outcome: equal ``inputs_hash`` needs no second fit.

    ``posterior_sha256`` tells a fit from another of the same inputs (:func:`posterior_sha256`).
    """

    fit: str
    inputs_hash: str
    posterior_sha256: str
    sources: tuple[str, ...]


@dataclass(frozen=True)
class GeometryOrigin:
    """A fit of photographs: the hash of its inputs, the SHA-256 of its file, its photographs."""

    fit: str
    inputs_hash: str
    file_sha256: str
    sources: tuple[str, ...]


@dataclass(frozen=True)
class Provenance:
    """All sources, the fits' inputs, and the recipe as text."""

    sources: tuple[SourceRow, ...]
    geometry: tuple[GeometryOrigin, ...]
    fits: tuple[FitOrigin, ...]
    recipe_text: str
    recipe_text_origin: str


def trace(
    recipe: Recipe,
    recipe_text: str,
    fits: Sequence[FitResult],
    recordings: Sequence[RecordingSummary],
    geometry: Geometry | None = None,
) -> Provenance:
    """Tie recordings to fits, and name sources of fits whose recording was not handed in."""
    rows = [_row(recording, fits, recordings) for recording in recordings]
    for source in dict.fromkeys(source for fit in fits for source in fit.sources):
        if summary_of(source, recordings) is None:
            users = tuple(fit.what for fit in fits if source in fit.sources)
            path, digest = split_source(source)
            rows.append(SourceRow(path, digest, "", "", None, None, None, users, (), ()))
    origins = tuple(
        FitOrigin(fit.what, fit.inputs_hash, posterior_sha256(fit), fit.sources) for fit in fits
    )
    text, how = (
        (recipe_text, "as written")
        if recipe_text
        else (recipe.model_dump_json(indent=2), "as read, in JSON")
    )
    return Provenance(tuple(rows), _geometry(geometry or Geometry()), origins, text, how)


def posterior_sha256(fit: FitResult) -> str:
    """SHA-256 of a fit's draws: their bytes as little-endian float64, draw by draw."""
    return hashlib.sha256(np.ascontiguousarray(fit.draws, dtype="<f8").tobytes()).hexdigest()


def _geometry(geometry: Geometry) -> tuple[GeometryOrigin, ...]:
    return tuple(
        GeometryOrigin(what, fit.inputs_hash, geometry.sha256.get(what, ""), fit.sources)
        for what, fit in geometry.fits.items()
    )


def _row(
    recording: RecordingSummary, fits: Sequence[FitResult], recordings: Sequence[RecordingSummary]
) -> SourceRow:
    users = tuple(
        fit.what
        for fit in fits
        if any(summary_of(source, recordings) is recording for source in fit.sources)
    )
    device = tuple(DeviceFact(str(name), scalar(value)) for name, value in recording.device.items())
    return SourceRow(
        recording.source or "recording without a file",
        recording.content_hash,
        recording.kind,
        recording.joint,
        recording.samples,
        finite(recording.duration_s),
        len(recording.strokes),
        users,
        device,
        recording.notes,
    )
