"""Reports that several tests read, each built once."""

import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest

from scissorcal.calibration import FitResult
from scissorcal.recipe import Recipe, recipe_path
from scissorcal.report import RecordingSummary, build_report, sheet_from_mapping
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
    recordings: Sequence[RecordingSummary],
    **more: Any,
) -> Built:
    """Build a report of the paper recipe, and read it back."""
    files = build_report(paper(), shown, recordings, folder, created=CREATED, **more)
    return Built(folder, read_page(files.html), read_twin(files.json))


@pytest.fixture(scope="session")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Built:
    """Friction and cut with their recordings, the recipe's text, and a run of the loop."""
    sheet = sheet_from_mapping(
        "Loop",
        "loop",
        {"latency": {"p50_us": 61.2, "p99_us": 112.0}, "misses": 0},
        verdicts=[Verdict("render", "misses", "pass", 0.0, 0.0, "No tick was missed.")],
    )
    return built(
        tmp_path_factory.mktemp("whole"),
        [fits.friction_fit(), fits.cut_fit()],
        [fits.friction_recording(), fits.cut_recording()],
        recipe_text=paper_text(),
        sheets=[sheet],
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
