"""The review: who signed a report, the decision, and every file that it covers."""

import hashlib
from collections.abc import Mapping
from datetime import UTC, datetime
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from scissorcal.identity import digest

ReviewFormat = Literal["scissorcal-signature/2"]

REVIEW_FORMAT: ReviewFormat = "scissorcal-signature/2"

REPORT_PAGE, REPORT_TWIN = "report/report.html", "report/report.json"
"""What a review's ``content`` calls the page and its JSON twin."""

Digest = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
MOST_FILES = 5_000
"""Files that a review covers; with their digests 0.7 MB, which a package's manifest can hold."""

_FILE_NAME = Field(min_length=1, max_length=500)


class KeySignature(BaseModel):
    """An Ed25519 signature of a review or a package, with the public key as OpenSSH writes it."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, defer_build=True)

    public_key: Annotated[str, Field(pattern=r"^ssh-ed25519 [A-Za-z0-9+/]{68}$")]
    signature: Annotated[str, Field(pattern=r"^[A-Za-z0-9+/]{86}==$")]

    @property
    def fingerprint(self) -> str:
        """The public key's fingerprint, as 'ssh-keygen -l' prints it."""
        import base64

        blob = base64.b64decode(self.public_key.split()[1])
        return "SHA256:" + base64.b64encode(hashlib.sha256(blob).digest()).decode().rstrip("=")


class Review(BaseModel):
    """A signature under a report, as in report/signature.json and in a package's manifest.

    ``content`` has the SHA-256 of every file that the reviewer read and of all that it rests on:
    page, JSON twin, recipe, fits, verifications, recordings, photographs. The page counts without
    its signature. ``fit_hashes`` are the inputs hashes of the fits. ``digest`` covers all of this
    with name, decision, note and time: a review in which one of them was changed is refused.
    Anyone can write a review with a right digest. Who wrote it is shown only by ``key``, to those
    who know whose key that is.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, defer_build=True)

    format: ReviewFormat
    name: Annotated[str, Field(min_length=1, max_length=200)]
    decision: Literal["accept", "reject"]
    note: Annotated[str, Field(max_length=10_000)]
    time_utc: Annotated[str, Field(pattern=r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ$")]
    content: Annotated[
        dict[Annotated[str, _FILE_NAME], Digest], Field(min_length=1, max_length=MOST_FILES)
    ]
    fit_hashes: Annotated[dict[str, str], Field(min_length=1, max_length=8)]
    digest: Digest
    key: KeySignature | None = None

    @classmethod
    def of(cls, **stated: Any) -> Self:
        """A review of what is stated, with its digest. ValidationError where a value is wrong."""
        facts = {"format": REVIEW_FORMAT, **stated}
        return cls(**facts, digest=stated_digest(facts))

    @model_validator(mode="after")
    def _digest_is_of_this(self) -> Self:
        stated = self.model_dump(mode="json", exclude={"digest", "key"})
        if stated_digest(stated) != self.digest:
            raise ValueError("the review was changed: it does not have the digest that it states")
        return self

    @property
    def words(self) -> str:
        """Who decided what, and when, with the note.

        >>> stated = {"time_utc": "2025-01-31T15:02:00Z", "content": {"report.json": "0" * 64}}
        >>> facts = {"name": "A. Lovelace", "decision": "accept", "note": "", **stated}
        >>> Review.of(fit_hashes={"cut": "1f"}, **facts).words
        'accepted by A. Lovelace on 2025-01-31'
        """
        done = "accepted" if self.decision == "accept" else "rejected"
        note = f": {self.note}" if self.note else ""
        return f"{done} by {self.name} on {self.time_utc[:10]}{note}"

    @property
    def signed_text(self) -> str:
        """What a key signs; its first line makes a signature of anything else none of a review."""
        return f"{self.format}\n{self.digest}"

    @property
    def identity_words(self) -> str:
        """What shows who signed: the key's fingerprint, or that nothing does."""
        if self.key is None:
            return "no key signed it, so that nothing shows who wrote the name"
        return f"signed with the key {self.key.fingerprint}"


def stated_digest(stated: Mapping[str, Any]) -> str:
    """Digest over a review's values, without its digest and key."""
    return digest(dict(stated))


def stamp(now: datetime) -> str:
    """A time as a review states it. ValueError without a time zone."""
    if now.tzinfo is None:
        raise ValueError("a review's time needs its time zone")
    return now.astimezone(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
