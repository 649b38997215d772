"""What pyproject.toml cannot say: the C core, and recipes and schemas that travel in the wheel.

``recipes/`` and ``data_schemas/`` stand at the top of the repository, where people look for them.
Building copies them into the package, as ``scissorcal/recipes`` and ``scissorcal/data_schemas``; an
editable install builds no copy, and ``scissorcal.recipe.library`` then reads the originals.
"""

from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py

ROOT = Path(__file__).parent
DATA_FOLDERS = ("recipes", "data_schemas")


class BuildWithData(build_py):
    """Build the Python files, then lay the data folders inside the package."""

    def run(self):
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
                if source.suffix in {".toml", ".json"}:
                    yield source, package / source.relative_to(ROOT)


setup(
    cmdclass={"build_py": BuildWithData},
    cffi_modules=["src/scissorcal/kernel/build_kernel.py:builder"],
    options={"bdist_wheel": {"py_limited_api": "cp311"}},  # the C core uses the stable ABI
)
