"""The documentation's site: pages of every room, links, search without a server or network."""

import os
import re
import shutil
import subprocess
import sys
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "src" / "scissorcal"
pytest.importorskip("mkdocs", reason="mkdocs is not installed (the extra 'docs')")
pytestmark = pytest.mark.slow
WITHOUT_PAGE = {"bench", "cli", "foreign", "prototype"}
"""Rooms that serve the program itself."""


def build(root: Path, site: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "mkdocs", "build", "--site-dir", str(site)]
    env = os.environ | {"NO_MKDOCS_2_WARNING": "1"}
    return subprocess.run(command, cwd=root, env=env, capture_output=True, text=True)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("site")
    done = build(ROOT, folder)
    assert done.returncode == 0, done.stderr
    return folder


class Links(HTMLParser):
    """What a page links to, shows, and the anchors that it has."""

    def __init__(self) -> None:
        super().__init__()
        self.links: list[str] = []
        self.loaded: list[str] = []
        self.anchors: set[str] = set()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {name: value for name, value in attrs if value is not None}
        self.anchors |= {given[name] for name in ("id", "name") if name in given}
        if tag == "a" and "href" in given:
            self.links.append(given["href"])
        if tag in ("img", "script", "iframe", "source") and "src" in given:
            self.loaded.append(given["src"])
        if tag == "link" and given.get("rel") in ("stylesheet", "icon"):
            self.loaded.append(given["href"])


@cache
def links_of(page: Path) -> Links:
    parser = Links()
    parser.feed(page.read_text(encoding="utf-8"))
    return parser


def pages(site: Path) -> list[Path]:
    return [page for page in sorted(site.rglob("*.html")) if page.name != "404.html"]


def test_every_link_picture_and_anchor_is_there(site: Path) -> None:
    broken = []
    for page in pages(site):
        for link in links_of(page).links + links_of(page).loaded:
            parts = urlsplit(link)
            if parts.scheme:
                continue
            target = (page.parent / unquote(parts.path)).resolve() if parts.path else page
            anchor = unquote(parts.fragment)
            lost = target.suffix == ".html" and target.is_file() and anchor
            if not target.is_file() or (lost and anchor not in links_of(target).anchors):
                broken.append(f"{page.relative_to(site)}: {link}")
    assert len(pages(site)) > 150
    assert not broken, "\n".join(broken)


def test_nothing_is_loaded_from_the_network(site: Path) -> None:
    loaded = {link for page in pages(site) for link in links_of(page).loaded}
    assert not [link for link in loaded if urlsplit(link).scheme not in ("", "data")]


def test_every_page_is_reached_from_the_first(site: Path) -> None:
    seen, waiting = set(), [site / "index.html"]
    while waiting:
        page = waiting.pop()
        if page in seen or page.suffix != ".html":
            continue
        seen.add(page)
        names = (urlsplit(link) for link in links_of(page).links)
        waiting += [
            (page.parent / unquote(name.path)).resolve()
            for name in names
            if name.path and not name.scheme
        ]
    assert not set(pages(site)) - seen


def test_every_room_has_a_page_with_its_names(site: Path) -> None:
    rooms = {path.parent for path in PACKAGE.glob("*/__init__.pyi")}
    names = {room.name for room in rooms} - WITHOUT_PAGE
    assert {"vision", "recipe", "device", "render", "workday"} <= names
    for name in names:
        page = site / "api" / f"scissorcal.{name}.html"
        assert len(links_of(page).anchors) > 10, name


@pytest.mark.parametrize("name", ["inference.Effort", "inference.Stop", "recording.Kind"])
def test_a_type_has_its_values_and_what_it_is(site: Path, name: str) -> None:
    room, _, last = name.partition(".")
    text = (site / "api" / f"scissorcal.{room}.html").read_text(encoding="utf-8")
    _, heading, after = text.partition(f'<h2 id="scissorcal.{name}"')
    assert heading
    part = after.partition("<h2")[0]
    assert re.search(rf"{last}.*=.*<p>\w[^<]{{30}}", part, re.DOTALL)


def test_what_a_class_inherits_stands_on_its_page(site: Path) -> None:
    page = links_of(site / "api" / "scissorcal.recording.html")
    for member in ("append", "note", "mark", "attach", "poll", "close"):
        assert f"scissorcal.recording.RecordingWriter.{member}" in page.anchors, member


ANSWERS = {
    "which friction law": "faq.html",
    "it buzzes": "how-to/troubleshoot.html",
    "intervals are wide": "how-to/troubleshoot.html",
}


def test_the_search_answers_a_newcomer_without_a_server(site: Path) -> None:
    from tests.browser import open_browser

    with open_browser() as chromium:
        for question, answer in ANSWERS.items():
            page = chromium.new_context(offline=True).new_page()
            page.goto((site / "index.html").as_uri())
            page.locator(".md-search__input").click()
            page.keyboard.type(question)
            first = page.locator(".md-search-result__item a").first
            first.wait_for(state="attached")
            assert answer in str(first.get_attribute("href")), question


DEAD = {
    "[a page](missing.md)": "missing.md",
    "[a heading](index.md#nothing-here)": "nothing-here",
    "[a folder](missing/)": "missing",
    "![a picture](pictures/missing.svg)": "missing.svg",
    "[a source](../src/scissorcal/missing.py)": "missing.py",
}


def test_a_dead_link_stops_the_build(tmp_path: Path) -> None:
    for name in ("docs", "firmware", "data_schemas"):
        shutil.copytree(ROOT / name, tmp_path / name)
    for name in ("src", "benchmarks", "tests", "recipes", ".ci"):
        (tmp_path / name).symlink_to(ROOT / name)
    for path in [p for p in ROOT.iterdir() if p.is_file()]:
        shutil.copy(path, tmp_path / path.name)
    *inside, outside = DEAD
    page = tmp_path / "docs" / "bridge.md"
    text = page.read_text(encoding="utf-8")
    page.write_text("\n\n".join([text, *inside]), encoding="utf-8")
    done = build(tmp_path, tmp_path / "site")
    assert done.returncode != 0
    for link in inside:
        assert re.search(rf"WARNING.*{re.escape(DEAD[link])}", done.stderr), link
    page.write_text(f"{text}\n\n{outside}", encoding="utf-8")
    done = build(tmp_path, tmp_path / "site")
    assert done.returncode != 0
    assert f"links to ../src/scissorcal/{DEAD[outside]}, which is not there" in done.stderr
