"""setuptools as the build backend, asked for Zig and Node only where they have something to build.

pyproject.toml cannot state a requirement that depends on the tree: whether the WebAssembly and the
page are there and newer than their sources, or are to be left out (`browser_files`).
"""

from collections.abc import Callable
from typing import Any

from browser_files import to_build
from setuptools import build_meta
from setuptools.build_meta import (
    build_editable,
    build_sdist,
    build_wheel,
    prepare_metadata_for_build_editable,
    prepare_metadata_for_build_wheel,
)

__all__ = [
    "build_editable",
    "build_sdist",
    "build_wheel",
    "get_requires_for_build_editable",
    "get_requires_for_build_sdist",
    "get_requires_for_build_wheel",
    "prepare_metadata_for_build_editable",
    "prepare_metadata_for_build_wheel",
]

Settings = dict[str, Any] | None


def get_requires_for_build_wheel(config_settings: Settings = None) -> list[str]:
    """What a wheel takes beside the requirements of pyproject.toml."""
    return _with_compilers(build_meta.get_requires_for_build_wheel, config_settings)


def get_requires_for_build_editable(config_settings: Settings = None) -> list[str]:
    """What an editable install takes: the same as a wheel."""
    return _with_compilers(build_meta.get_requires_for_build_editable, config_settings)


def get_requires_for_build_sdist(config_settings: Settings = None) -> list[str]:
    """What a source archive takes, which carries both files."""
    return _with_compilers(build_meta.get_requires_for_build_sdist, config_settings)


def _with_compilers(asked: Callable[[Settings], list[str]], settings: Settings) -> list[str]:
    return [*asked(settings), *(file.requirement for file in to_build())]
