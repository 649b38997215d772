"""Packages for the virtual rig, built once."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from scissorcal.package import ModelPackage, build_package, open_package
from scissorcal.recipe import Recipe
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


def on_estimated_plate(moving: str, **scene: Any) -> Recipe:
    """Paper without friction whose plate's pose is estimated."""
    chosen = recipe(plate_pose="estimated", render_friction=False, **scene)
    rig = chosen.rig.model_copy(update={"moving": moving})
    return chosen.model_copy(update={"rig": rig})


@pytest.fixture(scope="session")
def upper_paper(tmp_path_factory: pytest.TempPathFactory) -> ModelPackage:
    """Paper on a plate that is tracked, cut smoothly by one moving blade."""
    return package_for(tmp_path_factory.mktemp("upper"), on_estimated_plate("upper"), energy=0.52)


@pytest.fixture(scope="session")
def both_paper(tmp_path_factory: pytest.TempPathFactory) -> ModelPackage:
    """Paper on a plate that is tracked, cut smoothly by two moving blades."""
    return package_for(tmp_path_factory.mktemp("both"), on_estimated_plate("both"), energy=0.52)
