"""A package from stated numbers has the torque of the model at these numbers, and says what it is.

The exact torque is written here from the equations, without the model's code.
"""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import scissorcal
from scissorcal import Blades, Friction, Material, build_package
from scissorcal.errors import InputError, ModelError
from scissorcal.package import ModelPackage
from scissorcal.recipe import Scene

THICKNESS_MM = 5.0
PRESSING = Scene(
    opening_deg=(20.0, 40.0), opening_rate_rad_per_s=(0.05, 1.0), contact_mm=(20.0, 50.0)
)


@dataclass(frozen=True)
class Cubic:
    """Force that grows with the depth and its cube."""

    def parameters(self):
        return {"slope_N_per_mm": (0.5, 0.02), "cubic": 0.3}

    def force_N(self, indentation_m, slope_N_per_mm, cubic):
        depth = 1e3 * indentation_m
        return slope_N_per_mm * (depth + cubic * depth**3)


def pressed_torque(force_N, opening: float, contact_m: float) -> float:
    """By the principle of virtual work: two straight edges sink in from either face by delta.

    The edge's point at the contact stands at height y = x tan(beta) over the centreline, where
    tan(beta) is the angle of the edge to it, moved by its offset; delta = h/2 - y.
    """
    offset, taper = -8e-3, math.radians(2.0)

    def depth(theta: float) -> float:
        beta = theta / 2.0
        # the edge as a line through (0, offset) with slope tan(taper), turned by beta
        slope = math.tan(beta + taper)
        start = (-offset * math.sin(beta), offset * math.cos(beta))
        return 0.5e-3 * THICKNESS_MM - (start[1] + slope * (contact_m - start[0]))

    step = 1e-6
    rate = (depth(opening + step) - depth(opening - step)) / (2 * step)
    sunk = depth(opening)
    return 0.0 if sunk <= 0 else -2.0 * force_N(sunk) * rate


@pytest.fixture(scope="module")
def pressed(tmp_path_factory: pytest.TempPathFactory) -> ModelPackage:
    path = tmp_path_factory.mktemp("stated") / "foam.zip"
    foam = Material(force_N=(2.0, 0.2), exponent=1.4, thickness_mm=THICKNESS_MM, reference_mm=1.0)
    return build_package(foam, Blades(), None, str(path), scene=PRESSING)


@pytest.mark.parametrize("opening", [0.36, 0.45, 0.5])
@pytest.mark.parametrize("contact", [0.022, 0.03])
def test_the_torque_is_that_of_the_equations(
    pressed: ModelPackage, opening: float, contact: float
) -> None:
    exact = pressed_torque(lambda d: 2.0 * (d / 1e-3) ** 1.4, opening, contact)
    bound = pressed.manifest.bound.largest_seen_Nm
    assert pressed.torque(opening, -0.1, contact) == pytest.approx(exact, abs=bound + 1e-6)


def test_the_band_holds_what_was_stated_and_no_more(pressed: ModelPackage) -> None:
    """A tenth of the force's standard deviation is a tenth of the torque's: 5 and 95 %."""
    torque = pressed.torque(0.45, -0.1, 0.022)
    low, high = pressed.band(0.45, -0.1, 0.022)
    assert torque > 0
    assert high / low == pytest.approx(math.exp(2 * 1.645 * 0.1), rel=0.08)


def test_it_says_that_nothing_was_measured(pressed: ModelPackage) -> None:
    assert any("stated, not measured" in sentence for sentence in pressed.warnings)
    assert scissorcal.open_package(pressed.source).manifest.provenance.cut.stated


def test_the_same_numbers_and_seed_give_the_same_bytes(tmp_path: Path) -> None:
    paper = Material(force_N=2.0, exponent=1.4, toughness_J_per_m2=4000.0, kappa=(0.8, 0.02))
    for name in ("a.zip", "b.zip"):
        build_package(paper, Blades(), Friction(coulomb_Nm=0.01), tmp_path / name, seed=3)
    assert (tmp_path / "a.zip").read_bytes() == (tmp_path / "b.zip").read_bytes()


@pytest.mark.parametrize("kappa", [(0.97, 0.029), (0.9, 0.09), (0.1, 0.05)])
def test_a_widely_stated_kappa_stays_a_share(kappa: tuple[float, float], tmp_path: Path) -> None:
    """Of the 200 draws of (0.97, 0.029) about 30 of a log-normal would lie above 1."""
    paper = Material(force_N=2.0, exponent=1.4, toughness_J_per_m2=4000.0, kappa=kappa)
    package = build_package(paper, Blades(), None, tmp_path / "paper.zip", seed=3)
    assert package.kernel() is not None
    low, high = package.band(0.35, -0.3, 0.03)
    assert 0.0 < low < high


def test_a_law_of_ones_own_is_rendered_within_the_tolerance(tmp_path: Path) -> None:
    own = Material(law=Cubic(), thickness_mm=THICKNESS_MM, depths_mm=(0.05, 8.0))
    package = build_package(own, Blades(), None, tmp_path / "own.zip", scene=PRESSING)

    def force(depth: float) -> float:
        return 0.5 * (1e3 * depth + 0.3 * (1e3 * depth) ** 3)

    for opening in (0.36, 0.45, 0.5):
        exact = pressed_torque(force, opening, 0.022)
        assert package.torque(opening, -0.1, 0.022) == pytest.approx(exact, rel=0.02, abs=1e-5)
    assert "Cubic" in package.manifest.provenance.cut.candidate


def test_a_law_is_not_continued_beyond_its_depths(tmp_path: Path) -> None:
    own = Material(law=Cubic(), thickness_mm=THICKNESS_MM, depths_mm=(0.02, 3.0))
    with pytest.raises(InputError, match=r"presses down to .* mm, and Material.depths_mm ends"):
        build_package(own, Blades(), None, tmp_path / "own.zip", scene=PRESSING)


@dataclass(frozen=True)
class Step:
    def parameters(self):
        return {"force_N": 1.0}

    def force_N(self, indentation_m, force_N):
        return force_N * np.where(indentation_m < 3e-4, 1e-3 * indentation_m, 1.0 + indentation_m)


@pytest.mark.parametrize(
    ("numbers", "error", "words"),
    [
        ({"force_N": 2.0}, InputError, "needs force_N and exponent"),
        ({"force_N": 2.0, "exponent": -1.0}, InputError, r"Material.exponent = -1.0 must be above"),
        ({"force_N": (2.0, 0.1, 3.0), "exponent": 1.0}, InputError, "Material.force_N"),
        ({"force_N": 2.0, "exponent": 1.5, "kappa": 0.8}, InputError, "needs toughness_J_per_m2"),
        (
            {"force_N": 2.0, "exponent": 1.5, "toughness_J_per_m2": 1e3, "kappa": (0.9, 0.1)},
            InputError,
            r"of mean 0.9 has a standard deviation of at most 0.0905",
        ),
        (
            {"force_N": 2.0, "exponent": 1.5, "toughness_J_per_m2": 1e3, "kappa": 1.0},
            InputError,
            "leave kappa out",
        ),
        ({"law": Cubic(), "force_N": 2.0}, InputError, "leave out force_N"),
        ({"law": Step()}, ModelError, "cannot be rendered"),
        ({"law": Cubic(), "depths_mm": (1.0, 0.1)}, InputError, "depths_mm"),
        ({"law": 3}, InputError, "needs two methods"),
    ],
)
def test_numbers_that_are_no_material_are_refused(numbers, error, words, tmp_path) -> None:
    with pytest.raises(error, match=words):
        build_package(Material(**numbers), Blades(), None, tmp_path / "none.zip")
    assert not (tmp_path / "none.zip").exists()


def test_blades_that_are_none_are_refused_by_their_key(tmp_path: Path) -> None:
    paper = Material(force_N=2.0, exponent=1.4)
    with pytest.raises(InputError, match=r"the stated numbers.*length_mm"):
        build_package(paper, Blades(length_mm=-75.0), None, tmp_path / "none.zip", scene=PRESSING)
    with pytest.raises(InputError, match=r"contact_mm"):
        build_package(paper, Blades(length_mm=-75.0), None, tmp_path / "none.zip")
    with pytest.raises(InputError, match="moving"):
        build_package(paper, Blades(moving="left"), None, tmp_path / "none.zip")
