"""The place on a report's page where its signature stands, and the page's digest without it."""

import contextlib
from html import escape
from typing import TYPE_CHECKING

from scissorcal.identity import bytes_digest

if TYPE_CHECKING:
    from scissorcal.package.review import Review

SIGNATURE = ("<!--signature-->", "<!--/signature-->")


def with_signature(page: str, review: "Review | None") -> str:
    """The page with this signature in place of the one it has. ValueError where it has no place."""
    start, end = (page.find(mark) for mark in SIGNATURE)
    if not 0 <= start < end:
        raise ValueError("the page has no place for a signature")
    return page[: start + len(SIGNATURE[0])] + signature_block(review) + page[end:]


def unsigned_digest(page: str) -> str:
    """SHA-256 of the page as it was before it was signed; that of its bytes where it has no place.

    So a signature covers the page on which it stands.
    """
    # a page without the place is not one that was signed: its digest differs
    with contextlib.suppress(ValueError):
        page = with_signature(page, None)
    return bytes_digest(page.encode("utf-8", "surrogateescape"))


def signature_block(review: "Review | None") -> str:
    """What stands there: that nobody signed, or who did, when, and over which digest."""
    if review is None:
        return (
            "<h2>Not signed</h2><p>Once it is read: <code>scissorcal report sign --name NAME "
            "--decision accept</code> or <code>reject</code>.</p>"
        )
    done = "✓ Accepted" if review.decision == "accept" else "✗ Rejected"
    note = f"<p>{escape(review.note)}</p>" if review.note else ""
    return (
        f"<h2>{done}</h2><p>Signed by <strong>{escape(review.name)}</strong> on "
        f'<span class="whole">{escape(review.time_utc[:10])}</span>.</p>{note}'
        f"<p>Digest over this page and the {len(review.content) - 1} files that it rests on: "
        f"<code>{review.digest[:16]}</code>; {escape(review.identity_words)}. "
        "<code>scissorcal plan</code> says whether all of them are still as they were signed.</p>"
    )
