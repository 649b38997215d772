"""What a signature covers: every file that a reviewer reads, and all that it rests on."""

from pathlib import Path
from typing import Any

from scissorcal.foreign import read_foreign
from scissorcal.foreign.formats import PAGE
from scissorcal.package.review import REPORT_PAGE, REPORT_TWIN, Review
from scissorcal.report.signature_block import unsigned_digest, with_signature
from scissorcal.workday.states import DayStates
from scissorcal.workday.steps import STEPS

COVERED = ("recordings", "photographs", "fit", "verify")
"""Kinds of steps whose files a report rests on, beside the recipe and its drawings."""


def reviewed_content(day: DayStates) -> dict[str, str]:
    """SHA-256 of every file that a signature made now would cover, by its name in the workspace."""
    workspace, index = day.workspace, day.index
    page, twin = workspace.report_html, workspace.report_json
    found = {REPORT_PAGE: _page_digest(day, page)} if page.is_file() else {}
    if twin.is_file():
        found[REPORT_TWIN] = index.digest(twin)
    drawn = (workspace.root / name for name in day.recipe.plate.drawings)
    for path in (workspace.recipe_path, *filter(Path.is_file, drawn), *_rests_on(day)):
        found[workspace.relative(path)] = index.digest(path)
    return found


def unlike_signed(day: DayStates, stored_review: dict[str, Any]) -> str:
    """Which of the files that a signature covers are not as they were signed; "" where all are."""
    changed = _changed_since(day, Review.model_validate(stored_review))
    if not changed:
        return ""
    more = f" and {len(changed) - 3} more" if len(changed) > 3 else ""
    found = f"{', '.join(changed[:3])}{more} since it was signed"
    if any(change.startswith("report/") for change in changed):
        found += "; 'scissorcal report' writes it anew"
    return found


def _changed_since(day: DayStates, review: Review) -> tuple[str, ...]:
    """Files that are not as they were signed, each with what happened to it."""
    now, page = reviewed_content(day), day.workspace.report_html
    found = []
    for name, signed in review.content.items():
        if name not in now:
            there = (day.workspace.root / name).is_file()
            found.append(f"{name} {'is no longer used' if there else 'is gone'}")
        elif now[name] != signed:
            found.append(f"{name} was changed")
    found += [f"{name} was added" for name in now.keys() - review.content.keys()]
    if not any(one.startswith(REPORT_PAGE) for one in found) and not _shows(page, review):
        found.append(f"{REPORT_PAGE} shows another signature")
    return tuple(found)


def _rests_on(day: DayStates) -> list[Path]:
    root, files = day.workspace.root, []
    for step in STEPS:
        if step.kind not in COVERED or not day.shown(step.name):
            continue
        for name in day.state(step.name).files:
            path = root / name
            files += _photographs(day, step.name) if path.is_dir() else [path]
    return [path for path in dict.fromkeys(files) if path.is_file()]


def _photographs(day: DayStates, name: str) -> list[Path]:
    """The index files and photographs of a step's folders."""
    from scissorcal.workday.facts import photographs

    found = []
    for folder in day.state(name).files:
        index = day.workspace.root / folder / "capture.json"
        facts: dict[str, Any] = day.index.facts(index, "photographs", photographs)
        found += [index, *(index.parent / file for file in facts["sha256"])]
    return found


def _page_digest(day: DayStates, page: Path) -> str:
    def read(path: Path) -> dict[str, Any]:
        return {"sha256": unsigned_digest(_page_text(path))}

    return str(day.index.facts(page, "sha256 without signature", read)["sha256"])


def _shows(page: Path, review: Review) -> bool:
    """Whether the page shows this signature and no other."""
    text = _page_text(page)
    try:
        return with_signature(text, review) == text
    except ValueError:
        return False


def _page_text(page: Path) -> str:
    """A page whatever its bytes: it is compared, not shown."""
    return read_foreign(page, PAGE).decode("utf-8", errors="surrogateescape")
