"""Files for browsers: built where a checkout has the compilers, else one command is named."""

import importlib.util
from pathlib import Path

import pytest

from scissorcal.errors import MissingError
from scissorcal.kernel import browser_file as module
from scissorcal.kernel.browser_file import BUILDER, COMPILERS, browser_file

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
    with pytest.raises(MissingError, match="run 'make page' in") as refused:
        browser_file(checkout / "page.html")
    assert str(checkout) in str(refused.value)
    assert not (checkout / "page.html").exists()


@pytest.mark.parametrize("builder", ["raise SystemExit('no registry')", "print('nothing to do')"])
def test_a_build_that_gives_nothing_says_why(checkout: Path, builder: str) -> None:
    (checkout / BUILDER).write_text(builder, encoding="utf-8")
    with pytest.raises(MissingError, match=r"'make page' in .* It said: (no registry|nothing)"):
        browser_file(checkout / "page.html")


def test_an_installation_without_it_says_how_to_install_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "CHECKOUT", tmp_path)
    with pytest.raises(MissingError, match="pip install --force-reinstall --no-deps"):
        browser_file(tmp_path / "page.html")


def test_the_builder_of_this_checkout_builds_what_is_read() -> None:
    """The list of the build and the paths of the readers are two; here they meet."""
    builder = module.CHECKOUT / BUILDER
    if not builder.is_file():
        pytest.skip("runs from a checkout only")
    spec = importlib.util.spec_from_file_location("browser_files_of_the_build", builder)
    assert spec is not None
    assert spec.loader is not None
    build = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(build)
    from scissorcal.kernel.web_module import web_module
    from scissorcal.prototype.document import TEMPLATE

    targets = {file.target for file in build.FILES}
    assert TEMPLATE in targets
    (wasm,) = targets - {TEMPLATE}
    assert wasm.read_bytes() == web_module()
    assert {file.package.replace("-", "_") for file in build.FILES} == set(COMPILERS)
