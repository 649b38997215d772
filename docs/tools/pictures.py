"""Make every picture of README and documentation: drawings, the tutorials' days, the pages.

    python -m docs.tools.pictures [--out docs/pictures]

A tutorial's commands are those of its page: each block is run, and the pictures that follow it are
taken of what its last command printed, or of the report and the page that it wrote. Beside the
decision page its words are kept (decision-page.json); tests/test_tutorials.py compares them with
what the product shows now.
"""

import argparse
import json
import math
import os
import re
import shlex
import subprocess
import sys
import tempfile
import textwrap
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from shutil import which
from xml.sax.saxutils import escape

from PIL import Image
from playwright.sync_api import Browser, Page, sync_playwright

ROOT = Path(__file__).resolve().parents[2]
TUTORIALS = ("virtual-rig", "joint-log", "photographs")
BLOCK = re.compile(r"^```sh\n(?P<code>.*?)^```|!\[[^\]]*\]\((?P<picture>[^)]+)\)", re.M | re.S)
STAMP = re.compile(r"20\d{6}T\d{6}Z|20\d\d-\d\d-\d\d([T ]\d\d:\d\d(:\d\d)?)?(\+00:00| UTC)?")
COLUMNS, ROWS = 112, 40
DECISION = "#decision"
BOLD = ' font-weight="bold" fill="#0072B2"'
BEGINS = {"tutorial-joint-compare.svg": "Logs that the fit did not see"}
"""Words that a picture of a long text begins with, where the text has them."""
BROWSERS = ("chromium", "chromium-browser", "google-chrome")


@dataclass(frozen=True)
class Step:
    """A block of a tutorial: its commands, the pictures that follow it."""

    commands: tuple[str, ...]
    pictures: tuple[str, ...]


@dataclass(frozen=True)
class Done:
    """What a block printed last, and the folder in which it ended."""

    folder: Path
    command: str
    printed: str


def steps(tutorial: str) -> list[Step]:
    """The blocks of a tutorial's page in their order."""
    text = (ROOT / "docs" / "tutorial" / f"{tutorial}.md").read_text(encoding="utf-8")
    parts: list[tuple[tuple[str, ...], list[str]]] = []
    for match in BLOCK.finditer(text):
        if match["code"] is not None:
            parts.append((tuple(match["code"].splitlines()), []))
        elif parts:
            parts[-1][1].append(Path(match["picture"]).name)
    return [Step(commands, tuple(pictures)) for commands, pictures in parts]


def run_tutorial(tutorial: str, folder: Path) -> Iterator[tuple[Step, Done]]:
    """Run a tutorial block by block in a folder; a command that fails raises its error text."""
    for step in steps(tutorial):
        printed = command = ""
        for command in step.commands:
            words = shlex.split(command)
            if words[0] == "cd":
                folder = folder / words[1]
            elif words[0] == "mv":
                (moved,) = folder.glob(words[1])
                moved.rename(folder / words[2])
            else:
                printed = _run(words, folder)
        yield step, Done(folder, command, printed)


def _run(words: list[str], folder: Path) -> str:
    if words[0] != "scissorcal":
        raise ValueError(f"A tutorial runs scissorcal alone, not {words[0]}.")
    env = os.environ | {"COLUMNS": str(COLUMNS)}
    line = [sys.executable, "-m", "scissorcal", *words[1:]]
    done = subprocess.run(line, cwd=folder, env=env, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f"{shlex.join(words)} ended with {done.returncode}:\n{done.stderr}")
    return done.stdout


# ------------------------------------------------------------------------------- of a terminal


def terminal(command: str, printed: str, begins: str = "") -> str:
    """What a command printed, as SVG, with one stamp for all times: two runs give one picture.

    The text may begin at the line that begins with some words.
    """
    if begins:
        _, mark, after = printed.partition(f"\n{begins}")
        printed = f"...\n{mark}{after}" if mark else printed
    lines = textwrap.wrap(f"$ {command}", COLUMNS - 4, subsequent_indent="      ")
    bold = len(lines)
    for line in STAMP.sub("2026-01-01", printed).rstrip().splitlines():
        lines += textwrap.wrap(line, COLUMNS, subsequent_indent="    ", drop_whitespace=False) or [
            ""
        ]
    if len(lines) > ROWS:
        lines = [*lines[: ROWS - 12], "...", *lines[-11:]]
    width, height = 9 * COLUMNS + 40, 20 * len(lines) + 36
    rows = [
        f'<text x="20" y="{34 + 20 * number}" xml:space="preserve"'
        f"{BOLD if number < bold else ''}>{escape(line)}</text>"
        for number, line in enumerate(lines)
    ]
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}"'
        f' height="{height}" font-family="DejaVu Sans Mono, Menlo, Consolas, monospace"'
        f' font-size="14.5" fill="#1f2933" role="img"><title>{escape(command)}</title>'
        f'<rect width="{width}" height="{height}" rx="10" fill="#f7f8fa" stroke="#d5dbe1"/>'
    )
    return "\n".join([head, *rows, "</svg>", ""])


# --------------------------------------------------------------------------------- of a browser


@contextmanager
def browser() -> Iterator[Browser]:
    """A Chromium of this computer: SCISSORCAL_CHROMIUM, or one that is installed."""
    path = os.environ.get("SCISSORCAL_CHROMIUM") or next(filter(None, map(which, BROWSERS)), None)
    if path is None:
        raise RuntimeError(f"None of {', '.join(BROWSERS)} is here; SCISSORCAL_CHROMIUM names one.")
    flags = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=path, args=flags)
        yield chromium
        chromium.close()


@contextmanager
def opened(chromium: Browser, file: Path, width: int, height: int) -> Iterator[Page]:
    """A file in a page without network."""
    context = chromium.new_context(
        viewport={"width": width, "height": height}, color_scheme="light", offline=True
    )
    page = context.new_page()
    page.goto(file.resolve().as_uri())
    yield page
    context.close()


def decision_page(chromium: Browser, folder: Path, out: Path) -> None:
    """The report's first page, and its words beside it."""
    report = folder / "report" / "report.html"
    with opened(chromium, report, 1400, 1000) as page:
        page.locator(DECISION).screenshot(path=out)
        words = words_of(page.locator(DECISION).inner_text())
    text = json.dumps(words, indent=1, ensure_ascii=False)
    out.with_suffix(".json").write_text(text + "\n", encoding="utf-8")


def words_of(text: str) -> list[str]:
    """Words and numbers of a page, without stamps of time."""
    return STAMP.sub("", text).split()


def friction_section(chromium: Browser, folder: Path, out: Path) -> None:
    """The head of the report's part on friction."""
    with opened(chromium, folder / "report" / "report.html", 1100, 1000) as page:
        page.evaluate("document.querySelectorAll('details').forEach(part => { part.open = true; })")
        page.locator("#friction").evaluate("part => part.scrollIntoView({block: 'start'})")
        page.screenshot(path=out)


def page_of_joint(chromium: Browser, folder: Path, out: Path) -> None:
    """The page of an identified joint, with every part open."""
    with opened(chromium, folder / "joint.html", 1100, 1000) as page:
        page.evaluate("document.querySelectorAll('details').forEach(part => { part.open = true; })")
        page.get_by_text("Friction curve").last.evaluate(
            "part => part.scrollIntoView({block: 'start'})"
        )
        page.screenshot(path=out)


def page_of_package(chromium: Browser, folder: Path, out: Path) -> None:
    """The page of a package while it cuts, at its widest layout."""
    (file,) = folder.glob("my-*.html")
    with opened(chromium, file, 1280, 1000) as page:
        page.get_by_role("button", name="One stroke").first.click()
        page.wait_for_timeout(2500)
        page.screenshot(path=out)


def edge_of_page(chromium: Browser, folder: Path, out: Path) -> None:
    """The designer with the fitted blades as points, bent."""
    (file,) = folder.glob("my-*.html")
    with opened(chromium, file, 1280, 1400) as page:
        page.locator("details.designer > summary").click()
        page.get_by_role("button", name="Points of the blades as fitted").click()
        for corner in range(1, 13):
            field = page.get_by_label(f"offset of corner {corner}, mm")
            bend = 1.2 * math.exp(-(((corner - 6) / 2.5) ** 2))
            field.fill(f"{float(field.input_value()) + bend:.3f}")
            page.keyboard.press("Enter")
        page.wait_for_timeout(500)
        page.locator(".design").first.screenshot(path=out)


def blade_photograph(_: Browser, folder: Path, out: Path) -> None:
    """The first photograph of the blade with the edge that was measured in it."""
    first = sorted((folder / "fits").glob("blade*/*.png"))[0]
    with Image.open(first) as image:
        small = image.convert("RGB")
        small.thumbnail((1200, 900))
        small.save(out, quality=82)


TAKEN: dict[str, Callable[[Browser, Path, Path], None]] = {
    "tutorial-rig-report.png": decision_page,
    "tutorial-rig-friction.png": friction_section,
    "tutorial-rig-page.png": page_of_package,
    "tutorial-joint-page.png": page_of_joint,
    "tutorial-photos-blade.jpg": blade_photograph,
    "decision-page.png": decision_page,
}
"""Pictures that are not what a command printed."""
AFTERWARDS: dict[str, Callable[[Browser, Path, Path], None]] = {
    "prototype.png": page_of_package,
    "prototype-edge.png": edge_of_page,
}
"""Pictures of the photographs' day that other pages show."""


def main() -> None:
    """Make every picture."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "pictures")
    out = parser.parse_args().out
    out.mkdir(parents=True, exist_ok=True)
    drawings = [sys.executable, "-m", "benchmarks.draw_docs", "--out", str(out.resolve())]
    subprocess.run(drawings, cwd=ROOT, check=True)
    with tempfile.TemporaryDirectory() as folder, browser() as chromium:
        for tutorial in TUTORIALS:  # the pages that are shown afterwards are those of the last
            for step, done in run_tutorial(tutorial, Path(folder)):
                print(f"{tutorial}: {done.command}", file=sys.stderr)
                for name in step.pictures:
                    take(chromium, name, done, out)
        for name, of_page in AFTERWARDS.items():
            of_page(chromium, done.folder, out / name)


def take(chromium: Browser, name: str, done: Done, out: Path) -> None:
    """Make one picture of a tutorial into ``out``."""
    if name in TAKEN:
        TAKEN[name](chromium, done.folder, out / name)
    else:
        text = terminal(done.command, done.printed, BEGINS.get(name, ""))
        (out / name).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
