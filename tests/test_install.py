"""docs/install.md says what each dependency of pyproject.toml is for, and of no other."""

import ast
import re
import tomllib
from pathlib import Path

import pytest

from scissorcal.errors import InputError, needs_extra

ROOT = Path(__file__).parents[1]
ROW = re.compile(r"^\| (?P<first>[^|]*) \| (?P<second>[^|]*) \|", re.MULTILINE)
EXTRA = re.compile(r"'(?:scissorcal|\.)\[(?P<names>[\w,]+)\]'")


@pytest.fixture(scope="module")
def project() -> dict[str, list[str]]:
    """The names that pyproject.toml requires: plain as "", then those of each extra."""
    if not (ROOT / "pyproject.toml").is_file():
        pytest.skip("runs from a checkout only")
    stated = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = stated["optional-dependencies"]
    return {what: [name_of(one) for one in ones] for what, ones in extras.items()} | {
        "": [name_of(one) for one in stated["dependencies"]]
    }


def name_of(requirement: str) -> str:
    """The package of a requirement, as package indices write it."""
    return re.split(r"[\[<>=!~; ]", requirement, maxsplit=1)[0].lower().replace("_", "-")


def rows_after(heading: str) -> dict[str, str]:
    """The rows of the first table after a line that begins so: first cell, second cell."""
    text = (ROOT / "docs" / "install.md").read_text(encoding="utf-8")
    _, found, after = text.partition(f"\n{heading}")
    assert found, heading
    table = after[after.index("\n| --- ") :].lstrip("\n").partition("\n\n")[0]
    return {row["first"]: row["second"] for row in ROW.finditer(table) if row["first"] != "---"}


def names_in(cells: list[str] | dict[str, str]) -> list[str]:
    return sorted(name for cell in cells for name in cell.split(", "))


def test_the_page_names_every_plain_dependency_and_no_other(project: dict[str, list[str]]) -> None:
    assert names_in(rows_after("## What each dependency")) == sorted(project[""])


def test_the_page_names_every_extra_with_its_packages(project: dict[str, list[str]]) -> None:
    rows = rows_after("## Extras")
    stated = {
        extra.strip("`"): names_in([re.sub(r" \([^)]*\)", "", packages)])
        for extra, packages in rows.items()
    }
    assert stated == {what: sorted(project[what]) for what in project if what not in ("", "dev")}


def test_the_page_names_what_only_tests_and_checks_use(project: dict[str, list[str]]) -> None:
    own = [name for name in project["dev"] if name != "scissorcal"]
    assert names_in(rows_after("The extra `dev`")) == sorted(own)


def test_the_extra_of_tests_brings_the_others_but_the_reference(
    project: dict[str, list[str]],
) -> None:
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    brought = re.search(r'"scissorcal\[([\w,]+)\]"', text)
    assert brought is not None
    assert set(brought[1].split(",")) == set(project) - {"", "dev", "reference"}


def test_every_command_that_installs_an_extra_names_one(project: dict[str, list[str]]) -> None:
    pages = [ROOT / "README.md", *(ROOT / "docs").glob("*.md")]
    modules = [path for path in (ROOT / "src/scissorcal").rglob("*.py") if "page" not in path.parts]
    texts = [path.read_text(encoding="utf-8") for path in (*pages, *modules)]
    named = {name for text in texts for one in EXTRA.findall(text) for name in one.split(",")}
    assert named <= set(project)
    refused = {extra for text in texts[len(pages) :] for extra in refused_in(text)}
    assert refused == {
        "analysis",
        "bench",
        "cluster",
        "keys",
        "moteus",
        "parquet",
        "plots",
        "prototype",
    }
    assert refused < set(project)


def refused_in(source: str) -> set[str]:
    """The extras that a module asks for by `needs_extra`."""
    return {
        ast.literal_eval(node.args[2])
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "needs_extra"
    }


def test_a_missing_extra_is_one_sentence_with_the_command() -> None:
    said = needs_extra("--plot", "matplotlib", "plots", "give --table FILE.csv")
    assert isinstance(said, InputError)
    assert said.exit_code == 2
    assert str(said) == (
        "--plot needs matplotlib, which is not installed: pip install 'scissorcal[plots]', or give "
        "--table FILE.csv."
    )
    assert str(needs_extra("A", "b", "c")).endswith("pip install 'scissorcal[c]'.")
