"""The package as a library: torque, band, ranges, the loop's step."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import scissorcal
from scissorcal.package import PackageSummary, build_package, open_package
from tests.package.fits import cut_fit, recipe

OUTSIDE = "ignore::scissorcal.package.OutsideCoverageWarning"
"""For tests that ask at rates below those of the scene, where friction is small."""


def test_scissorcal_opens_it_by_name(paper: PackageSummary) -> None:
    package = scissorcal.open_package(str(paper.path))
    assert package.torque(opening=0.5, opening_rate=-0.2, contact=0.03) > 0


def test_opening_a_package_leaves_the_heavy_libraries_alone(paper: PackageSummary) -> None:
    code = (
        "import sys, scissorcal; scissorcal.open_package(sys.argv[1]);"
        "print([m for m in ('scipy', 'arviz', 'xarray', 'matplotlib', 'nlopt', 'pyarrow', 'mcap')"
        " if m in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(paper.path)], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"


def test_arguments_broadcast(paper: PackageSummary) -> None:
    package = open_package(paper.path)
    opening = np.linspace(0.3, 0.8, 5)[:, None]
    contact = np.linspace(0.02, 0.05, 4)
    torque = package.torque(opening, -0.2, contact)
    low, high = package.band(opening, -0.2, contact)
    assert torque.shape == low.shape == high.shape == (5, 4)
    assert torque.dtype == np.float64
    assert package.torque(0.5, -0.2, 0.03).shape == ()
    assert torque[2, 1] == package.torque(opening[2, 0], -0.2, contact[1])
    assert low[2, 1] == pytest.approx(float(package.band(opening[2, 0], -0.2, contact[1])[0]))


def test_no_points_give_no_torque(paper: PackageSummary) -> None:
    package = open_package(paper.path)
    nothing = np.zeros(0)
    assert package.torque(nothing, nothing, nothing).shape == (0,)
    assert package.band(nothing, nothing, nothing)[0].shape == (0,)


@pytest.mark.filterwarnings(OUTSIDE)
@settings(max_examples=60)
@given(
    opening=st.floats(np.radians(12.0), np.radians(50.0)),
    rate=st.floats(-1.0, 1.0),
    contact=st.floats(0.015, 0.06),
    inner=st.floats(0.01, 0.98),
    wider=st.floats(1e-4, 0.015),
)
def test_the_band_widens_with_its_probability(
    paper: PackageSummary, opening: float, rate: float, contact: float, inner: float, wider: float
) -> None:
    package = open_package(paper.path)
    low, high = package.band(opening, rate, contact, inner)
    lower, higher = package.band(opening, rate, contact, inner + wider)
    assert lower <= low <= high <= higher
    assert np.isfinite([lower, higher]).all()


@pytest.mark.filterwarnings(OUTSIDE)
def test_the_band_holds_its_share_of_draws(paper: PackageSummary) -> None:
    """Torque is proportional to fracture energy where the crack has settled: its band too."""
    package = open_package(paper.path)
    opening = np.radians(25.0)
    record = package.manifest.provenance.cut
    names = [parameter.name for parameter in record.parameters]
    energy = package.arrays["draws/cut.npy"][:, names.index("fracture_energy")]
    spread = np.std(np.log(energy))
    low, high = package.band(opening, 0.0, 0.015)
    width = np.log(high / low) / (2 * 1.645)
    assert width == pytest.approx(spread, rel=0.25)


def test_torque_and_band_end_at_the_limit(pad: PackageSummary) -> None:
    package = open_package(pad.path)
    limit = package.manifest.limits.torque_Nm
    opening = np.radians(12.0)
    assert package.exact.torque(opening, -0.2, 0.015) > 1.2 * limit
    assert package.torque(opening, -0.2, 0.015) == limit
    assert package.band(opening, -0.2, 0.015) == (limit, limit)


@pytest.mark.parametrize("probability", [0.0, 1.0, -0.1, 1.5, float("nan")])
def test_a_probability_must_be_one(probability: float, paper: PackageSummary) -> None:
    with pytest.raises(ValueError, match="between 0 and 1"):
        open_package(paper.path).band(0.5, -0.2, 0.03, probability)


def test_torque_refuses_what_is_not_finite(paper: PackageSummary) -> None:
    with pytest.raises(ValueError, match="finite"):
        open_package(paper.path).torque([0.5, np.nan], -0.2, 0.03)


def test_covers_names_where_the_package_may_be_used(paper: PackageSummary) -> None:
    package = open_package(paper.path)
    inside = package.covers(np.radians([20.0, 60.0, 20.0, 20.0]), [-0.5, 0.5, 3.0, 0.5], 0.03)
    assert inside.tolist() == [True, False, False, True]
    assert not package.covers(0.4, 0.5, 0.2)


def test_each_kernel_has_its_own_crack(paper: PackageSummary) -> None:
    package = open_package(paper.path)
    first, second = package.kernel(), package.kernel()
    first.reset(0.0)
    second.reset(0.0)
    first.step(np.radians(20.0), -0.2, -0.02)
    assert first.crack > 0.0
    assert second.crack == 0.0


def test_closing_again_over_what_is_cut_gives_no_cutting_torque(paper: PackageSummary) -> None:
    package = open_package(paper.path)
    kernel = package.kernel()
    kernel.reset(0.0)
    closing = np.radians(np.linspace(45.0, 20.0, 2000))
    first = kernel.step_many(closing, -0.2, -0.02)
    again = kernel.step_many(closing[:-20], -0.2, -0.02)
    cut, recut = (steps["torque"] - steps["friction_torque"] for steps in (first, again))
    assert np.max(cut) > 0.01
    assert np.mean(recut[:1500]) < 0.01 * np.mean(cut)


@pytest.mark.filterwarnings(OUTSIDE)
def test_damping_by_rate_is_rendered_with_its_band(tmp_path: Path) -> None:
    chosen = recipe("press-only", render_friction=False)
    fit = cut_fit(chosen, energy=None, force=5.0, damping=20.0)
    path = tmp_path / "p.zip"
    build_package(chosen, None, fit, path, np.random.default_rng(1))
    package = open_package(path)
    assert package.tables.rate_damping == 20.0
    opening, contact = np.radians(30.0), 0.03
    slow, fast, leaving = package.torque(opening, np.array([-1e-6, -0.8, 0.8]), contact)
    low, high = package.band(opening, np.array([-1e-6, -0.8]), contact)
    assert leaving < slow < fast
    assert low[1] < fast < high[1]
    assert (high[1] - low[1]) / fast > (high[0] - low[0]) / slow
    assert package.manifest.provenance.cut.structure.rate_damping
