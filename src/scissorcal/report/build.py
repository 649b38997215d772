"""Build a report: one offline HTML file to review, and its JSON twin."""

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path

from scissorcal import __version__
from scissorcal.calibration.result import FitResult
from scissorcal.calibration.verify.result import VerifyResult
from scissorcal.errors import InputError, MissingError
from scissorcal.recipe.schema import Recipe
from scissorcal.recording.recording import Recording
from scissorcal.report.comparison import Comparison, Side
from scissorcal.report.document import (
    Evidence,
    ReportDocument,
    compose,
    compose_fit,
    scene_facts,
)
from scissorcal.report.inputs import FactSheet, Geometry, RecordingSummary, summarise_recording
from scissorcal.report.sections.verdicts import gather_verdicts


@dataclass(frozen=True)
class ReportFiles:
    """Where a report was written."""

    html: Path
    json: Path


def build_report(
    recipe: Recipe,
    fits: Sequence[FitResult],
    recordings: Sequence[RecordingSummary | Recording],
    output_dir: str | os.PathLike[str],
    *,
    created: datetime,
    recipe_text: str = "",
    sheets: Sequence[FactSheet] = (),
    checks: Mapping[str, VerifyResult] | None = None,
    geometry: Geometry | None = None,
    inputs_hash: str = "",
) -> ReportFiles:
    """Write ``report.html`` and ``report.json`` into ``output_dir``, replacing earlier ones.

    The page needs nothing from outside itself; the twin holds the same facts. Recordings name the
    strokes and their speeds, and are matched to ``FitResult.sources`` by path, file name or hash;
    a fit can be reported without them, but only those with their samples give the work of each
    stroke. ``recipe_text`` is the recipe as it was written; without it the values are printed as
    read. ``sheets`` are further sections, such as a package's promises or a run of the loop
    (:func:`sheet_from_mapping`); ``checks`` are trust checks by fit, ``geometry`` what photographs
    gave, whose pictures the page carries as far as they leave it small. ``created`` must carry its
    time zone. The same input gives the same bytes; a report there that says just the same keeps
    its time.

    Raises MissingError where there is no fit, InputError where ``output_dir`` cannot be written.
    """
    from scissorcal.report.page import draw_fit, draw_scene, whole_page
    from scissorcal.report.twin import twin_text

    if created.tzinfo is None:
        raise ValueError("created needs a time zone, for example datetime.now(timezone.utc)")
    geometry = geometry or Geometry()
    if not fits and not geometry.fits:
        raise MissingError(
            "There is nothing to report yet: no fit was found. Run scissorcal fit, then "
            "scissorcal report again."
        )
    evidence = Evidence(
        tuple(
            summarise_recording(recording) if isinstance(recording, Recording) else recording
            for recording in recordings
        ),
        tuple(recording for recording in recordings if isinstance(recording, Recording)),
        checks or {},
        geometry,
    )
    document, materials = compose(
        recipe,
        fits,
        evidence,
        sheets,
        recipe_text=recipe_text,
        created=created,
        version=__version__,
    )
    document = replace(document, inputs_hash=inputs_hash)
    document = _with_earlier_time(document, Path(output_dir) / "report.json")
    views = [draw_fit(material) for material in materials]
    page = whole_page(document, views, draw_scene(document, recipe, fits), geometry)
    files = ReportFiles(Path(output_dir) / "report.html", Path(output_dir) / "report.json")
    _write_both(files, page, twin_text(document))
    return files


def facts_of(recipe: Recipe, fits: Sequence[FitResult]) -> ReportDocument:
    """What a report of these fits would say, without recordings and figures."""
    document, _ = compose(
        recipe,
        fits,
        Evidence(),
        (),
        recipe_text="",
        created=datetime.now(UTC),
        version=__version__,
    )
    return document


def side_of_fit(fit: FitResult, source: str, recipe: Recipe | None) -> Side:
    """A fit alone as one side of a comparison; ``recipe`` says what it is of, if that is known."""
    section = compose_fit(fit, fit.what).section
    verdicts = gather_verdicts(fit.verdicts).rows
    if recipe is None:
        return Side(source, "", None, verdicts, (section,), None)
    return Side(source, recipe.material.name, scene_facts(recipe), verdicts, (section,), None)


def write_comparison(
    found: Comparison, first: Side, second: Side, output_dir: str | os.PathLike[str]
) -> ReportFiles:
    """Write ``comparison.html`` and ``comparison.json``; InputError where that cannot be done."""
    from scissorcal.report.comparison_page import comparison_text
    from scissorcal.report.twin import twin_text

    folder = Path(output_dir)
    files = ReportFiles(folder / "comparison.html", folder / "comparison.json")
    _write_both(files, comparison_text(found, first, second), twin_text(found))
    return files


def _with_earlier_time(document: ReportDocument, path: Path) -> ReportDocument:
    """The document, with the time of the report there where that says just the same."""
    from scissorcal.report.twin import twin_text

    try:
        there = path.read_text(encoding="utf-8")
        created = datetime.fromisoformat(json.loads(there)["created"])
    except (OSError, ValueError, KeyError, TypeError):
        return document
    earlier = replace(document, created=created)
    return earlier if twin_text(earlier) == there else document


def _write_both(files: ReportFiles, page: str, twin: str) -> None:
    """Write beside the old files first, so that a failure leaves those whole."""
    folder = files.html.parent
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for path, text in ((files.html, page), (files.json, twin)):
            path.with_name(path.name + ".part").write_text(text, encoding="utf-8")
        for path in (files.html, files.json):
            path.with_name(path.name + ".part").replace(path)
    except OSError as error:
        raise InputError(
            f"The report cannot be written to {folder}: {error.strerror or error}. Free that "
            "place or name another output folder."
        ) from error
