"""What tables carry of a friction law: adopted terms of the rate; the rest is refused or told."""

import dataclasses

import numpy as np
import pytest

from scissorcal.calibration import FittedParameter
from scissorcal.errors import InputError
from scissorcal.package import build_package, open_package
from tests.package.fits import cut_fit, friction_fit, recipe


def with_structure(fit, **changes):
    return dataclasses.replace(fit, structure={**fit.structure, **changes})


def built(tmp_path, friction, cut=None):
    chosen = recipe()
    cut = cut or cut_fit(chosen)
    path = tmp_path / "model.scissorcal"
    summary = build_package(chosen, friction, cut, path, np.random.default_rng(0))
    return summary, open_package(path)


def adopted(**terms: float):
    return with_structure(friction_fit(**terms), adopt=list(terms))


def test_adopted_terms_of_the_rate_are_rendered(tmp_path):
    """The term is even in the rate: it resists opening, and helps closing."""
    _, plain = built(tmp_path, friction_fit())
    _, package = built(tmp_path, adopted(**{"rate^2": 0.004}))
    for rate in (0.3, -0.3, 0.8):
        more = float(plain.torque(0.55, rate, 0.05) - package.torque(0.55, rate, 0.05))
        assert more == pytest.approx(0.004 * rate**2, rel=0.02), rate


def test_terms_of_the_place_are_refused_with_a_way_out(tmp_path):
    with pytest.raises(InputError, match=r'adopted "sin\(opening\)".*Remove it'):
        built(tmp_path, adopted(**{"sin(opening)": 0.001}))


def test_terms_that_let_friction_drive_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"drives the motion at .* rad/s"):
        built(tmp_path, adopted(**{"rate*|rate|": -0.5}))


def test_errors_from_load_and_presliding_are_warnings(tmp_path):
    fit = friction_fit(load_share=0.2, load_gain=0.0, presliding_share=0.5, presliding_length=0.02)
    summary, package = built(tmp_path, with_structure(fit, law="stribeck+angle+load+presliding"))
    told = " ".join(summary.warnings)
    assert "friction grows by 0.2 of the load" in told
    assert "builds up over 0.02 rad" in told
    assert "0.018 N m too much right after one" in told
    assert package.warnings == summary.warnings


def test_cogging_is_not_rendered_and_gives_no_warning(tmp_path):
    _, plain = built(tmp_path, friction_fit())
    fit = with_structure(friction_fit(), cogging_periods_per_turn=252.0)
    found = [
        FittedParameter(f"cogging_{wave}", "N m", size, 1e-5, size, size, size, 0.1)
        for wave, size in (("cos", 3e-4), ("sin", -4e-4))
    ]
    draws = np.tile([3e-4, -4e-4], (len(fit.draws), 1))
    fit = dataclasses.replace(fit, nuisance=tuple(found), nuisance_draws=draws)
    summary, package = built(tmp_path, fit)
    for opening in (0.5, 0.5 + np.pi / 252):
        assert package.torque(opening, -0.3, 0.05) == plain.torque(opening, -0.3, 0.05)
    assert "cogging" not in " ".join(summary.warnings)


def test_load_dependent_friction_of_a_cut_is_a_warning_without_a_failure(tmp_path):
    share = FittedParameter("load_share", "1", 0.09, 0.01, 0.075, 0.09, 0.105, 0.1)
    cut = with_structure(cut_fit(recipe()), load_share=True)
    cut = dataclasses.replace(
        cut, nuisance=(share,), nuisance_draws=np.full((len(cut.draws), 1), 0.09)
    )
    summary, package = built(tmp_path, friction_fit(), cut)
    (told,) = package.manifest.provenance.cut.left_out
    too_much = 0.22 / 1.11 * package.manifest.bound.scene_torque_Nm
    assert "grows with the cut's torque, by 0.09 (sd 0.01) of it" in told
    assert f"up to {too_much:.2g} N m too much" in told
    assert told in summary.warnings
    assert told in package.warnings
    assert not [v for v in summary.verdicts if v.check == "failed fits" and v.status == "fail"]
    _, plain = built(tmp_path, friction_fit())
    assert plain.manifest.provenance.cut.left_out == ()


def test_a_negligible_load_share_gives_no_warning(tmp_path):
    share = FittedParameter("load_share", "1", 0.001, 0.002, 0.0, 0.001, 0.004, 0.1)
    cut = dataclasses.replace(with_structure(cut_fit(recipe()), load_share=True), nuisance=(share,))
    _, package = built(tmp_path, friction_fit(), cut)
    assert package.manifest.provenance.cut.left_out == ()
