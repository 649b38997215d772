"""Packages for the virtual rig, built once."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from scissorcal.package import ModelPackage, build_package, open_package
from scissorcal.recipe.schema import Recipe
from tests.package.fits import cut_fit, friction_fit, recipe


def package_for(folder: Path, chosen: Recipe, **cut: Any) -> ModelPackage:
    summary = build_package(
        chosen,
        friction_fit(coulomb=0.014, stribeck=0.004, viscous=0.002),
        cut_fit(chosen, **cut),
        folder / "package.zip",
        np.random.default_rng(1),
    )
    return open_package(summary.path)


@pytest.fixture(scope="session")
def paper(tmp_path_factory: pytest.TempPathFactory) -> ModelPackage:
    """Paper that ripples, with friction."""
    return package_for(tmp_path_factory.mktemp("paper"), recipe(), kappa=0.75, energy=0.52)


@pytest.fixture(scope="session")
def silent_paper(tmp_path_factory: pytest.TempPathFactory) -> ModelPackage:
    """Paper that ripples, without friction."""
    chosen = recipe(render_friction=False)
    return package_for(tmp_path_factory.mktemp("silent"), chosen, kappa=0.75, energy=0.52)


@pytest.fixture(scope="session")
def pushing_paper(tmp_path_factory: pytest.TempPathFactory) -> ModelPackage:
    """Paper whose force along the cut is rendered too."""
    chosen = recipe(render=("torque", "translation_force"))
    return package_for(tmp_path_factory.mktemp("pushing"), chosen, energy=0.52)


@pytest.fixture(scope="session")
def pad(tmp_path_factory: pytest.TempPathFactory) -> ModelPackage:
    """A pad that is pressed."""
    chosen = recipe("press-only")
    return package_for(tmp_path_factory.mktemp("pad"), chosen, energy=None, force=5.0)
