"""Every module of benchmarks imports, and what it takes from other modules exists.

A type checker finds more (CONTRIBUTING.md has the command).
"""

import ast
import importlib
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[2]
MODULES = [
    path.relative_to(ROOT).with_suffix("").as_posix().replace("/", ".").removesuffix(".__init__")
    for path in sorted((ROOT / "benchmarks").rglob("*.py"))
]
HOUSES = ("scissorcal", "benchmarks", "tests")


def missing_names(text: str) -> Iterator[str]:
    """What a module imports of this project, or asks of a module of it, that is not there."""
    modules: dict[str, ModuleType] = {}
    tree = ast.parse(text)
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] in HOUSES:
            home = importlib.import_module(str(node.module))
            for alias in node.names:
                try:
                    value = getattr(home, alias.name)
                except AttributeError:
                    try:
                        value = importlib.import_module(f"{node.module}.{alias.name}")
                    except ModuleNotFoundError:
                        yield f"{node.module}.{alias.name}"
                        continue
                if isinstance(value, ModuleType):
                    modules[alias.asname or alias.name] = value
    for node in ast.walk(tree):
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            modules.pop(node.id, None)  # a variable of this name hides the module somewhere
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            home = modules.get(node.value.id)
            if home is not None and not hasattr(home, node.attr):
                yield f"{home.__name__}.{node.attr}"


@pytest.mark.parametrize("module", MODULES)
def test_a_module_of_benchmarks_imports_and_finds_what_it_names(module: str) -> None:
    importlib.import_module(module)
    path = ROOT / module.replace(".", "/")
    text = (path / "__init__.py" if path.is_dir() else path.with_suffix(".py")).read_text()
    assert list(missing_names(text)) == []


def test_a_name_that_is_gone_is_found() -> None:
    text = "from scissorcal.calibration.cut import teeth\nfrom scissorcal import gone\n"
    assert list(missing_names(text + "teeth.gone(1)\n")) == [
        "scissorcal.gone",
        "scissorcal.calibration.cut.teeth.gone",
    ]
