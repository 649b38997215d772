"""What the file of each result says: which inputs it was made from, and what failed.

One function a kind of file; each gives plain values, which the index keeps. Every one has
``inputs`` (identity of what it was made from), ``label`` (its result in a few words) and
``failed`` (names of failed checks).
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from scissorcal.errors import InputError
from scissorcal.foreign import parse_json, read_foreign, read_json, reading
from scissorcal.foreign.formats import PHOTO_INDEX, RECORDING, REPORT, SIGNATURE
from scissorcal.identity import file_digest

Facts = dict[str, Any]

UNFINISHED = "unfinished:"
"""Prefix of the inputs of a fit that ran out of time."""


def fit(path: Path) -> Facts:
    """Facts of a fit; ``imported`` where a file gave it."""
    from scissorcal.calibration.store import read_header

    header = read_header(path)
    return {
        "inputs": header.inputs_hash,
        "label": f"{header.model} ({header.effort})" if header.effort else header.model or "fitted",
        "failed": list(header.failed),
        "what": header.what,
        "model": header.model,
        "effort": header.effort,
        "imported": header.origin == "imported",
    }


def verification(path: Path) -> Facts:
    """Facts of a verification; its inputs are the fit that it checked.

    ``lacks`` says what it must have for the fit to count as verified.
    """
    from scissorcal.calibration.store import load
    from scissorcal.calibration.verify.result import VerifyResult

    check = load(path, VerifyResult)
    done = {"ranks": check.calibration, "halves": check.halves, "prior": check.sensitivity}
    label = ", ".join(name for name, part in done.items() if part is not None)
    failed = [verdict.check for verdict in check.verdicts if verdict.status == "fail"]
    lacks = "" if check.counted_coverage else "coverage was not counted"
    return {
        "inputs": check.fit_content,
        "label": label or "nothing checked",
        "failed": failed,
        "lacks": lacks,
    }


def report(path: Path) -> Facts:
    """Facts of a report by its JSON twin."""
    with reading(path, REPORT):
        inputs = str(read_json(path, REPORT)["inputs_hash"])
    return {"inputs": inputs, "label": "shows the current fits", "failed": []}


def signature(path: Path) -> Facts:
    """Facts of a signature; its inputs are what was signed."""
    from scissorcal.package import Review

    with reading(path, SIGNATURE):
        review = Review.model_validate_json(read_foreign(path, SIGNATURE))
    return {
        "inputs": review.digest,
        "label": review.words,
        "failed": ["rejected"] if review.decision == "reject" else [],
        "review": review.model_dump(mode="json"),
    }


def package(path: Path) -> Facts:
    """Facts of a model package."""
    from scissorcal.package import open_package

    manifest = open_package(path, warn=False).manifest
    return {
        "inputs": manifest.provenance.inputs_hash,
        "label": f"error bound {manifest.bound.stated_Nm:.2g} N m",
        "failed": list(manifest.failed_checks),
        "content": manifest.content_hash,
        "review": manifest.review.model_dump(mode="json") if manifest.review else None,
    }


def rendering(path: Path) -> Facts:
    """Facts of a rendering: the content of the package that was rendered."""
    from scissorcal.recording import read_attachments

    for attached in read_attachments(path):
        if attached.name == "package-manifest.json":
            with reading(path, RECORDING):
                manifest = parse_json(attached.data, str(path), RECORDING.remedy)
                return {"package": str(manifest["content_hash"])}
    return {"package": ""}


def refuse_changed(folder: Path, sha256: Mapping[str, str], digest: Callable[[Path], str]) -> None:
    """Raise InputError where a photograph is gone, or no longer what was captured."""
    for name, expected in sha256.items():
        path = folder / name
        there = path.is_file()
        if not there or digest(path) != expected:
            what = "was changed since it was captured" if there else "is gone"
            raise InputError(
                f"{folder.name}/{name} {what}: put it back as it was, or remove {folder.name} and "
                "capture its photographs again."
            )


def photographs(path: Path) -> Facts:
    """Facts of a folder of photographs by its index file."""
    remedy = f"Remove {path.parent.name} and capture its photographs again."
    kind = replace(PHOTO_INDEX, remedy=remedy)
    with reading(path, kind):
        index = read_json(path, kind)
        sha256 = {str(one["file"]): str(one["sha256"]) for one in index["photographs"]}
    return {"content": file_digest(path), "photographs": len(sha256), "sha256": sha256}
