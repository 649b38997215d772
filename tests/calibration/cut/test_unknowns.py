"""What nobody measured becomes a bound on torque, with the sentence that removes it."""

from dataclasses import replace

import numpy as np
import pytest

from scissorcal.calibration import FittedParameter
from scissorcal.calibration.cut.unknowns import BY_EYE_M, SceneMean, with_unknowns
from scissorcal.verdicts import TORQUE
from tests.calibration.cut.recipes import paper
from tests.calibration.signals.test_idle import NOISE, ZERO, recording
from tests.package.fits import cut_fit, friction_fit

ASYMMETRIC = friction_fit(law="coulomb+viscous", symmetric=False)


def checks(recipe=None, fit=None, friction=ASYMMETRIC, recordings=()):
    recipe = recipe or paper()
    fit = with_unknowns(fit or cut_fit(recipe), recipe, friction, recordings)
    return {verdict.check: verdict for verdict in fit.verdicts}, fit


def rig(**changes):
    recipe = paper()
    edge = recipe.rig.edge.model_copy(update=changes.pop("edge", {}))
    return recipe.model_copy(
        update={"rig": recipe.rig.model_copy(update={"edge": edge, **changes})}
    )


def test_four_unmeasured_quantities_give_four_bounds_and_remedies():
    found, fit = checks()
    for name, remedy in {
        "opening zero": "opening_zero_sd_deg",
        "torque zero": "one second at idle",
        "edge shape": "Photograph the blade",
        "friction by load": "loaded sweeps",
    }.items():
        verdict = found[name]
        assert verdict.guards.startswith(TORQUE)
        assert verdict.limit == "at most"
        assert verdict.threshold == pytest.approx(0.07)
        assert verdict.status == ("pass" if verdict.value <= 0.07 else "not_evaluated")
        assert verdict.why.startswith("Error up to ")
        assert remedy in verdict.why
    assert found["edge shape"].status == "not_evaluated"
    assert not fit.rejected
    rows = fit.diagnostics["not_measured"]
    assert [row["share"] for row in rows] == [v.value for v in found.values()]


def test_an_edge_with_stated_uncertainty_has_no_bound():
    photographed, _ = checks(rig(edge={"source": "photographs"}))
    known = with_edge(cut_fit(paper()), "offset_m", "taper_rad")
    for found in (photographed, checks(fit=known)[0]):
        assert (found["edge shape"].status, found["edge shape"].value) == ("pass", 0.0)


def with_edge(fit, *fields):
    """The fit with parameters of the edge, at what it has already."""
    values = [fit.structure["edge"][field] for field in fields]
    rows = [
        FittedParameter(f"edge_{field}", "1", value, 1e-5, value, value, value, 1.0)
        for field, value in zip(fields, values, strict=True)
    ]
    return replace(
        fit, parameters=(*fit.parameters, *rows), map_point=np.append(fit.map_point, values)
    )


def test_an_offset_alone_leaves_the_taper_open():
    every = checks()[0]["edge shape"].value
    offset_known = checks(fit=with_edge(cut_fit(paper()), "offset_m"))[0]["edge shape"].value
    assert 0.0 < offset_known < every


def test_the_bound_of_an_edge_is_what_its_three_shapes_do_to_the_scene():
    recipe = paper()
    scene = SceneMean.of(cut_fit(recipe), recipe)
    mean = scene.torque()
    offset = scene.torque(offset_m=-BY_EYE_M) - mean
    assert scene.change(offset_m=BY_EYE_M) == pytest.approx(offset)
    found, _ = checks()
    assert found["edge shape"].value > offset / mean
    assert found["edge shape"].value < 3 * offset / mean


def test_turning_a_straight_edge_is_shifting_the_opening():
    """A blade turned by g about the pivot: slope taper + g, offset a little less."""
    recipe = paper()
    scene = SceneMean.of(cut_fit(recipe), recipe)
    turn = 1e-4
    edge = scene.cutting.edge
    taper = float(edge.taper_rad)
    offset = float(edge.offset_m) * (np.cos(taper) / np.cos(taper + turn) - 1.0)
    blades = scene.cutting.moving_blades
    opened = scene.torque(away_rad=blades * turn) - scene.torque()
    turned = scene.torque(taper_rad=turn, offset_m=offset) - scene.torque()
    assert opened == pytest.approx(turned, rel=1e-3)


def test_a_stated_zero_replaces_half_a_millimetre():
    stated, _ = checks(rig(opening_zero_sd_deg=0.02))
    assert stated["opening zero"].status == "pass"
    assert stated["opening zero"].value < 0.05 * checks()[0]["opening zero"].value
    assert "0.5 mm" not in stated["opening zero"].why


def test_an_idle_second_replaces_the_asymmetry():
    found, _ = checks(recordings=(recording(),))
    fit = checks()[1]
    before = fit.diagnostics["not_measured"][1]["torque_Nm"]
    levels = {p.name: p.mean for p in ASYMMETRIC.parameters}
    assert before == pytest.approx(0.5 * abs(levels["coulomb_pos"] - levels["coulomb_neg"]))
    torque = found["torque zero"].value / checks()[0]["torque zero"].value * before
    assert torque == pytest.approx(ZERO + 2 * NOISE / np.sqrt(1500), rel=0.2)


def test_friction_with_an_offset_parameter_has_no_zero_error():
    assert checks(friction=friction_fit())[0]["torque zero"].value == 0.0


def test_a_fitted_load_share_leaves_no_error_while_closing():
    recipe = paper(load_share="fit")
    share = FittedParameter("load_share", "1", 0.05, 0.01, 0.0336, 0.05, 0.0664, 0.1)
    fit = replace(cut_fit(recipe), nuisance=(share,))
    verdict = checks(recipe, fit)[0]["friction by load"]
    assert (verdict.status, verdict.value) == ("pass", 0.0)
    assert "0.05 (sd 0.01)" in verdict.why
    auto = paper(load_share="auto")
    laws = ("power response", "power response, load-dependent friction")
    both = replace(cut_fit(auto), candidates=tuple({"name": law} for law in laws))
    compared = checks(auto, both)[0]["friction by load"]
    assert (compared.status, compared.value) == ("pass", 0.0)
    one = replace(both, candidates=both.candidates[:1])
    assert checks(auto, one)[0]["friction by load"].value == pytest.approx(0.1)
