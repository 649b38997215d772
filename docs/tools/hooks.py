"""What mkdocs does not do by itself: pages of the API, of decisions, notebooks and the repository.

mkdocs reads this file (``hooks`` in mkdocs.yml). It adds, without writing into ``docs``:

- one page for each room of the API, from the names of its contract (``__init__.pyi``);
- an index of decisions and of notebooks, and each notebook as a page;
- the pages outside ``docs`` that pages link to, and source files as text.

Pages keep the links that a reader of the repository follows: each is translated here.
"""

import ast
import json
import os
import re
from collections.abc import Callable, Iterator
from pathlib import Path, PurePosixPath
from typing import Any

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "src" / "scissorcal"
ROOMS = (
    "scissorcal",
    "scissorcal.recipe",
    "scissorcal.recording",
    "scissorcal.model",
    "scissorcal.model.surface",
    "scissorcal.inference",
    "scissorcal.vision",
    "scissorcal.calibration",
    "scissorcal.package",
    "scissorcal.stated",
    "scissorcal.examples",
    "scissorcal.identify",
    "scissorcal.tracking",
    "scissorcal.kernel",
    "scissorcal.control",
    "scissorcal.device",
    "scissorcal.render",
    "scissorcal.report",
    "scissorcal.workday",
    "scissorcal.errors",
    "scissorcal.verdicts",
)
LINK = re.compile(r"(\]\()([^)\s]+)(\))")
CODE = re.compile(r"^( *)(```|~~~).*?^\1\2[ \t]*$|`[^`\n]*`", re.MULTILINE | re.DOTALL)
OUTSIDE = "repository"
"""Folder of the site with what stands outside ``docs``."""
BOOST = {"decisions": 0.2, "api": 0.3, OUTSIDE: 0.5, "tutorial": 1.5, "how-to": 2.0, "faq.md": 2.0}
"""Weights of the search by folder: a page that says what to do comes before why and what."""


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Put the pages of the API into the navigation, behind their index."""
    (api,) = (part["API"] for part in config.nav or () if "API" in part)
    api += [f"api/{name}.md" for name in ROOMS]
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add every generated page, and the files outside ``docs`` that pages link to."""
    for name in ROOMS:
        _add(files, config, f"api/{name}.md", _room_page(name))
    notebooks = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))
    for path in notebooks:
        _add(files, config, f"notebooks/{path.stem}.md", _notebook_page(path))
    _add(files, config, "notebooks/index.md", _index("Notebooks", _titles_of_notebooks(notebooks)))
    decisions = sorted((ROOT / "docs" / "decisions").glob("*.md"))
    titles = {path.name: _title(path.read_text(encoding="utf-8")) for path in decisions}
    _add(files, config, "decisions/index.md", _index("Decisions", titles))
    waiting = [(file.src_uri, file.content_string) for file in files.documentation_pages()]
    while waiting:
        uri, text = waiting.pop()
        for target in _outside(uri, text):
            if files.get_file_from_path(_uri_outside(target)) is None:
                added = _add_outside(files, config, target)
                if target.suffix == ".md":
                    waiting.append((added.src_uri, added.content_string))
    return files


def on_page_read_source(page: Page, config: MkDocsConfig) -> str | None:
    """Put the table of rooms where the API's first page has its mark."""
    if page.file.src_uri != "api/index.md":
        return None
    return page.file.content_string.replace("<!-- ROOMS -->", _table_of_rooms())


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Translate links to directories and to what stands outside ``docs``."""
    home = _home(page.file.src_uri)
    weight = BOOST.get(page.file.src_uri.partition("/")[0], 1.0)
    page.meta.setdefault("search", {"boost": weight})

    def translated(match: re.Match[str]) -> str:
        before, link, after = match.groups()
        target, anchor = _resolved(home, link)
        if target is None:
            return match[0]
        uri = _site_uri(target)
        here = PurePosixPath(page.file.src_uri).parent
        return f"{before}{os.path.relpath(uri, here)}{anchor}{after}"

    return _outside_code(markdown, lambda text: LINK.sub(translated, text))


# ------------------------------------------------------------------------------------ links


def _outside_code(markdown: str, change: Callable[[str], str]) -> str:
    parts, at = [], 0
    for code in CODE.finditer(markdown):
        parts += [change(markdown[at : code.start()]), code[0]]
        at = code.end()
    return "".join([*parts, change(markdown[at:])])


def _home(uri: str) -> Path:
    """The folder in the repository that a page's links are relative to."""
    if uri.startswith(f"{OUTSIDE}/"):
        return (ROOT / uri.removeprefix(f"{OUTSIDE}/")).parent
    return (ROOT / "docs" / uri).parent


def _resolved(home: Path, link: str) -> tuple[Path | None, str]:
    """The file or folder that a link names, with its anchor; None for addresses and anchors."""
    name, sign, anchor = link.partition("#")
    if not name or re.match(r"[a-z]+:", link):
        return None, ""
    return Path(os.path.normpath(home / name)), sign + anchor


def _site_uri(target: Path) -> str:
    if target.is_dir():
        return _index_of(target)
    if target.suffix == ".ipynb":
        return target.relative_to(ROOT / "docs").with_suffix(".md").as_posix()
    if target.is_relative_to(ROOT / "docs"):
        return target.relative_to(ROOT / "docs").as_posix()
    return _uri_outside(target)


def _index_of(folder: Path) -> str:
    if folder.is_relative_to(ROOT / "docs"):
        return (folder.relative_to(ROOT / "docs") / "index.md").as_posix()
    return _uri_outside(folder)


def _uri_outside(target: Path) -> str:
    name = target.relative_to(ROOT).as_posix()
    if target.is_dir():
        return f"{OUTSIDE}/{name}/index.md"
    return f"{OUTSIDE}/{name}" if target.suffix == ".md" else f"{OUTSIDE}/{name}.txt"


def _outside(uri: str, text: str) -> Iterator[Path]:
    """What a page links to outside ``docs``; a link to nothing stops the build."""
    prose = CODE.sub("", text)
    for _, link, _ in LINK.findall(prose):
        target, _ = _resolved(_home(uri), link)
        if target is None or target.is_relative_to(ROOT / "docs"):
            continue
        if not target.exists() or not target.is_relative_to(ROOT):
            raise PluginError(f"{uri} links to {link}, which is not there.")
        yield target


def _add_outside(files: Files, config: MkDocsConfig, target: Path) -> File:
    uri = _uri_outside(target)
    if target.is_dir():
        names = "\n".join(f"- `{path.name}`" for path in sorted(target.iterdir()))
        return _add(files, config, uri, f"# {target.relative_to(ROOT)}\n\n{names}\n")
    return _add(files, config, uri, target.read_text(encoding="utf-8"))


def _add(files: Files, config: MkDocsConfig, uri: str, content: str) -> File:
    file = File.generated(config, uri, content=content)
    files.append(file)
    return file


# -------------------------------------------------------------------------- generated pages


def _title(text: str) -> str:
    return text.partition("\n")[0].removeprefix("# ").strip()


def _index(title: str, pages: dict[str, str]) -> str:
    rows = [f"- [{text}]({name})" for name, text in pages.items()]
    return "\n".join([f"# {title}", "", *rows, ""])


def _titles_of_notebooks(paths: list[Path]) -> dict[str, str]:
    return {f"{path.stem}.md": _title(_notebook_page(path)) for path in paths}


def _notebook_page(path: Path) -> str:
    """A notebook as Markdown: its text, its code, what the code printed and drew."""
    parts: list[str] = []
    for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]:
        source = "".join(cell["source"])
        parts += [source if cell["cell_type"] == "markdown" else _fenced("python", source), ""]
        for output in cell.get("outputs", ()):
            parts += [*_output(output), ""]
    return "\n".join(parts)


def _output(output: dict[str, Any]) -> Iterator[str]:
    data = output.get("data", {})
    if "image/png" in data:
        png = "".join(data["image/png"]).replace("\n", "")
        yield f'<img alt="what the code above drew" src="data:image/png;base64,{png}">'
    else:
        lines = output.get("text") or data.get("text/plain") or ()
        yield _fenced("text", "".join(lines).rstrip())


def _fenced(language: str, text: str) -> str:
    return f"```{language}\n{text}\n```"


def _table_of_rooms() -> str:
    rows = ["| room | content | names |", "|---|---|---|"]
    for room in ROOMS:
        names = ", ".join(
            f"[`{name}`]({room}.md#{identifier})" for name, identifier in public_names(room).items()
        )
        docstring = ast.get_docstring(ast.parse(_source(room, "__init__.py"))) or ""
        rows.append(f"| [{room}]({room}.md) | {docstring.partition(chr(10))[0]} | {names} |")
    return "\n".join(rows)


def _room_page(room: str) -> str:
    """Every public name of a room; mkdocstrings puts signature and docstring in its place."""
    lines = [f"# {room}", "", f"::: {room}", "    options:"]
    lines += ["      members: false", "      show_root_heading: false"]
    lines += ["      show_root_toc_entry: false", ""]
    for name, identifier in public_names(room).items():
        lines += [f"::: {identifier}", "    options:"]
        lines += [f"      heading: {name}", f"      toc_label: {name}", ""]
    return "\n".join(lines)


def public_names(room: str) -> dict[str, str]:
    """The names of a room by what mkdocstrings calls them.

    They are ``__all__`` of its contract; without one, each name that the contract gives.
    """
    tree = ast.parse(_source(room, "__init__.pyi"))
    stated = [
        ast.literal_eval(node.value)
        for node in tree.body
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__"
    ]
    given = [n.name for n in tree.body if isinstance(n, ast.FunctionDef | ast.ClassDef)]
    homes = {}
    for node in tree.body:
        if isinstance(node, ast.ImportFrom) and node.level == 1:
            for alias in node.names:
                homes[alias.asname or alias.name] = f"{room}.{node.module}.{alias.name}"
    names = stated[0] if stated else [*given, *homes]
    names = sorted((name for name in names if not name.startswith("_")), key=str.lower)
    modules = {path.stem for path in PACKAGE.joinpath(*room.split(".")[1:]).glob("*")}
    # a module of the same name hides the function that the room gives
    return {
        name: homes[name] if name in modules and name in homes else f"{room}.{name}"
        for name in names
    }


def _source(name: str, contract: str) -> str:
    """The text of a room's contract, or of the module where it has none."""
    folder = PACKAGE.joinpath(*name.split(".")[1:])
    for path in (folder / contract, folder / "__init__.py", folder.with_suffix(".py")):
        if path.is_file():
            return path.read_text(encoding="utf-8")
    raise PluginError(f"The room {name} of the API pages is not there.")
