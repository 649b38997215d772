"""Friction that grows with the cut's torque: what closing blades feel, and nothing else changes."""

import dataclasses

import numpy as np
import pytest

from scissorcal.calibration import FitResult, FittedParameter
from scissorcal.model import FrictionLaw, friction_torque
from scissorcal.package import build_package, open_package
from scissorcal.package.friction_tables import as_closing
from tests.calibration.cut.test_known import bent
from tests.package.fits import cut_fit, friction_fit, recipe

SHARE = 0.2


def loaded(share: np.ndarray | float = SHARE) -> FitResult:
    """The cut's fit with a share of its torque as friction, one for each draw."""
    cut = cut_fit(recipe())
    shares = np.broadcast_to(share, (len(cut.draws), 1)).astype(float)
    row = FittedParameter("load_share", "1", float(shares.mean()), 0.01, 0.1, 0.2, 0.3, 0.1)
    return dataclasses.replace(
        cut,
        structure={**cut.structure, "load_share": True},
        nuisance=(row,),
        nuisance_draws=shares,
    )


def package_of(tmp_path, cut):
    path = tmp_path / "model.scissorcal"
    build_package(recipe(), friction_fit(), cut, path, np.random.default_rng(0))
    return open_package(path)


def test_closing_blades_feel_the_material_and_its_share_in_friction(tmp_path):
    """Torque beyond that of the empty joint is 1 + share times as large, and so is its band: within
    1 %, since the point is scaled to the mean of what closing costs, not to its own cost."""
    (tmp_path / "a").mkdir()
    plain, found = package_of(tmp_path / "a", cut_fit(recipe())), package_of(tmp_path, loaded())
    places = np.array([0.4, 0.55, 0.7]), -0.3, 0.018
    law = plain.exact.friction
    assert law is not None
    empty = -friction_torque(law, places[0], places[1])
    own = plain.torque(*places) - empty
    assert np.all(own > 0.005)
    assert found.torque(*places) - empty == pytest.approx(1.2 * own, rel=0.01)
    for before, now in zip(plain.band(*places, 0.9), found.band(*places, 0.9), strict=True):
        assert np.all(np.abs(now - empty - 1.2 * (before - empty)) < 0.02 * np.abs(own))


def test_what_closing_costs_is_kept_however_it_is_divided():
    """Draws whose share and energy are opposed have one cost of closing: so has the MAP point."""
    cut = cut_fit(recipe())
    names = [p.name for p in cut.parameters]
    shares = np.random.default_rng(1).uniform(0.0, 0.4, (len(cut.draws), 1))
    fit = loaded(shares)
    draws = np.array(fit.draws)
    for name in ("fracture_energy", "response_force"):
        draws[:, names.index(name)] = 1.3 * fit.map_point[names.index(name)] / (1.0 + shares[:, 0])
    if "kappa" in names:
        draws[:, names.index("kappa")] = fit.map_point[names.index("kappa")]
    found = as_closing(dataclasses.replace(fit, draws=draws))
    energy = names.index("fracture_energy")
    assert np.ptp(found.draws[:, energy]) < 1e-12
    assert found.map_point[energy] == pytest.approx(1.3 * fit.map_point[energy])
    assert found.parameter("fracture_energy").sd < 1e-9


def test_a_law_without_friction_by_load_is_left_alone():
    cut = cut_fit(recipe())
    assert as_closing(cut) is cut


def test_friction_is_rendered_where_its_posterior_lies(tmp_path):
    """A mode with ten times the static friction of the median, as where no sweep was slow."""
    fit = bent(0.3)
    point = fit.map_point.copy()
    point[[p.name for p in fit.parameters].index("stribeck")] = 0.03
    path = tmp_path / "ridge.zip"
    ridge = dataclasses.replace(fit, map_point=point)
    build_package(recipe(), ridge, cut_fit(recipe()), path, np.random.default_rng(0))
    law = open_package(path, warn=False).exact.friction
    assert law is not None
    means = FrictionLaw.of_fit({p.name: p.mean for p in fit.parameters}, law.angle_center)
    for rate in (-0.1, -0.02):
        expected = float(friction_torque(means, 0.55, rate))
        assert float(friction_torque(law, 0.55, rate)) == pytest.approx(expected, rel=1e-3)
