"""Packages built once and shared: paper that ripples, and a pad that is only pressed."""

from pathlib import Path

import numpy as np
import pytest

from scissorcal.package import PackageSummary, build_package
from tests.package.fits import cut_fit, friction_fit, recipe


@pytest.fixture(scope="session")
def paper(tmp_path_factory: pytest.TempPathFactory) -> PackageSummary:
    """Rippled, with friction."""
    chosen = recipe()
    path = tmp_path_factory.mktemp("package") / "paper.zip"
    fit = cut_fit(chosen, kappa=0.75)
    return build_package(chosen, friction_fit(), fit, path, np.random.default_rng(3))


@pytest.fixture(scope="session")
def pad(tmp_path_factory: pytest.TempPathFactory) -> PackageSummary:
    """Pressed only, without friction, over a scene that reaches the torque limit."""
    wide = {"opening_deg": (12.0, 50.0), "contact_mm": (15.0, 60.0)}
    chosen = recipe("press-only", render_friction=False, **wide)
    path = tmp_path_factory.mktemp("package") / "pad.zip"
    fit = cut_fit(chosen, energy=None, force=5.0)
    return build_package(chosen, None, fit, path, np.random.default_rng(3))


@pytest.fixture
def copy_of_paper(paper: PackageSummary, tmp_path: Path) -> Path:
    """A copy that a test may damage."""
    path = tmp_path / "copy.zip"
    path.write_bytes(paper.path.read_bytes())
    return path
