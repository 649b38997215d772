"""A wheel carries recipes and schemas, and runs from any folder."""

import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
TRAVELS = ("recipes/*.toml", "recipes/specimens/*.toml", "data_schemas/*.json")


@pytest.fixture(scope="module")
def unpacked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build a wheel from a copy of the tree and unpack it."""
    if not (ROOT / "pyproject.toml").is_file():
        pytest.skip("runs from a checkout only")
    tree = tmp_path_factory.mktemp("tree") / "scissorcal"
    left_behind = shutil.ignore_patterns(
        ".*", "build", "dist", "*.egg-info", "__pycache__", "*.so", "built", "*.wasm"
    )
    shutil.copytree(ROOT, tree, ignore=left_behind)
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "wheel", "--quiet"]
    options = ["--no-deps", "--no-build-isolation", "--no-index", "--wheel-dir", "dist", "."]
    done = subprocess.run([*pip, *options], cwd=tree, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-2000:]
    (wheel,) = (tree / "dist").glob("scissorcal-*.whl")
    target = tmp_path_factory.mktemp("site")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(target)
    return target


def run(unpacked: Path, folder: Path, code: str) -> str:
    environment = {**os.environ, "PYTHONPATH": str(unpacked)}
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=folder, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_every_data_file_travels(unpacked: Path) -> None:
    for pattern in TRAVELS:
        files = sorted(ROOT.glob(pattern))
        assert files
        for file in files:
            copy = unpacked / "scissorcal" / file.relative_to(ROOT)
            assert copy.read_bytes() == file.read_bytes()


def test_what_a_browser_needs_is_built_and_travels(unpacked: Path) -> None:
    wasm = (unpacked / "scissorcal/kernel/web/sc_web.wasm").read_bytes()
    page = (unpacked / "scissorcal/prototype/built/page.html").read_text(encoding="utf-8")
    assert wasm.startswith(b"\0asm")
    assert "{{scene}}" in page
    assert "{{script}}" not in page


def test_it_runs_from_another_folder(unpacked: Path, tmp_path: Path) -> None:
    code = (
        "from scissorcal.recipe.library import recipe_names, recipes_dir, schemas_dir\n"
        "import scissorcal.kernel\n"
        "print(recipes_dir(), schemas_dir(), *recipe_names(), sep='\\n')\n"
    )
    recipes, schemas, *names = run(unpacked, tmp_path, code).split()
    assert recipes == str(unpacked / "scissorcal" / "recipes")
    assert schemas == str(unpacked / "scissorcal" / "data_schemas")
    assert names == ["cotton-cloth", "paper-80gsm", "paper-photographed", "press-only"]


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
