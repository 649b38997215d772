"""Build a report: one offline HTML file to review, and its JSON twin."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from scissorcal import __version__
from scissorcal.calibration.result import FitResult
from scissorcal.errors import InputError, MissingError
from scissorcal.recipe.schema import Recipe
from scissorcal.recording.recording import Recording
from scissorcal.report.document import compose
from scissorcal.report.inputs import FactSheet, RecordingSummary, summarise_recording


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
) -> ReportFiles:
    """Write ``report.html`` and ``report.json`` into ``output_dir``, replacing earlier ones.

    The page needs nothing from outside itself; the twin holds the same facts. Recordings name the
    strokes and their speeds, and are matched to ``FitResult.sources`` by path, file name or hash;
    a fit can be reported without them. ``recipe_text`` is the recipe as it was written; without it
    the values are printed as read. ``sheets`` are further sections, such as a package's promises
    or a run of the loop (:func:`sheet_from_mapping`). ``created`` must carry its time zone. The
    same input gives the same bytes.

    Raises MissingError where there is no fit, InputError where ``output_dir`` cannot be written.
    """
    from scissorcal.report.page import draw_fit, page_text
    from scissorcal.report.twin import twin_text

    if created.tzinfo is None:
        raise ValueError("created needs a time zone, for example datetime.now(timezone.utc)")
    if not fits:
        raise MissingError(
            "There is nothing to report yet: no fit was found. Run scissorcal fit, then "
            "scissorcal report again."
        )
    summaries = [
        summarise_recording(recording) if isinstance(recording, Recording) else recording
        for recording in recordings
    ]
    document, materials = compose(
        recipe,
        fits,
        summaries,
        sheets,
        recipe_text=recipe_text,
        created=created,
        version=__version__,
    )
    page = page_text(document, [draw_fit(material) for material in materials])
    files = ReportFiles(Path(output_dir) / "report.html", Path(output_dir) / "report.json")
    _write_both(files, page, twin_text(document))
    return files


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
