"""The Python in docs/files.md runs as it stands there, over a workspace's fits."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from scissorcal.calibration import fit_friction, save
from scissorcal.recipe.schema import FitFriction
from tests.calibration.test_predictive import repeated

ROOT = Path(__file__).parents[2]
BLOCKS = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "files.md").read_text("utf-8"), re.S)
EXPECTED = (
    r"inertia +\d",
    r"coulomb \+ viscous, \w+ [\d.e-]+ kg m\^2 \d+",
    r"<FitResult friction;",
)


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder: Path = tmp_path_factory.mktemp("workspace")
    rng = np.random.default_rng(1)
    wanted = FitFriction(rung="coulomb+viscous", critic=False)
    found = fit_friction((repeated(rng),), wanted, effort="standard", rng=rng)
    save(found, folder / "fits" / "friction.nc")
    return folder


@pytest.mark.parametrize(("block", "expected"), list(zip(BLOCKS, EXPECTED, strict=True)))
def test_an_example_runs(workspace: Path, block: str, expected: str) -> None:
    command = [sys.executable, "-W", "ignore", "-c", block]
    done = subprocess.run(
        command,
        cwd=workspace,
        capture_output=True,
        text=True,
        check=False,
        env={"MPLBACKEND": "agg", "PATH": "", "PYTHONPATH": str(ROOT / "src")},
    )
    assert done.returncode == 0, done.stderr
    assert re.search(expected, done.stdout)
