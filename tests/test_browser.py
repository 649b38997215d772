"""The test bed of pages: where a browser is looked for, and what a page's misdeeds leave behind."""

from pathlib import Path

import pytest

from tests import browser
from tests.browser import bundled, open_browser, open_file


@pytest.fixture
def no_browser(monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    monkeypatch.delenv("SCISSORCAL_CHROMIUM", raising=False)
    monkeypatch.delenv("SCISSORCAL_BROWSER", raising=False)
    monkeypatch.setattr(browser.shutil, "which", lambda name: None)
    return monkeypatch


def test_without_a_browser_tests_are_skipped(no_browser: pytest.MonkeyPatch) -> None:
    with pytest.raises(pytest.skip.Exception, match="SCISSORCAL_CHROMIUM names another"):
        browser.chromium()


def test_where_one_is_required_tests_fail_instead(no_browser: pytest.MonkeyPatch) -> None:
    no_browser.setenv("SCISSORCAL_BROWSER", "required")
    with pytest.raises(pytest.fail.Exception, match="no chromium"):
        browser.chromium()


def test_a_named_browser_comes_first(no_browser: pytest.MonkeyPatch, tmp_path: Path) -> None:
    no_browser.setattr(browser.shutil, "which", lambda name: f"/usr/bin/{name}")
    assert browser.chromium() == "/usr/bin/chromium"
    no_browser.setenv("SCISSORCAL_CHROMIUM", str(tmp_path / "mine"))
    assert browser.chromium() == str(tmp_path / "mine")


def test_a_request_to_elsewhere_and_an_error_are_seen(tmp_path: Path) -> None:
    file = tmp_path / "page.html"
    file.write_text(
        "<!doctype html><title>bad</title><script>"
        "fetch('https://elsewhere.invalid/a').catch(() => { document.title = 'refused'; });"
        "setTimeout(() => { throw new Error('thrown'); });</script>",
        encoding="utf-8",
    )
    with open_browser() as chromium:
        page, seen = open_file(chromium, file)
        page.wait_for_function("document.title === 'refused'")
        assert seen.requests == [file.as_uri(), "https://elsewhere.invalid/a"]
        assert seen.elsewhere == ["https://elsewhere.invalid/a"]
        assert any("thrown" in error for error in seen.errors)


TIMED = """() => new Promise((done) => {
  const begin = performance.now(), seen = [];
  const note = (name) => () => seen.push([name, Math.round(performance.now() - begin)]);
  const each = setInterval(note("each"), 40);
  setTimeout(note("late"), 100);
  setTimeout(note("soon"), 50);
  const never = setTimeout(note("never"), 60);
  clearTimeout(never);
  setTimeout((name) => { note(name)(); clearInterval(each); }, 121, "given");
  setTimeout(() => setTimeout(() => done(seen), 1), 200);
})"""


@pytest.mark.parametrize("slowed", [1, 20])
def test_timers_go_by_the_time_of_the_page_on_a_slow_computer_too(
    tmp_path: Path, slowed: int
) -> None:
    file = tmp_path / "page.html"
    file.write_text("<!doctype html><p>Nothing.</p>", encoding="utf-8")
    with open_browser() as chromium:
        page, _ = open_file(chromium, file)
        of_page = page.context.new_cdp_session(page)
        of_page.send("Emulation.setCPUThrottlingRate", {"rate": slowed})
        each = [["each", 40], ["soon", 50], ["each", 80], ["late", 100], ["each", 120]]
        assert page.evaluate(TIMED) == [*each, ["given", 121]]


def test_webgl_is_there_without_a_graphics_card(tmp_path: Path) -> None:
    file = tmp_path / "page.html"
    file.write_text("<!doctype html><canvas id=c></canvas>", encoding="utf-8")
    with open_browser() as chromium:
        page, _ = open_file(chromium, file)
        assert page.evaluate("document.getElementById('c').getContext('webgl2') !== null")


def test_a_text_is_bundled_with_modules_of_the_page() -> None:
    script = bundled('import { TABLE_NAMES } from "./src/kernel"; console.log(TABLE_NAMES);')
    assert "friction_opening" in script
    assert "import" not in script.split("(() =>")[0]
