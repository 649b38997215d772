"""Sign a workspace's report, and tell whether a signature still stands for what is there."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from scissorcal.errors import InputError, MissingError
from scissorcal.recipe.schema import Recipe
from scissorcal.workday.reported_geometry import report_geometry
from scissorcal.workday.runs.report import reportable_fits, why_stale
from scissorcal.workday.workspace import FitKind, Workspace

if TYPE_CHECKING:
    from scissorcal.calibration import FitResult
    from scissorcal.package import Review

Decision = Literal["accept", "reject"]
Fits = Mapping[FitKind, "FitResult"]


@dataclass(frozen=True)
class ReviewState:
    """A workspace's signature: ``review`` as it stands on disk, and ``why`` it is void.

    ``why`` is empty where the signature stands for the report and the fits that are there.
    """

    review: "Review | None"
    why: str

    @property
    def valid(self) -> "Review | None":
        """The review, unless it is void."""
        return None if self.why else self.review


def sign_report(
    workspace: Workspace,
    name: str,
    decision: Decision,
    note: str = "",
    *,
    now: datetime | None = None,
) -> "Review":
    """Write report/signature.json: who decided what on the report as it lies there.

    Raises MissingError where there is no report or it is not of the fits and recipe as they are,
    InputError where the name is empty or the file cannot be written.
    """
    from pydantic import ValidationError

    from scissorcal.package import REVIEW_FORMAT, Review, stamp
    from scissorcal.report import sign_page

    recipe = workspace.recipe()
    fits = reportable_fits(workspace, recipe)
    if not workspace.report_json.is_file() or not workspace.report_html.is_file():
        raise MissingError("There is no report to sign yet: run 'scissorcal report' and read it.")
    stale = why_stale(workspace, recipe, fits)
    if stale:
        raise MissingError(
            f"{workspace.report_json} is stale, so it was not signed: {stale}. Run 'scissorcal "
            "report', read it again, then sign."
        )
    try:
        review = Review(
            format=REVIEW_FORMAT,
            name=" ".join(name.split()),
            decision=decision,
            note=note.strip(),
            time_utc=stamp(now or datetime.now(UTC)),
            report_sha256=_sha256(workspace.report_json),
            fit_hashes=_fit_hashes(workspace, recipe, fits),
        )
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"])
        raise InputError(f"The {place} cannot be signed with: {first['msg']}.") from None
    part = workspace.signature_path.with_name(workspace.signature_path.name + ".part")
    try:
        part.write_text(review.model_dump_json(indent=2) + "\n", encoding="utf-8")
        part.replace(workspace.signature_path)
    except OSError as error:
        raise InputError(
            f"{workspace.signature_path} cannot be written: {error.strerror or error}."
        ) from error
    sign_page(workspace.report_html, review)
    return review


def review_state(workspace: Workspace, recipe: Recipe, fits: Fits) -> ReviewState:
    """Hold the workspace's signature against its report and ``fits``, as they are now."""
    from pydantic import ValidationError

    from scissorcal.package import Review

    path = workspace.signature_path
    if not path.is_file():
        return ReviewState(None, "")
    try:
        review = Review.model_validate_json(path.read_bytes())
    except (OSError, ValidationError):
        return ReviewState(None, f"{workspace.relative(path)} is damaged")
    if not workspace.report_json.is_file():
        return ReviewState(review, "the report that was signed is gone")
    if _sha256(workspace.report_json) != review.report_sha256:
        return ReviewState(review, "the report changed since it was signed")
    if review.fit_hashes != _fit_hashes(workspace, recipe, fits):
        return ReviewState(review, "it is of other fits than there are now")
    stale = why_stale(workspace, recipe, fits)
    return ReviewState(review, f"its report is stale: {stale}" if stale else "")


def standing_review(workspace: Workspace) -> "Review | None":
    """The signature under the workspace's report, if there is one and it is not void.

    Raises MissingError where there is no fit, or one has fallen behind.
    """
    if not workspace.signature_path.is_file():
        return None
    recipe = workspace.recipe()
    return review_state(workspace, recipe, reportable_fits(workspace, recipe)).valid


def _fit_hashes(workspace: Workspace, recipe: Recipe, fits: Fits) -> dict[str, str]:
    """Inputs hashes of all that a report shows: what photographs gave, and the rig's fits."""
    geometry = report_geometry(workspace, recipe).fits
    return {
        **{what: fit.inputs_hash for what, fit in geometry.items()},
        **{what: fit.inputs_hash for what, fit in fits.items()},
    }


def _sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()
