"""The Python in docs/files.md runs as it stands there, over a workspace's fits."""

import re
import warnings
from pathlib import Path

import numpy as np
import pytest

from scissorcal.calibration import fit_friction, save
from scissorcal.recipe import FitFriction
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
    wanted = FitFriction(law="coulomb+viscous", critic=False)
    found = fit_friction((repeated(rng),), wanted, effort="standard", rng=rng)
    save(found, folder / "fits" / "friction.nc")
    return folder


@pytest.mark.parametrize(("block", "expected"), list(zip(BLOCKS, EXPECTED, strict=True)))
def test_an_example_runs(
    workspace: Path,
    block: str,
    expected: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(workspace)
    monkeypatch.setenv("MPLBACKEND", "agg")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # arviz tells of its own future
        exec(compile(block, "docs/files.md", "exec"), {})
    assert re.search(expected, capsys.readouterr().out)
