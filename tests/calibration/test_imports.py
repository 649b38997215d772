"""What a fit leaves out: packages that take seconds to import, and that it has no use for."""

import json
import subprocess
import sys
from pathlib import Path

HEAVY = (
    *("arviz", "matplotlib", "pandas", "pyarrow", "dask", "xarray", "pysindy", "sklearn", "cv2"),
    *("scipy.signal", "scipy.stats"),  # half a second each, a fifth of a fit
)

SCRIPT = """
import json, sys
import numpy as np
from pathlib import Path
from scissorcal.calibration import fit_friction, load_fit, save
from scissorcal.recipe.schema import FitFriction
from tests.calibration.truth import QUICK, Truth, friction_recording
recording = friction_recording(Truth(), np.random.default_rng(1), QUICK)
settings = FitFriction(law="coulomb+viscous", symmetry="asymmetric", critic=True)
path = Path(sys.argv[1])
for effort in ("draft", "standard"):
    fit = fit_friction((recording,), settings, effort=effort, rng=np.random.default_rng(2))
    save(fit, path)
    load_fit(path)
print(json.dumps(sorted(sys.modules)))
"""


def test_a_fit_imports_nothing_that_it_does_not_use(tmp_path: Path) -> None:
    """Draft and standard with a critic whom nothing strikes; 2,238 modules were loaded once."""
    command = [sys.executable, "-c", SCRIPT, str(tmp_path / "fit.nc")]
    root = Path(__file__).parents[2]
    done = subprocess.run(command, cwd=root, capture_output=True, text=True, check=True)
    loaded = json.loads(done.stdout)
    assert [name for name in HEAVY if name in loaded] == []
    assert len(loaded) < 1500
