"""The signature of a package: a key signs its content hash together with the review it carries."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from scissorcal.package.manifest import Manifest
from scissorcal.package.review import KeySignature, Review

Sign = Callable[[str], KeySignature]
"""Signs a text, such as `keys.signer` of a private key."""

SIGNATURE_FORMAT = "scissorcal-package-signature/1"

_UNSIGNED = (
    "has no signature of its content, so that tables and limits may have been changed since its "
    "report was reviewed: build it again with 'scissorcal package build --key FILE', or fetch a "
    "copy that was signed so"
)


def signed_text(manifest: Manifest) -> str:
    """What a key signs: format, content hash, and the review's digest or that there is none.

    The first line makes a signature of anything else, such as a review, none of a package.
    """
    review = manifest.review.digest if manifest.review else "no review"
    return f"{SIGNATURE_FORMAT}\n{manifest.content_hash}\n{review}"


def signature_refusal(manifest: Manifest, trusted: Sequence[str] | None = None) -> str:
    """Why a package's signature does not show that this is what was signed.

    ``trusted`` are public keys (OpenSSH) of which one must have signed it; None asks for no key,
    but a signature that is there has to be of this package. Empty where nothing is wrong, else
    the rest of a sentence that begins with the package.
    """
    signature = manifest.signature
    if signature is None:
        return "" if trusted is None else _UNSIGNED
    why = _unproved(signature, signed_text(manifest), "package")
    if why:
        return f"has a signature {why}"
    if trusted is not None and signature.public_key not in trusted:
        return f"is {signer_words(manifest)}, which is none of the trusted ones"
    return ""


def signer_words(manifest: Manifest) -> str:
    """Which key signed a package."""
    signature = manifest.signature
    return f"signed with the key {signature.fingerprint}" if signature else "not signed with a key"


def unasked_words(manifest: Manifest) -> str:
    """What cannot be known of a package where no trusted key is named."""
    if manifest.signature is not None:
        return (
            f"Its content is {signer_words(manifest)}. Whose key that is cannot be known from the "
            "package: --trusted-key asks for a key that you know."
        )
    return (
        "Its hashes show that it is whole, not who made it: anyone who can write the file can "
        "write them. 'scissorcal package build --key FILE' signs it, --trusted-key asks for that."
    )


def against(
    review: Review | None, fits: Mapping[str, str], trusted: Sequence[str] | None = None
) -> str:
    """Why a package of these fits (inputs hash by fit) should not be rendered.

    ``trusted`` are public keys (OpenSSH) of which one must have signed; None asks for no key.
    Empty if its review is valid, else the rest of a sentence that begins with the package.
    """
    if review is None:
        return "is not signed: its report has not been reviewed"
    if any(review.fit_hashes.get(what) != digest for what, digest in fits.items()):
        return (
            f"has a review of other fits ({review.words}): run 'scissorcal report', review and "
            "sign it, then 'scissorcal package build'"
        )
    if review.key is not None:
        why = _unproved(review.key, review.signed_text, "review")
        if why:
            return f"has a review ({review.words}) with a signature {why}"
    if trusted is not None and (review.key is None or review.key.public_key not in trusted):
        return (
            f"has a review that none of the trusted keys signed ({review.words}; "
            f"{review.identity_words})"
        )
    if review.decision == "reject":
        return f"should not be rendered: its report was {review.words}"
    return ""


def _unproved(key: KeySignature, text: str, what: str) -> str:
    """Why a key's signature does not show who signed a text; empty where it does.

    ``what`` names what has the text, such as "review". The rest of a sentence on the signature.
    """
    from scissorcal.package.keys import can_check, holds

    if not can_check():
        return (
            f"by the key {key.fingerprint} that is not checked, because cryptography is not "
            "installed: pip install 'scissorcal[keys]'"
        )
    if not holds(key, text):
        return (
            f"by the key {key.fingerprint} that is not of this {what}: it is forged, or the {what} "
            "was changed since. Fetch an unchanged copy"
        )
    return ""
