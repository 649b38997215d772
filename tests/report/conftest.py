"""Reports that several tests read, each built once."""

import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest

from scissorcal.calibration import FitResult
from scissorcal.package import Review
from scissorcal.recipe import Recipe, recipe_path
from scissorcal.recording import Recording
from scissorcal.report import Evidence, Panel, build_report
from scissorcal.report.panel import Row, Value, count
from scissorcal.verdicts import Verdict
from tests.report import fits
from tests.report.pages import Page, read_page, read_twin

CREATED = datetime(2025, 1, 31, 15, 2, tzinfo=UTC)


@dataclass(frozen=True)
class Built:
    """A report on disk, its page as parsed, and its twin."""

    folder: Path
    page: Page
    twin: dict[str, Any]


def paper() -> Recipe:
    """The paper recipe that travels with the project."""
    return Recipe.model_validate(tomllib.loads(paper_text()))


def paper_text() -> str:
    """The same as it is written."""
    return recipe_path("paper-80gsm").read_text(encoding="utf-8")


def built(
    folder: Path,
    shown: Sequence[FitResult],
    recordings: Sequence[Recording],
    review: Review | None = None,
    **more: Any,
) -> Built:
    """Build a report of the paper recipe, and read it back."""
    evidence = Evidence(tuple(recordings), **more)
    files = build_report(paper(), shown, evidence, folder, created=CREATED, review=review)
    return Built(folder, read_page(files.html), read_twin(files.json))


@pytest.fixture(scope="session")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Built:
    """Friction and cut with their recordings, the recipe's text, and a run of the loop."""
    loop = Panel(
        "sheet-loop-facts",
        "sheet-loop",
        "Loop",
        rows=(
            Row("latency p50", (Value("value", 61.2, "µs", digits=4),)),
            Row("latency p99", (Value("value", 112.0, "µs", digits=4),)),
            Row("misses", (count("value", 0),)),
        ),
        verdicts=(Verdict("render", "misses", "pass", 0.0, 0.0, "No tick was missed."),),
    )
    return built(
        tmp_path_factory.mktemp("whole"),
        [fits.friction_fit(), fits.cut_fit()],
        [fits.friction_recording(), fits.cut_recording()],
        recipe_text=paper_text(),
        panels=(loop,),
    )


@pytest.fixture(scope="session")
def linear(tmp_path_factory: pytest.TempPathFactory) -> Built:
    """A sliding joint, without the recipe's text."""
    folder = tmp_path_factory.mktemp("linear")
    return built(folder, [fits.linear_fit()], [fits.linear_recording()])


@pytest.fixture(scope="session")
def lost(tmp_path_factory: pytest.TempPathFactory) -> Built:
    """Fits without a single finite number, and no recordings."""
    without = [fits.without_numbers(fit) for fit in (fits.friction_fit(), fits.cut_fit())]
    return built(tmp_path_factory.mktemp("lost"), without, [])
