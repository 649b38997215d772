"""What pyproject.toml cannot say: the C core, what a browser needs, and data in the wheel.

``recipes/`` and ``data_schemas/`` stand at the top of the repository, where people look for them.
Building copies them into the package, as ``scissorcal/recipes`` and ``scissorcal/data_schemas``; an
editable install builds no copy, and ``scissorcal.recipe.load`` then reads the originals.

What a browser needs is built before (`build_backend/browser_files.py`), the C core on all cores.
"""

import os
import sys
from concurrent.futures import ThreadPoolExecutor
from itertools import chain
from pathlib import Path

from setuptools import setup
from setuptools.command.build_ext import build_ext
from setuptools.command.build_py import build_py
from setuptools.command.sdist import sdist

ROOT = Path(__file__).parent
sys.path.insert(0, str(ROOT / "build_backend"))  # where a command runs setup.py by itself

from browser_files import build_for_browsers  # noqa: E402

DATA_FOLDERS = ("recipes", "data_schemas")


class BuildOnAllCores(build_ext):
    """Compile the files of the C core beside one another."""

    def build_extension(self, ext):
        compile_all = self.compiler.compile

        def compile_each(sources, **options):
            with ThreadPoolExecutor(os.cpu_count()) as cores:
                made = cores.map(lambda source: compile_all([source], **options), sources)
                return list(chain.from_iterable(made))

        self.compiler.compile = compile_each
        super().build_extension(ext)


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
    cmdclass={"build_py": BuildWithData, "build_ext": BuildOnAllCores, "sdist": BuiltArchive},
    cffi_modules=[
        "src/scissorcal/kernel/build_kernel.py:builder",
        "src/scissorcal/kernel/build_firmware.py:builder",
    ],
    options={"bdist_wheel": {"py_limited_api": "cp311"}},  # the C core uses the stable ABI
)
