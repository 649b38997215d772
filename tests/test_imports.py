"""Data flows one way: which room may import which, and what `scissorcal --help` may load."""

import ast
import importlib
import json
import subprocess
import sys
from collections.abc import Iterator
from graphlib import TopologicalSorter
from pathlib import Path

import pytest
from benchmarks.house import size_of

import scissorcal

PACKAGE = Path(scissorcal.__file__).parent
LEAVES = {"aliases", "errors", "verdicts", "identity", "files", "foreign", "<root>"}
LOWEST = {"kernel", "model", "inference", "recipe", "recording"}
MIDDLE = {"device", "vision", "calibration", "package", "render", "report", "tracking", "control"}
MAY_IMPORT: dict[str, set[str]] = {
    "aliases": set(),
    "errors": set(),
    "verdicts": set(),
    "identity": set(),
    "files": set(),
    "foreign": set(),
    "kernel": set(),
    "model": set(),
    "inference": set(),
    "recipe": {"model"},
    "recording": {"recipe"},
    "device": {"kernel", "recipe", "recording"},
    "vision": {"recipe", "model"},
    "calibration": {"kernel", "model", "inference", "recipe", "recording", "vision"},
    "package": {"kernel", "model", "calibration", "recipe", "recording"},
    "render": {"kernel", "device", "package", "recipe", "recording", "tracking"},
    "report": {"model", "vision", "calibration", "package", "recipe", "recording", "bench"},
    "identify": {"model", "calibration", "recipe", "recording", "report"},
    "tracking": {"model", "recipe"},
    "control": {"kernel", "model", "recipe", "recording", "device", "tracking"},
    "prototype": {"kernel", "model", "recipe", "recording", "package", "calibration", "report"},
    "bench": LOWEST | {"vision", "device", "calibration", "package", "render"},
    "workday": LOWEST | MIDDLE | {"bench", "prototype"},
    "cli": LOWEST | MIDDLE | {"workday", "bench", "prototype", "identify"},
    "stated": {"model", "calibration", "package", "recipe"},
    "library": {"calibration", "model", "package", "recipe", "recording", "workday"},
    "examples": {"package", "recording"},
    "<root>": {"examples", "library", "model", "package", "recording", "stated"},
    "__main__": {"cli"},
}
ROOMS = set(MAY_IMPORT) - {"<root>"}
MODULES = sorted(PACKAGE.rglob("*.py"))


def room_of(module: str) -> str:
    """Name the room of a dotted module of this project; the package itself is "<root>"."""
    parts = module.split(".")
    return parts[1] if len(parts) > 1 else "<root>"


def module_of(path: Path) -> str:
    parts = ("scissorcal", *path.relative_to(PACKAGE).with_suffix("").parts)
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imports_of(
    source: str, package: str, *, by_name: bool = True
) -> Iterator[tuple[int, str, str | None]]:
    """Yield line, module and name of every import at any depth of the code, functions included.

    ``package`` is what relative imports start from. A module named in a string of the form
    "module:name" (as lazily loaded commands are) counts as imported, unless ``by_name`` is false.
    """
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield node.lineno, alias.name, None
        elif isinstance(node, ast.ImportFrom):
            above = package.split(".")[: len(package.split(".")) - node.level + 1]
            parts = (above if node.level else []) + ([node.module] if node.module else [])
            for alias in node.names:
                if parts == ["scissorcal"] and alias.name in ROOMS:
                    yield node.lineno, f"scissorcal.{alias.name}", None
                else:
                    yield node.lineno, ".".join(parts), alias.name
        elif by_name and isinstance(node, ast.Constant) and isinstance(node.value, str):
            module, colon, name = node.value.partition(":")
            if colon and module.startswith("scissorcal.") and name.isidentifier():
                yield node.lineno, module, name


def own_imports(room: str) -> Iterator[tuple[str, str, str | None]]:
    """Yield place, module and name of every import of this project in the files of a room."""
    for path in MODULES:
        module = module_of(path)
        if room_of(module) != room:
            continue
        package = module if path.name == "__init__.py" else module.rpartition(".")[0]
        for line, target, name in imports_of(path.read_text(encoding="utf-8"), package):
            if target.split(".")[0] == "scissorcal":
                yield f"{path}:{line}", target, name


def test_every_room_has_a_rule() -> None:
    rooms = {room_of(module_of(path)) for path in MODULES}
    assert rooms == set(MAY_IMPORT)
    assert [room for room, allowed in MAY_IMPORT.items() if "cli" in allowed] == ["__main__"]


NAMED_AS_THEIR_MODULE = {
    "device": {"capture", "completeness", "probe"},
    "package": {"scene_torque", "stated_bound", "variations"},
    "recipe": {"requirements"},
    "render": {"rig_facts"},
}
"""Functions that a room cannot hand out, since a module of the room has the same name."""

PATCHED = {"scissorcal.kernel._kernel", "scissorcal.kernel._firmware", "scissorcal.workday.runs"}
PATCHED |= {"scissorcal.workday.demo"}
PATCHED |= {"scissorcal.workday.tracking", "scissorcal.bench.trade", "scissorcal.bench.extremes"}
PATCHED |= {"scissorcal.device.sim", "scissorcal.package.simplest"}
"""Packages whose modules, not names, tests of other rooms take: to replace a part of them."""


def test_tests_of_other_rooms_import_only_a_rooms_contract() -> None:
    """So that a room's files can move: its contract is its ``__init__.pyi``."""
    tests = Path(__file__).parent
    wrong = []
    for path in sorted(tests.rglob("*.py")):
        own = path.relative_to(tests).parts[0]
        for line, module, name in imports_of(path.read_text(encoding="utf-8"), "", by_name=False):
            room = room_of(module)
            is_deep = module.startswith("scissorcal.") and module.count(".") >= 2
            if not is_deep or room in (own, "cli") or module in PATCHED:
                continue
            if name not in NAMED_AS_THEIR_MODULE.get(room, set()):
                wrong.append(f"{path}:{line} imports {name} of {module}")
    assert not wrong, "\n".join(wrong)


def test_a_contract_names_what_its_room_has() -> None:
    for stub in sorted(PACKAGE.glob("*/__init__.pyi")):
        room = importlib.import_module(f"scissorcal.{stub.parent.name}")
        for name in room.__all__:
            assert getattr(room, name) is not None, (stub, name)


@pytest.mark.parametrize("room", ["calibration", "inference", "package"])
def test_no_function_of_a_fits_room_takes_more_than_six_parameters(room: str) -> None:
    for path in (PACKAGE / room).rglob("*.py"):
        assert size_of(path.read_text(encoding="utf-8")).most_parameters <= 6, path


@pytest.mark.parametrize("room", MAY_IMPORT)
def test_imports_go_one_way_and_no_private_name_crosses_a_wall(room: str) -> None:
    allowed = MAY_IMPORT[room] | LEAVES | {room}
    wrong = []
    for place, module, name in own_imports(room):
        if room_of(module) not in allowed:
            wrong.append(f"{place} imports {module}")
        parts = (*module.split("."), name or "")
        is_private = any(part.startswith("_") and not part.startswith("__") for part in parts)
        if is_private and room_of(module) != room:
            wrong.append(f"{place} imports {name or ''} of {module}")
    assert not wrong, "\n".join(wrong)


def test_the_checker_sees_imports_inside_functions_relative_ones_and_strings() -> None:
    source = (
        "def f():\n"
        "    from scissorcal.cli import main\n"
        "    import scissorcal.device.link\n"
        "    from scissorcal import render\n"
        "    from ..report import build_report\n"
        "    where = 'scissorcal.workday.plan:plan'\n"
    )
    assert sorted(imports_of(source, "scissorcal.model")) == [
        (2, "scissorcal.cli", "main"),
        (3, "scissorcal.device.link", None),
        (4, "scissorcal.render", None),
        (5, "scissorcal.report", "build_report"),
        (6, "scissorcal.workday.plan", "plan"),
    ]


def test_no_module_imports_in_a_circle() -> None:
    """Imports inside functions and for types count; those of a package's contract do not."""
    names = {module_of(path) for path in MODULES}
    graph: dict[str, set[str]] = {}
    for path in MODULES:
        module, source = module_of(path), path.read_text(encoding="utf-8")
        if path.name == "__init__.py":
            source = source.partition("if TYPE_CHECKING:")[0]
        package = module if path.name == "__init__.py" else module.rpartition(".")[0]
        targets = set()
        for _, target, name in imports_of(source, package, by_name=False):
            inner = f"{target}.{name}"
            targets.add(inner if inner in names else target)
        graph[module] = (targets & names) - {"scissorcal", module}
    TopologicalSorter(graph).prepare()


HEAVY = {"numpy", "scipy", "pydantic", "rich", "mcap", "matplotlib", "cffi", "serial", "cv2"}
HEAVY |= {"pyarrow", "h5py", "emcee", "nlopt", "yaml", "PIL"}

LOADS = {
    "help": (
        "from scissorcal.cli.root import run\n"
        "try:\n    run(['--help'])\n"
        "except SystemExit as end:\n    assert end.code == 0, end.code\n",
        HEAVY | {"asyncio", "multiprocessing", "scissorcal.recipe", "scissorcal.workday"},
        156,
    ),
    "plan": (
        "import os\n"
        "from pathlib import Path\n"
        "from scissorcal.workday.workspace import create_workspace\n"
        "create_workspace(Path('day'), 'paper-80gsm')\n"
        "os.chdir('day')\n"
        "from scissorcal.cli.root import run\n"
        "try:\n    run(['plan', '--json'])\n"
        "except SystemExit as end:\n    assert end.code == 0, end.code\n",
        {"numpy", "h5py", "mcap", "scissorcal.device", "scissorcal.calibration"},
        329,
    ),
    "package": (
        "import scissorcal.package.build, scissorcal.workday.runs.package\n",
        {"scipy", "cv2", "h5py", "mcap", "scissorcal.inference", "scissorcal.vision.blade"},
        442,
    ),
    "report": (
        "import scissorcal.report, scissorcal.workday.runs.report\n"
        "from scissorcal.vision.geometry.pose import Pose, difference\n"
        "here = Pose((1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0))\n"
        "assert not difference(here, here).any() and not here.rotation_vector.any()\n",
        {"scipy", "cv2", "h5py", "mcap", "scissorcal.calibration.verify.check"}
        | {"scissorcal.inference"},
        520,
    ),
}
"""A program, modules that it does without, and how many it may load in all."""


@pytest.mark.parametrize("what", LOADS)
def test_a_command_loads_what_it_uses(what: str, tmp_path: Path) -> None:
    program, unused, most = LOADS[what]
    names = tmp_path / "names.json"
    program += "import json, sys\nopen(sys.argv[1], 'w').write(json.dumps(list(sys.modules)))\n"
    command = [sys.executable, "-c", program, str(names)]
    subprocess.run(command, cwd=tmp_path, capture_output=True, check=True)
    loaded = json.loads(names.read_text(encoding="utf-8"))
    assert sorted(unused & set(loaded)) == []
    print(len(loaded))
    assert len(loaded) <= most


SERVED = {f"scissorcal.prototype.{name}" for name in ("server", "watcher")}
"""Modules that are nothing without aiohttp, and that only what needs them imports."""


def test_no_module_imports_at_its_top_what_only_an_extra_installs() -> None:
    extras = {"pyarrow", "arviz", "pandas", "xarray", "distributed", "dask", "jax", "numpyro"}
    extras |= {"aiohttp", "cryptography", "matplotlib", "mpmath"}
    for path in MODULES:
        if module_of(path) in SERVED:
            continue
        tree = ast.parse(path.read_text(encoding="utf-8"))
        at_top = [node for node in tree.body if isinstance(node, ast.Import | ast.ImportFrom)]
        names = {alias.name for node in at_top for alias in node.names}
        names |= {node.module or "" for node in at_top if isinstance(node, ast.ImportFrom)}
        assert not extras & {name.partition(".")[0] for name in names}, path
