"""One browser for all tests of a process, and the designer alone in a page."""

import asyncio
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser

from tests.browser import close_used, open_browser
from tests.prototype.design_bed import Bed, open_bed


@pytest.fixture(scope="session")
def launched() -> Iterator[tuple[Browser, asyncio.AbstractEventLoop]]:
    with open_browser() as found:
        loop = asyncio.get_running_loop()
        asyncio._set_running_loop(None)
        yield found, loop
        asyncio._set_running_loop(loop)


@pytest.fixture(scope="module")
def browser(launched: tuple[Browser, asyncio.AbstractEventLoop]) -> Iterator[Browser]:
    """The process's browser, without the pages of other files.

    Between its calls, playwright's loop counts as running; where no file uses it, it does not, so
    that the tests there can run loops of their own.
    """
    found, loop = launched
    asyncio._set_running_loop(loop)
    yield found
    close_used(found)
    asyncio._set_running_loop(None)


@pytest.fixture
def bed(browser: Browser, tmp_path: Path) -> Iterator[Bed]:
    """The designer as it is first shown; some files have another of this name."""
    with open_bed(browser, tmp_path) as found:
        found.mount()
        yield found
