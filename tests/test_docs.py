"""The documentation: links, words, drawings, generated pages, commands and code of the README."""

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from benchmarks.draw_docs import PICTURES

from scissorcal.cli.root import run
from scissorcal.recording import CONTROL, read_telemetry
from tests.test_imports import LEAVES, MAY_IMPORT

ROOT = Path(__file__).parents[1]
PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])
API_PAGE = re.compile(r"docs/api/scissorcal[\w.]*\.md")
"""Made by the build of the site, which tests/test_site.py follows every link of."""
PROSE_FOLDERS = ("docs", "docs/build", "docs/tutorial", "docs/how-to", "docs/explanation")
PROSE = [
    *(page for page in PAGES if page.parent.relative_to(ROOT).as_posix() in PROSE_FOLDERS),
    ROOT / "README.md",
    ROOT / "CONTRIBUTING.md",
]
EMPS = ROOT.parent / "shared" / "data" / "emps" / "DATA_EMPS.mat"
SOURCES = ("src", "tests", "benchmarks", "docs", "build_backend", "firmware")
SOURCE_FILE = re.compile(r"`([\w/]+\.(?:py|c|h|mjs))`")
LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")
FENCE = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)


def anchors_of(page: Path) -> set[str]:
    """The anchors that a page's headings get: lower case, words joined by hyphens."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=[str(page.relative_to(ROOT)) for page in PAGES])
def test_links_resolve(page):
    text = FENCE.sub("", page.read_text(encoding="utf-8"))
    broken = []
    for link in LINK.findall(text):
        if re.match(r"[a-z]+:", link):
            continue
        name, _, anchor = link.partition("#")
        target = page.parent / name if name else page
        if API_PAGE.fullmatch(Path(os.path.relpath(target, ROOT)).as_posix()):
            continue
        if not target.exists() or (anchor and anchor not in anchors_of(target)):
            broken.append(link)
    assert not broken


@pytest.mark.parametrize("page", PAGES, ids=[str(page.relative_to(ROOT)) for page in PAGES])
def test_nothing_is_left_to_fill_in(page):
    comments = re.findall(r"<!--.*?-->", page.read_text(encoding="utf-8"), re.DOTALL)
    assert not [text for text in comments if not re.fullmatch(r"<!-- (end of )?[A-Z_]+ -->", text)]


def test_every_decision_has_its_number_once():
    pages = [page for page in PAGES if page.parent.name == "decisions"]
    numbers = [page.name[:3] for page in pages]
    assert len(set(numbers)) == len(numbers)
    for page in pages:
        title = page.read_text(encoding="utf-8").splitlines()[0]
        assert title.startswith(f"# {page.name[:3]} "), page.name


# ------------------------------------------------------------------------------------- words


def words_not_used() -> list[str]:
    """The first column of the glossary's last table."""
    table = (ROOT / "docs" / "glossary.md").read_text(encoding="utf-8").partition("do not use |")[2]
    rows = [row.split("|")[1] for row in table.splitlines() if row.startswith("| ")]
    return [word.strip() for row in rows for word in row.split(",")]


def prose_of(page: Path) -> str:
    """A page without code, link targets, generated rows, and the list of words itself."""
    text = FENCE.sub("", page.read_text(encoding="utf-8"))
    text = text.partition("## Words not used")[0]
    generated = re.compile(r"    |\| [a-z.]+ \| \*|\| \d+ \| ")
    text = "\n".join(row for row in text.splitlines() if not generated.match(row))
    return re.sub(r"`[^`]*`|\]\([^)]*\)", " ", text)


def test_the_list_of_words_is_read():
    assert {"rung", "ladder", "mend", "told apart", "came from nothing"} <= set(words_not_used())


@pytest.mark.parametrize("page", PROSE, ids=[page.name for page in PROSE])
def test_pages_use_the_words_of_the_glossary(page):
    text = " ".join(prose_of(page).split())
    found = [w for w in words_not_used() if re.search(rf"\b{re.escape(w)}\b", text, re.IGNORECASE)]
    assert not found


def test_the_glossary_defines_every_promise():
    text = (ROOT / "docs" / "glossary.md").read_text(encoding="utf-8")
    promises = text.partition("## Words that promise something")[2].partition("\n## ")[0]
    for word in ("done", "complete", "trusted", "verified", "safe", "signed", "stale"):
        assert re.search(rf"^\| \*\*[^|]*\b{word}\b", promises, re.MULTILINE), word


def test_names_in_the_glossary_are_in_the_files_it_links_to():
    text = (ROOT / "docs" / "glossary.md").read_text(encoding="utf-8")
    rows = re.findall(r"\| `(\w+)`[^|]*\|[^|]*\|[^|]*\| \[[\w.]+\]\(([^)]*)\)", text)
    assert len(rows) > 20
    for name, path in rows:
        code = (ROOT / "docs" / path).read_text(encoding="utf-8")
        assert re.search(rf"\b{name}", code), (name, path)


def test_the_table_of_rooms_is_that_of_the_import_rules():
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    stated: dict[str, set[str]] = {}
    for rooms, may in re.findall(r"^\| (`.*?) \| [^|]* \| ([^|]*) \|$", text, re.MULTILINE):
        above = set(stated) - LEAVES
        words = {"all of the above": above, "-": set()}
        allowed = words.get(may) if may in words else set(may.split(", "))
        stated |= dict.fromkeys(re.findall(r"`(\w+)`", rooms), allowed)
    rooms = {room: may for room, may in MAY_IMPORT.items() if room not in {"<root>", "__main__"}}
    assert stated == rooms


def test_source_files_that_pages_name_are_there():
    files = [path for place in SOURCES for path in (ROOT / place).rglob("*") if path.is_file()]
    known = {"/setup.py", *(f"/{path.relative_to(ROOT).as_posix()}" for path in files)}
    named = [
        (page, name)
        for page in PAGES
        if page.name != "CHANGELOG.md"
        for name in SOURCE_FILE.findall(page.read_text(encoding="utf-8"))
    ]
    assert len(named) > 50
    ends = {path[at:] for path in known for at, sign in enumerate(path) if sign == "/"}
    wrong = [f"{page}: {name}" for page, name in named if f"/{name}" not in ends]
    assert not wrong, "\n".join(wrong)


# --------------------------------------------------------------------------- generated pages


def tables(docs: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, docs / "tools" / "tables.py", "--check"]
    return subprocess.run(command, capture_output=True, text=True)


def test_tables_of_verdicts_and_stops_are_up_to_date():
    done = tables(ROOT / "docs")
    assert done.returncode == 0, done.stderr


def test_a_stale_table_is_reported(tmp_path):
    copy = tmp_path / "docs"
    (copy / "tools").mkdir(parents=True)
    for name in ("tools/tables.py", "verdicts.md", "loop.md"):
        shutil.copy(ROOT / "docs" / name, copy / name)
    (tmp_path / "src").symlink_to(ROOT / "src")
    page = copy / "loop.md"
    page.write_text(page.read_text(encoding="utf-8") + "| OLD | 99 | Old. |\n", encoding="utf-8")
    done = tables(copy)
    assert done.returncode == 1
    assert "loop.md is not up to date: run 'make schemas'." in done.stderr
    assert "verdicts.md" not in done.stderr


def test_drawings_are_those_of_the_script(tmp_path):
    command = [sys.executable, "-m", "benchmarks.draw_docs", "--out", str(tmp_path)]
    subprocess.run(command, cwd=ROOT, check=True)
    names = sorted(path.name for path in tmp_path.iterdir())
    assert names == sorted(f"{name}.svg" for name in PICTURES)
    for name in names:
        committed = (ROOT / "docs" / "pictures" / name).read_text(encoding="utf-8")
        assert committed == (tmp_path / name).read_text(encoding="utf-8"), name


# --------------------------------------------------------------------------- README: commands


def readme_blocks(language: str) -> list[list[str]]:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    blocks = re.findall(rf"^```{language}\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    return [block.splitlines() for block in blocks]


def simulated(line: str) -> list[str]:
    """A line of the README as words, with the virtual rig and camera in place of real ones."""
    words = shlex.split(line, comments=True)
    words = [
        "sim" if word.startswith("/dev/") or word == "positions.csv" else word for word in words
    ]
    if "--image" in words:
        at = words.index("--image")
        words[at : at + 2] = ["--camera", "sim"]
    return [str(EMPS) if word == EMPS.name else word for word in words]


def run_block(lines: list[str], folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    for line in lines:
        words = simulated(line)
        if words[:1] == ["cd"]:
            monkeypatch.chdir(words[1])
        elif words[:2] != [
            "scissorcal",
            "verify",
        ]:  # statistics
            assert words[0] == "scissorcal", line
            with pytest.raises(SystemExit) as ended:
                run(words[1:])
            assert ended.value.code == 0, line


def test_the_make_targets_of_the_readme_exist():
    targets = [shlex.split(line, comments=True)[1] for line in readme_blocks("sh")[0]]
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    assert targets == ["demo", "test"]
    for target in targets:
        assert re.search(rf"^{target}:", makefile, re.MULTILINE)


def test_the_other_blocks_of_the_readme_hold_commands_alone():
    assert len(readme_blocks("sh")) == 5
    blocks = [line for block in readme_blocks("sh")[1:] for line in block]
    assert sum("capture plate" in line and "--positions" in line for line in blocks) == 1
    assert all(shlex.split(line, comments=True)[0] in ("scissorcal", "cd") for line in blocks)


@pytest.mark.slow
def test_the_day_of_the_readme_ends_in_a_torque_that_cuts(tmp_path, monkeypatch):
    (_, day, *_), (code,) = readme_blocks("sh"), readme_blocks("python")
    run_block(day, tmp_path, monkeypatch)
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    exec("\n".join(code), names)
    package, table = names["package"], names["table"]
    closing = float(package.torque(0.4, -0.2, 0.02))
    opening = float(package.torque(0.4, 0.2, 0.02))
    assert closing == pytest.approx(0.047, abs=0.001)
    assert opening == pytest.approx(0.019, abs=0.001)
    friction = float(package.kernel().step(0.4, -0.2, -0.2).friction_torque)
    assert closing > 2 * abs(friction)
    assert names["low"] < closing < names["high"]
    assert "opening_rad" in table.columns
    assert [p.name for p in names["fit"].parameters][-1] == "kappa"


@pytest.mark.slow
def test_the_photographed_day_of_the_readme(tmp_path, monkeypatch):
    run_block(readme_blocks("sh")[2], tmp_path, monkeypatch)
    assert list((tmp_path / "my-photos" / "package").glob("*.zip"))


@pytest.mark.slow
def test_the_plate_of_the_readme_is_pressed_on(tmp_path, monkeypatch):
    (tmp_path / "path.csv").write_text("x_mm\n20\n60\n", encoding="utf-8")
    run_block(readme_blocks("sh")[3], tmp_path, monkeypatch)
    (recorded,) = (tmp_path / "my-plate" / "captures").glob("control-*.mcap")
    force = read_telemetry(recorded, CONTROL)
    settled = force["force_aim"] >= 0.99 * force["force_wanted"]
    assert np.count_nonzero(settled) > 3_000
    assert np.abs(force["force"][settled] - 2.0).mean() < 0.05


@pytest.mark.slow
@pytest.mark.skipif(not EMPS.is_file(), reason="the EMPS data set is not beside the project")
def test_the_import_of_the_readme(tmp_path, monkeypatch):
    run_block(readme_blocks("sh")[4], tmp_path, monkeypatch)
    assert (tmp_path / "emps" / "fits" / "friction.nc").is_file()


# ----------------------------------------------------------------------------------- notebooks

NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))


@pytest.fixture(scope="module")
def demo_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the workspace of a demo, which the notebooks read."""
    folder = tmp_path_factory.mktemp("notebooks")
    command = "from scissorcal.cli import main; main()"
    options = ["demo", "--recipe", "paper-80gsm", "--folder", str(folder / "demo-workspace")]
    subprocess.run([sys.executable, "-c", command, *options], check=True, capture_output=True)
    return folder


@pytest.mark.slow
@pytest.mark.parametrize("path", NOTEBOOKS, ids=[path.stem for path in NOTEBOOKS])
def test_notebook_runs(path: Path, demo_folder: Path):
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    notebook = nbformat.read(path, as_version=4)
    if "log_likelihood" in path.read_text(encoding="utf-8"):
        fit = (demo_folder / "demo-workspace" / "fits" / "friction.nc").read_bytes()
        if b"log_likelihood" not in fit:
            pytest.skip("these fits are stored without log-likelihoods")
    resources = {"metadata": {"path": str(demo_folder)}}
    nbclient.NotebookClient(notebook, timeout=600, resources=resources).execute()


@pytest.mark.parametrize("path", NOTEBOOKS, ids=[path.stem for path in NOTEBOOKS])
def test_notebook_is_committed_with_small_outputs(path: Path):
    notebook = json.loads(path.read_text(encoding="utf-8"))
    cells = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    outputs = [output for cell in cells for output in cell["outputs"]]
    assert outputs
    assert not any(output["output_type"] == "error" for output in outputs)
    assert path.stat().st_size < 200_000
    assert str(Path.home()) not in path.read_text(encoding="utf-8")
