"""One browser for the tests of a file, and the designer alone in a page."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser

from tests.browser import open_browser
from tests.prototype.design_bed import Bed, open_bed


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with open_browser() as found:
        yield found


@pytest.fixture
def bed(browser: Browser, tmp_path: Path) -> Iterator[Bed]:
    """The designer as it is first shown; some files have another of this name."""
    with open_bed(browser, tmp_path) as found:
        found.mount()
        yield found
