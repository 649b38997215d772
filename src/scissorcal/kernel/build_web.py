"""Compiles the model's step to WebAssembly; setup.py runs it: build_web.py TARGET.wasm.

The compiler is Zig's clang, which installs as a package (ziglang) and brings the C library. The
module is a reactor without imports: any host runs it.
"""

import importlib.util
import subprocess
import sys
import tempfile
from pathlib import Path

KERNEL = Path(__file__).parent
CORE = ("table", "turn", "edge", "fracture", "release", "model", "plate", "pieces")
FLAGS = (
    *("-target", "wasm32-wasi", "-mexec-model=reactor", "-std=c99", "-Wall", "-Wextra", "-Werror"),
    # no fused multiply-add and no reordering: the same bits as the core that a rig runs
    *("-O3", "-fno-math-errno", "-ffp-contract=off", "-s"),
)


def build_web(target: Path) -> None:
    """Write the module to ``target``, whole or not at all; RuntimeError if it fails."""
    if importlib.util.find_spec("ziglang") is None:
        raise RuntimeError("The package ziglang, which compiles WebAssembly, is not installed.")
    sources = [KERNEL / "web" / "sc_web.c", *(KERNEL / "c" / f"sc_{name}.c" for name in CORE)]
    target.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=target.parent) as folder:
        made = Path(folder) / "made.wasm"
        command = [sys.executable, "-m", "ziglang", "cc", *FLAGS, f"-I{KERNEL / 'c'}", "-o", made]
        ran = subprocess.run(
            [*map(str, command), *map(str, sources)], capture_output=True, text=True, check=False
        )
        if ran.returncode:
            raise RuntimeError(f"The C core does not compile to WebAssembly: {ran.stderr[-2000:]}")
        made.chmod(0o644)
        made.replace(target)


if __name__ == "__main__":
    try:
        build_web(Path(sys.argv[1]))
    except RuntimeError as error:
        sys.exit(str(error))
