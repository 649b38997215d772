"""A fitted law projected onto a simpler candidate: exact where that holds the law, else near it."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from scissorcal.calibration import FitResult
from scissorcal.package.exact import pick_draws
from scissorcal.package.simplest.candidates import Aspect, Candidate, simpler_candidates
from scissorcal.package.simplest.difference import Scene, difference, felt
from scissorcal.package.simplest.law import Law, column
from scissorcal.package.simplest.project import Projection, Reference, project
from scissorcal.recipe import Recipe
from tests.package.fits import cut_fit, friction_fit, recipe, with_edge

DRAWS = 30


def law_of(cut: FitResult, friction: FitResult | None = None) -> Law:
    return Law.of_fits(cut, friction, pick_draws(cut, friction, np.random.default_rng(1)))


def projected(chosen: Recipe, law: Law, aspect: Aspect, name: str) -> Projection:
    return project(Reference.of(law, chosen), Candidate(aspect, name))


def edged(chosen: Recipe, sds: dict[str, float], **edge: Any) -> FitResult:
    fit = cut_fit(chosen, draws=DRAWS, spread=0.01)
    facts = {**fit.structure["edge"], **edge}
    return (
        with_edge(fit, facts, sds)
        if sds
        else replace(fit, structure={**fit.structure, "edge": facts})
    )


def test_a_friction_law_without_its_extra_terms_is_found_exactly() -> None:
    chosen = recipe()
    none = {"stribeck": 0.0, "angle_slope": 0.0, "angle_curvature": 0.0}
    law = law_of(cut_fit(chosen, draws=DRAWS), friction_fit(draws=DRAWS, **none))
    found = projected(chosen, law, "friction", "coulomb+viscous")
    assert found.difference.worst_share.max() < 1e-9
    assert found.law.friction is not None
    assert law.friction is not None
    assert found.law.friction.names == ("inertia", "offset", "coulomb", "viscous")
    for name in found.law.friction.names:
        np.testing.assert_allclose(
            column(found.law.friction, name), column(law.friction, name), rtol=1e-6
        )


def test_a_smooth_cut_costs_what_a_ripple_costs_on_average() -> None:
    """A power law's mean share has a closed form, so the projected energy has one too."""
    chosen, kappa, power = recipe(), 0.97, 1.5
    law = law_of(cut_fit(chosen, kappa=kappa, exponent=power, draws=DRAWS, spread=1e-6))
    found = projected(chosen, law, "fracture", "smooth")
    low = kappa ** (1 / power)
    share = (1 - kappa * low) / ((power + 1) * (1 - low))
    assert "kappa" not in found.law.cut.names
    assert column(found.law.cut, "fracture_energy")[0] == pytest.approx(0.5 * share, rel=1e-3)
    teeth = (1 - kappa) / share
    assert found.difference.worst_share[0] == pytest.approx(teeth, rel=0.02), "the ripple is felt"


@pytest.mark.parametrize(
    ("family", "edge"),
    [
        ("line", {"family": "arc"}),
        ("line", {"family": "spline", "spline_m": (1e-5,) * 6, "spline_start_m": 0.01}),
        ("arc", {"family": "cubic", "curvature_per_m": 0.3}),
    ],
)
def test_an_edge_of_a_simpler_family_is_found_exactly(family: str, edge: dict[str, Any]) -> None:
    chosen = recipe(render_friction=False)
    law = law_of(edged(chosen, {"offset_m": 5e-5, "taper_rad": 1e-3}, **edge))
    found = projected(chosen, law, "edge", family)
    assert found.difference.worst_share.max() < 1e-6
    stations = np.linspace(0.012, 0.07, 7)
    np.testing.assert_allclose(
        found.law.model().cutting.edge.offset_at(stations),
        law.model().cutting.edge.offset_at(stations),
        atol=1e-9,
    )


def test_an_edge_that_was_not_drawn_stays_one_edge() -> None:
    chosen = recipe(render_friction=False)
    law = law_of(edged(chosen, {}, family="arc", curvature_per_m=0.02))
    found = projected(chosen, law, "edge", "line")
    assert not any(name.startswith("edge_") for name in found.law.cut.names)
    assert found.law.cut.structure["edge"]["family"] == "line"


@pytest.mark.parametrize("name", ["power", "exponential"])
def test_a_response_is_nearest_in_torque(name: str) -> None:
    """No law of the family beside the projected one is nearer."""
    chosen = recipe("press-only", render_friction=False)
    fit = cut_fit(chosen, energy=None, response="spline", force=5.0, shape=(0.2, -0.1), draws=DRAWS)
    law = law_of(fit)
    reference = Reference.of(law, chosen)
    found = project(reference, Candidate("response", name))

    def cost(factor: float, column_name: str) -> float:
        part = found.law.at(0).cut
        draws = part.draws.copy()
        draws[:, part.names.index(column_name)] *= factor
        other = felt(Law(replace(part, draws=draws), None), reference.projecting)
        away = (other.torque - reference.near.torque[:1]) / reference.near.scale[:1]
        counted = reference.near.clear[:1] & reference.near.reached[:1]
        return float(np.sum(np.where(counted, away, 0.0) ** 2))

    for parameter in ("response_force", "response_exponent"):
        here = cost(1.0, parameter)
        assert here <= cost(1.01, parameter)
        assert here <= cost(0.99, parameter)


def test_draws_keep_their_spread() -> None:
    """Each draw is projected by itself: a simpler law is as uncertain as the fit was."""
    chosen = recipe(opening_rate_rad_per_s=(0.3, 1.0))
    law = law_of(cut_fit(chosen, draws=200), friction_fit(draws=200))
    found = projected(chosen, law, "friction", "coulomb+viscous+angle")
    assert found.law.friction is not None
    assert law.friction is not None
    before, after = (column(part, "coulomb")[1:] for part in (law.friction, found.law.friction))
    assert after.std() == pytest.approx(before.std(), rel=0.1)
    assert np.corrcoef(before, after)[0, 1] > 0.99


def test_friction_never_drives_the_motion() -> None:
    """Friction that falls with the speed asks for a negative viscous term, and gets 0."""
    chosen = recipe(opening_rate_rad_per_s=(0.05, 0.2))
    values = {"viscous": 1e-5, "stribeck": 0.02, "stribeck_rate": 0.1}
    law = law_of(cut_fit(chosen, draws=DRAWS), friction_fit(draws=DRAWS, **values))
    found = projected(chosen, law, "friction", "coulomb+viscous")
    assert found.law.friction is not None
    assert np.all(column(found.law.friction, "viscous") == 0.0)


def test_candidates_stand_cheapest_first_and_below_the_fit() -> None:
    chosen = recipe()
    law = law_of(cut_fit(chosen, kappa=0.8, damping=0.2, draws=DRAWS), friction_fit(draws=DRAWS))
    names = {
        aspect: [one.name for one in simpler_candidates(law, aspect)]
        for aspect in ("friction", "fracture", "edge", "damping", "response", "closure")
    }
    assert names["friction"][:2] == ["none", "coulomb"]
    assert "stribeck+angle" not in names["friction"]
    assert "stribeck" in names["friction"]
    assert names["fracture"] == ["smooth"]
    assert names["damping"] == ["none"]
    assert names["edge"] == []
    assert names["response"] == []
    assert names["closure"] == ["eq4"]


def test_a_difference_counts_where_either_law_is_felt() -> None:
    chosen = recipe()
    scene = Scene.of(chosen)
    cut, friction = cut_fit(chosen, draws=DRAWS), friction_fit(draws=DRAWS)
    full, bare = felt(law_of(cut, friction), scene), felt(law_of(cut), scene)
    there, back = difference(full, bare), difference(bare, full)
    np.testing.assert_allclose(there.worst_Nm, back.worst_Nm)
    assert difference(full, full).worst_share.max() == 0.0
    worst = np.max(np.abs(full.friction), axis=1)
    assert np.all(there.worst_Nm <= worst + 1e-12)
    assert np.all(there.worst_Nm > 0.9 * worst)
