"""Build a report: one offline HTML file to review, its JSON twin, and the twin's JSON Schema."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scissorcal.calibration.result import FitResult
from scissorcal.errors import InputError, MissingError, file_error
from scissorcal.files import replacing
from scissorcal.foreign import read_foreign, read_foreign_text
from scissorcal.foreign.formats import PAGE, REPORT, SIGNATURE
from scissorcal.identity import bytes_digest
from scissorcal.package.review import REPORT_PAGE, REPORT_TWIN, Review
from scissorcal.recipe.schema import Recipe
from scissorcal.report.comparison import Comparison
from scissorcal.report.document import ReportDocument, compose, compose_fit
from scissorcal.report.inputs import Evidence

if TYPE_CHECKING:
    from scissorcal.bench.trade.result import Trade
    from scissorcal.report.comparison import Comparison


@dataclass(frozen=True)
class ReportFiles:
    """Where a report was written, and what it says."""

    html: Path
    json: Path
    document: ReportDocument | Comparison


def build_report(
    recipe: Recipe,
    fits: Sequence[FitResult],
    evidence: Evidence,
    output_dir: str | os.PathLike[str],
    *,
    created: datetime,
    review: Review | None = None,
) -> ReportFiles:
    """Write ``report.html`` and ``report.json`` into ``output_dir``, replacing earlier ones.

    The page needs nothing from outside itself, and carries the pictures of ``evidence`` as far as
    they leave it small; the twin holds the same panels. The page shows ``review`` (by default the
    one in ``signature.json`` there) where it was given to this very page and twin.
    ``created`` must carry its time zone. The same input gives the same bytes; a report that says
    the same as the one in ``output_dir`` keeps the time of that one.

    Raises MissingError where there is no fit, InputError where ``output_dir`` cannot be written.
    """
    from scissorcal.report.html import report_page
    from scissorcal.report.signature_block import with_signature

    if created.tzinfo is None:
        raise ValueError("created needs a time zone, for example datetime.now(timezone.utc)")
    if not fits and not evidence.geometry.fits:
        raise MissingError(
            "There is nothing to report yet: no fit was found. Run scissorcal fit, then "
            "scissorcal report again."
        )
    document = compose(recipe, fits, evidence, created)
    files = ReportFiles(
        Path(output_dir) / "report.html", Path(output_dir) / "report.json", document
    )
    document, twin = _with_earlier_time(document, files.json)
    page = report_page(document, evidence.geometry)
    standing = _standing(review, page, twin, files)
    if standing:
        page = with_signature(page, standing)
    _write_both(files, page, twin)
    return replace(files, document=document)


def document_of(recipe: Recipe, fits: Sequence[FitResult]) -> ReportDocument:
    """What a report of these fits would say, without recordings."""
    return compose(recipe, fits, Evidence(), datetime.now(UTC))


def document_of_fit(fit: FitResult, recipe: Recipe | None) -> ReportDocument:
    """A fit alone, as one side of a comparison; ``recipe`` says what it is of, if known."""
    return compose_fit(fit, recipe, datetime.now(UTC))


def write_comparison(comparison: Comparison, output_dir: str | os.PathLike[str]) -> ReportFiles:
    """Write ``comparison.html`` and ``comparison.json``; InputError where that cannot be done."""
    from scissorcal.report.html import panels_page

    folder = Path(output_dir)
    files = ReportFiles(folder / "comparison.html", folder / "comparison.json", comparison)
    page = panels_page(
        "Comparison of two runs",
        "A and B",
        comparison.panels,
        made=(comparison.created, comparison.scissorcal_version),
        facts={"A": comparison.first, "B": comparison.second},
        findings=(comparison.sentence,),
    )
    _write_both(files, page, twin_text(comparison))
    return files


def sign_page(html: Path, review: Review) -> None:
    """Put a signature into a report's page; the twin stays as it was signed.

    Raises InputError where the page is damaged or cannot be written.
    """
    from scissorcal.report.signature_block import with_signature

    try:
        page = with_signature(read_foreign_text(html, PAGE), review)
        with replacing(html) as part:
            part.write_text(page, encoding="utf-8")
    except OSError as error:
        raise file_error(error, html, "The report is not signed.") or error from None
    except ValueError as error:
        raise InputError(
            f"{html} cannot take the signature: {error}. Run 'scissorcal report --anew', then sign."
        ) from error


def _standing(review: Review | None, page: str, twin: str, files: ReportFiles) -> Review | None:
    """The review, or the one in the folder, if it is of this very page and twin."""
    if review is None:
        try:
            path = files.json.parent / "signature.json"
            review = Review.model_validate_json(read_foreign(path, SIGNATURE))
        except (InputError, ValueError):
            return None  # not signed, or damaged, which `plan` says
    now = {REPORT_PAGE: bytes_digest(page.encode()), REPORT_TWIN: bytes_digest(twin.encode())}
    return review if now.items() <= review.content.items() else None


def _with_earlier_time(document: ReportDocument, path: Path) -> tuple[ReportDocument, str]:
    """The document with its twin, and the time of the report there where that says the same."""
    twin = twin_text(document)
    try:
        there = read_foreign_text(path, REPORT)
        before, _, rest = _parted(twin)
        earlier, stated, same = _parted(there)
        if (earlier, same) != (before, rest):
            return document, twin
        return replace(document, created=datetime.fromisoformat(stated)), there
    except (InputError, ValueError):  # there is none, or one of another making
        return document, twin


def _parted(twin: str) -> tuple[str, str, str]:
    """What stands before, in and after the first "created" of a twin, which is the report's."""
    before, _, rest = twin.partition('"created":"')
    stated, _, after = rest.partition('"')
    return before, stated, after


def _write_both(files: ReportFiles, page: str, twin: str) -> None:
    """Write both before either takes its place, so that a failure leaves the old ones whole."""
    folder = files.html.parent
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with replacing(files.json) as twin_part, replacing(files.html) as page_part:
            page_part.write_text(page, encoding="utf-8")
            twin_part.write_text(twin, encoding="utf-8")
    except OSError as error:
        raise InputError(
            f"The report cannot be written to {folder}: {error.strerror or error}. Free that "
            "place or name another output folder."
        ) from error


def twin_text(document: ReportDocument | Comparison | Trade) -> str:
    """The document as JSON: what has its default is left out, what is not finite is null."""
    from pydantic import TypeAdapter

    adapter: TypeAdapter[Any] = TypeAdapter(type(document))
    plain = adapter.dump_python(document, mode="json", exclude_defaults=True)
    return json.dumps(plain, ensure_ascii=False, allow_nan=False, separators=(",", ":")) + "\n"


def read_twin(text: str | bytes) -> ReportDocument:
    """Read a report's twin back. Raises ValueError where it is none of this version."""
    from pydantic import TypeAdapter

    return TypeAdapter(ReportDocument).validate_json(text)


def schema_text() -> str:
    """Text of ``data_schemas/report.schema.json``."""
    return _schema_text(ReportDocument, "scissorcal report")


def comparison_schema_text() -> str:
    """Text of ``data_schemas/comparison.schema.json``."""
    from scissorcal.report.comparison import Comparison

    return _schema_text(Comparison, "scissorcal comparison of two reports")


def _schema_text(kind: type, title: str) -> str:
    """JSON Schema (draft 2020-12) of a twin, generated from its dataclasses."""
    from pydantic import TypeAdapter

    schema: dict[str, Any] = TypeAdapter(kind).json_schema(mode="serialization")
    for definition in (schema, *schema.get("$defs", {}).values()):
        if definition.get("type") == "object":
            definition["additionalProperties"] = False
            definition["required"] = sorted(
                name for name, entry in definition["properties"].items() if "default" not in entry
            )
        for entry in definition.get("properties", {}).values():
            entry.pop("title", None)
    whole = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": title,
        **{name: value for name, value in schema.items() if name != "title"},
    }
    text = json.dumps(_short(whole), indent=2, sort_keys=True, ensure_ascii=False) + "\n"
    return re.sub(r"\[\s+([^\[\]{}]*?)\s+\]", lambda m: f"[{' '.join(m[1].split())}]", text)


def _short(schema: Any) -> Any:
    """The schema with "a number or null" as one type."""
    if isinstance(schema, list):
        return [_short(entry) for entry in schema]
    if not isinstance(schema, dict):
        return schema
    plain = {name: _short(entry) for name, entry in schema.items()}
    kinds = plain.get("anyOf", [])
    if kinds and all(set(kind) == {"type"} for kind in kinds):
        del plain["anyOf"]
        plain["type"] = [kind["type"] for kind in kinds]
    return plain
