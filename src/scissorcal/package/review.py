"""The review: who signed a report, the decision, and the fits that it covers."""

from collections.abc import Mapping
from datetime import UTC, datetime
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

ReviewFormat = Literal["scissorcal-signature/1"]

REVIEW_FORMAT: ReviewFormat = "scissorcal-signature/1"

Digest = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]


class Review(BaseModel):
    """A signature under a report, as in report/signature.json and in a package's manifest.

    ``report_sha256`` is of report.json as it was reviewed, ``fit_hashes`` the inputs hash of each
    fit that it shows. It states what was reviewed; it does not prove who signed.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, defer_build=True)

    format: ReviewFormat
    name: Annotated[str, Field(min_length=1, max_length=200)]
    decision: Literal["accept", "reject"]
    note: Annotated[str, Field(max_length=10_000)]
    time_utc: Annotated[str, Field(pattern=r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ$")]
    report_sha256: Digest
    fit_hashes: Annotated[dict[str, str], Field(min_length=1, max_length=8)]

    @property
    def words(self) -> str:
        """Who decided what, and when, with the note.

        >>> stamp = {"time_utc": "2025-01-31T15:02:00Z", "report_sha256": "0" * 64}
        >>> facts = {"name": "A. Lovelace", "decision": "accept", "note": "", **stamp}
        >>> Review(format=REVIEW_FORMAT, fit_hashes={"cut": "1f"}, **facts).words
        'accepted by A. Lovelace on 2025-01-31'
        """
        done = "accepted" if self.decision == "accept" else "rejected"
        note = f": {self.note}" if self.note else ""
        return f"{done} by {self.name} on {self.time_utc[:10]}{note}"


def stamp(now: datetime) -> str:
    """A time as a review states it. ValueError without a time zone."""
    if now.tzinfo is None:
        raise ValueError("a review's time needs its time zone")
    return now.astimezone(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")


def against(review: Review | None, fits: Mapping[str, str]) -> str:
    """Why a package of these fits (inputs hash by fit) should not be rendered.

    Empty if its review is valid, else the rest of a sentence that begins with the package.
    """
    if review is None:
        return "is not signed: its report has not been reviewed"
    if any(review.fit_hashes.get(what) != digest for what, digest in fits.items()):
        return (
            f"has a review of other fits ({review.words}): run 'scissorcal report', review and "
            "sign it, then 'scissorcal package build'"
        )
    if review.decision == "reject":
        return f"should not be rendered: its report was {review.words}"
    return ""
