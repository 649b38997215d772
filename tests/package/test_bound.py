"""The promise of a package: kernel and exact model agree to the stated bound, everywhere."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from scissorcal.package import (
    ModelPackage,
    PackageOptions,
    PackageSummary,
    build_package,
    open_package,
)
from scissorcal.recipe import Recipe
from tests.package.fits import cut_fit, friction_fit, recipe

OUTSIDE = "ignore::scissorcal.package.OutsideCoverageWarning"
"""For tests that ask at contacts below the scene, where the crack settles farther out."""

CASES: dict[str, tuple[str, dict[str, Any]]] = {
    "paper": ("paper-80gsm", {}),
    "rippled": ("paper-80gsm", {"kappa": 0.4}),
    "rippled exponential": (
        "paper-80gsm",
        {"kappa": 0.3, "response": "exponential", "exponent": 3.0},
    ),
    "square root": ("paper-80gsm", {"exponent": 0.5}),
    "eighth power": ("cotton-cloth", {"exponent": 8.0}),
    "tender": ("paper-80gsm", {"energy": 1e-4}),
    "tough": ("cotton-cloth", {"energy": 35.0}),
    "pressed": ("press-only", {"energy": None, "force": 5.0}),
    "pressed, steep": ("press-only", {"energy": None, "exponent": 8.0}),
    "damped": ("paper-80gsm", {"kappa": 0.7, "damping": 20.0}),
    "pressed, much damped": ("press-only", {"energy": None, "damping": 90.0}),
    "spline": (
        "paper-80gsm",
        {"response": "spline", "shape": (0.8, -0.5, 0.4), "kappa": 0.6, "damping": 5.0},
    ),
    "pressed, spline": (
        "press-only",
        {"energy": None, "response": "spline", "shape": (-0.8, 1.2, 0.3), "force": 5.0},
    ),
    "pressed, exponential": ("press-only", {"energy": None, "response": "exponential"}),
}


def build(chosen: Recipe, path: Path, **cut: Any) -> PackageSummary:
    return build_package(
        chosen, friction_fit(), cut_fit(chosen, **cut), path, np.random.default_rng(1)
    )


def random_places(package: ModelPackage, count: int, seed: int) -> tuple[Any, Any, Any]:
    """Places drawn at random, nothing to do with how the bound was measured."""
    rng = np.random.default_rng(seed)
    ranges = package.manifest.ranges
    slow = max(package.manifest.bound.from_rate_rad_per_s, ranges.opening_rate_rad_per_s[0])
    rate = rng.uniform(slow, ranges.opening_rate_rad_per_s[1], count)
    return (
        rng.uniform(*ranges.opening_rad, count),
        rate * rng.choice([-1.0, 1.0], count),
        rng.uniform(*ranges.contact_m, count),
    )


@pytest.mark.parametrize("case", CASES)
def test_the_stated_bound_holds_on_fresh_random_places(case: str, tmp_path: Path) -> None:
    name, cut = CASES[case]
    summary = build(recipe(name), tmp_path / "p.zip", **cut)
    package = open_package(summary.path)
    where = random_places(package, 40_000, seed=17)
    limit = package.manifest.limits.torque_Nm
    exact = np.clip(package.exact.torque(*where), -limit, limit)
    table = np.clip(package.torque(*where), -limit, limit)
    bound = package.manifest.bound
    assert np.max(np.abs(table - exact)) <= bound.stated_Nm
    assert bound.stated_Nm == pytest.approx(bound.share * bound.scene_torque_Nm)
    assert np.max(np.abs(exact)) == pytest.approx(bound.scene_torque_Nm, rel=0.02)
    assert bound.share <= bound.allowed_share


@pytest.mark.parametrize("closure", ["work", "eq4"])
@pytest.mark.parametrize("moving", ["both", "upper"])
def test_every_closure_and_blade_count(closure: str, moving: str, tmp_path: Path) -> None:
    chosen = recipe(closure=closure, simplify=False)
    chosen = chosen.model_copy(update={"rig": chosen.rig.model_copy(update={"moving": moving})})
    bound = build(chosen, tmp_path / "p.zip", kappa=0.8).manifest.bound
    assert bound.share < 1e-3


def test_a_curved_edge_keeps_the_bound(tmp_path: Path) -> None:
    chosen = recipe(simplify=False)
    edge = chosen.rig.edge.model_copy(update={"family": "arc", "curvature_per_m": 1.5})
    chosen = chosen.model_copy(update={"rig": chosen.rig.model_copy(update={"edge": edge})})
    summary = build(chosen, tmp_path / "p.zip")
    assert summary.manifest.bound.share < 1e-3


@pytest.mark.filterwarnings(OUTSIDE)
def test_smooth_cut_by_a_straight_edge_has_the_closed_form(tmp_path: Path) -> None:
    """An edge through the pivot, both blades moving: tau = J_c h x_c / sin(theta)."""
    chosen = recipe(render_friction=False, contact_mm=(0.5, 60.0), simplify=False)
    edge = chosen.rig.edge.model_copy(update={"offset_mm": 0.0, "taper_deg": 0.0})
    chosen = chosen.model_copy(
        update={
            "rig": chosen.rig.model_copy(update={"edge": edge}),
            "material": chosen.material.model_copy(update={"thickness_mm": 4.0}),
        }
    )
    energy = 2.0
    summary = build(chosen, tmp_path / "p.zip", energy=energy, force=40.0)
    package = open_package(summary.path)
    opening = np.radians(np.linspace(13.0, 49.0, 37))
    place = package.exact.settled(opening, 1e-4)
    torque = package.torque(opening, -0.2, 1e-4)
    assert torque == pytest.approx(energy * place / np.sin(opening), rel=2e-5)


@pytest.mark.filterwarnings(OUTSIDE)
@pytest.mark.parametrize("response", ["power", "exponential"])
@pytest.mark.parametrize("kappa", [0.3, 0.8])
def test_stepped_ripple_averages_to_the_torque_that_is_stated(
    response: str, kappa: float, tmp_path: Path
) -> None:
    """The loop's kernel, closed slowly at many phases, has the mean that ``torque`` gives."""
    chosen = recipe(render_friction=False)
    summary = build(
        chosen, tmp_path / "p.zip", kappa=kappa, response=response, exponent=2.0, energy=0.3
    )
    package = open_package(summary.path)
    kernel = package.kernel()
    kernel.reset(0.0)
    opening = np.radians(np.linspace(48.0, 14.0, 200_000))
    steps = kernel.step_many(opening, -0.1, -0.01)
    average = package.torque(opening, -0.1, 0.0)
    blocks = slice(10_000, 190_000)
    stepped = steps["torque"][blocks].reshape(9, -1).mean(axis=1)
    stated = average[blocks].reshape(9, -1).mean(axis=1)
    assert np.ptp(steps["torque"][-4000:]) > 0.05 * stated[-1]
    assert stepped == pytest.approx(stated, rel=0.02)


def test_coarse_tables_state_a_larger_bound(tmp_path: Path) -> None:
    chosen = recipe("press-only")
    fit = cut_fit(chosen, energy=None, exponent=2.5)
    shares = [
        build_package(
            chosen,
            friction_fit(),
            fit,
            tmp_path / "p.zip",
            np.random.default_rng(1),
            options=PackageOptions(tolerance=t),
        ).manifest.bound.share
        for t in (3e-3, 1e-4)
    ]
    assert shares[0] > 5 * shares[1]
