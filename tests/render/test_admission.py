"""What a rig may render: the rule, the package's stiffness, derating, and its cures."""

import math
from dataclasses import replace

import numpy as np
import pytest
from benchmarks.stability import draw_loops, simulate

from scissorcal.errors import InputError
from scissorcal.kernel import Kernel, Table
from scissorcal.package import ModelPackage
from scissorcal.recording import Estimate, ProbeResult
from scissorcal.render.admission import admit, passivity_config, rendered_tables
from scissorcal.render.admission_rule import (
    LoopFacts,
    allowed_damper,
    allowed_stiffness,
    delayed_stiffness,
)
from scissorcal.render.derating import needs_of, softened
from scissorcal.render.felt_cost import FeltTorque, felt_rates
from scissorcal.render.felt_cures import Asked, stated_cures
from scissorcal.render.result import _admitted
from scissorcal.render.rig_facts import RigFacts, loop_facts, rig_facts, with_probe
from tests.kernel.zoo import make_tables
from tests.render.felt import felt_change
from tests.render.test_engine import rig

RIG = LoopFacts(
    tick_s=1e-3,
    late_s=1.5e-3,
    inertia_kg_m2=2.1e-4,
    damping_Nm_s_per_rad=0.002,
    coulomb_Nm=0.0128,
    encoder_step_rad=2.0 * math.pi / 131072,
)
HAND = 0.02
LIMIT, RATE = 1.0, 1.0
ASKED = Asked(LIMIT, 0.05, RATE, tolerance=0.07, hand_damping=HAND)


def test_the_rule_is_half_of_what_damping_takes_over_the_delay() -> None:
    taken = 0.002 + 4.0 * 0.0128 / (math.pi * 1.5)
    assert allowed_stiffness(RIG) == pytest.approx(0.5 * taken / 2e-3)
    assert allowed_stiffness(RIG, HAND) == pytest.approx(0.5 * (taken + HAND) / 2e-3)
    coarse = replace(RIG, encoder_step_rad=2.0 * math.pi / 2000)
    assert allowed_stiffness(coarse, 1.0) == pytest.approx(2.0 * 0.0128 / coarse.encoder_step_rad)


@pytest.mark.parametrize(
    ("count", "one_sided"),
    [
        (25, True),
        pytest.param(250, False, marks=pytest.mark.slow),
        pytest.param(250, True, marks=pytest.mark.slow),
    ],
)
def test_no_simulated_loop_oscillates_or_chatters_where_the_rule_admits_it(
    count: int, one_sided: bool
) -> None:
    loops = draw_loops(count, np.random.default_rng(20), friction=True)
    found = simulate(loops, loops.rule(), seconds=3.5, one_sided=one_sided)
    assert not found.oscillating(loops.encoder).any()
    assert not found.chattering().any()


@pytest.mark.slow
def test_most_loops_oscillate_at_little_more_than_twice_the_rule() -> None:
    """What the margin of two gives away, and no more: half of them do at 2.2 times the rule."""
    loops = draw_loops(150, np.random.default_rng(21), friction=True)
    found = simulate(loops, 2.5 * loops.delayed(), seconds=3.5, one_sided=False)
    assert np.mean(found.oscillating(loops.encoder)) > 0.6


@pytest.mark.slow
def test_loops_without_dry_friction_oscillate_at_their_eigenvalues() -> None:
    """Hulin's boundary, twice the rule: none below it, nearly all beyond."""
    loops = draw_loops(150, np.random.default_rng(22), friction=False)
    edge = 2.0 * loops.delayed()
    below = simulate(loops, 0.5 * edge, seconds=3.5, one_sided=False)
    beyond = simulate(loops, 1.3 * edge, seconds=3.5, one_sided=False)
    assert not below.oscillating(loops.encoder).any()
    assert np.mean(beyond.oscillating(loops.encoder)) > 0.9


def test_stiffness_of_a_straight_response_is_its_slope_by_the_lever() -> None:
    straight = Table([0.0, 1e-2], [0.0, 20.0], [2e3, 2e3])
    tables = make_tables(fracture_energy=0.0, response=straight)
    needs = needs_of(tables, LIMIT)
    kernel = Kernel(tables)
    kernel.reset(needs.contact)
    torque = [kernel.step(needs.opening + step, 0.0, 0.0).torque for step in (-1e-3, 1e-3)]
    assert needs.stiffness == pytest.approx((torque[0] - torque[1]) / 2e-3, rel=0.02)
    assert needs.drop_Nm == 0.0
    assert needs.friction_Nm == 0.0


def test_a_softer_response_keeps_fracture_and_gentle_slopes(paper: ModelPackage) -> None:
    tables = paper.tables
    soft = softened(tables, 4000.0)
    assert soft.fracture_energy == tables.fracture_energy
    assert soft.kappa == tables.kappa
    assert np.array_equal(soft.response.y, tables.response.y)
    at = np.linspace(0.0, float(soft.response.x[-1]), 4000)
    slope = np.diff(soft.response.evaluate(at)) / np.diff(at)
    assert slope.max() < 4000.0 * 1.05
    gentle = tables.response.slope < 2000.0
    assert np.allclose(soft.response.x[gentle], tables.response.x[gentle])
    assert 0.0 < felt_change(tables, soft, LIMIT) < 0.05
    with pytest.raises(ValueError, match="above 0"):
        softened(tables, 0.0)


def test_a_rig_that_answers_at_once_renders_all(paper: ModelPackage) -> None:
    quick = replace(RIG, tick_s=2.5e-4, late_s=0.0)
    found = admit(paper.tables, quick, ASKED)
    assert found.evaluated
    assert not found.derated
    assert found.factor == 1.0
    assert found.cures == ()
    assert rendered_tables(paper.tables, found) is paper.tables


def test_what_is_derated_is_within_the_rule_and_says_what_it_costs(paper: ModelPackage) -> None:
    found = admit(paper.tables, RIG, ASKED)
    assert found.derated
    assert 0.9 * found.allowed_in_hand < found.rendered <= found.allowed_in_hand < found.needed
    soft = rendered_tables(paper.tables, found)
    assert needs_of(soft, LIMIT).stiffness == pytest.approx(found.rendered)
    felt = FeltTorque(paper.tables, LIMIT, felt_rates(paper.tables, 0.05, RATE))
    assert found.felt_share == pytest.approx(felt.change(soft, found.friction_width_rad))
    assert f"{found.factor:.0%}" in found.reasons[1]
    assert f"{found.felt_share:.1%}" in found.reasons[1]


def test_each_stated_cure_cures(paper: ModelPackage) -> None:
    """The figures of the cures: a delay, more damping."""
    needed = needs_of(paper.tables, LIMIT).stiffness
    fine = replace(RIG, encoder_step_rad=1e-6)
    delay, damping = admit(paper.tables, fine, ASKED).cures
    quick = float(delay.split("A delay of ")[1].split(" ms")[0]) * 1e-3
    late = replace(fine, late_s=quick - 0.5 * fine.tick_s)
    assert delayed_stiffness(late, HAND) == pytest.approx(needed, rel=0.1)
    more = float(damping.split(" mN m s/rad")[0]) * 1e-3
    assert delayed_stiffness(fine, HAND + more) == pytest.approx(needed, rel=0.1)
    coarse = replace(RIG, encoder_step_rad=2.0 * math.pi / 2000, late_s=0.0, tick_s=1e-4)
    dry, step = admit(paper.tables, coarse, replace(ASKED, hand_damping=0.3)).cures
    rough = float(dry.split("friction of ")[1].split(" mN m")[0]) * 1e-3
    assert allowed_stiffness(replace(coarse, coulomb_Nm=rough), 0.3) > 0.9 * needed
    finer = float(step.split("step of ")[1].split(" rad")[0])
    assert allowed_stiffness(replace(coarse, encoder_step_rad=finer), 0.3) > 0.9 * needed


def test_cures_that_act_only_together_say_so(paper: ModelPackage) -> None:
    """A coarse encoder and a delay: each figure by itself leaves the other."""
    needed = needs_of(paper.tables, LIMIT).stiffness
    coarse = replace(RIG, encoder_step_rad=2.0 * math.pi / 2000)
    cures = stated_cures(coarse, HAND, RATE, needed)
    assert len(cures) == 4
    assert all(", and together with it " in sentence for sentence in cures)
    for sentence in cures:
        cured, hand = coarse, HAND
        if "friction of" in sentence:
            dry = float(sentence.split("friction of ")[1].split(" mN m")[0]) * 1e-3
            cured = replace(cured, coulomb_Nm=dry)
        else:
            step = float(sentence.split("step of ")[1].split(" rad")[0])
            cured = replace(cured, encoder_step_rad=step)
        assert allowed_stiffness(cured, hand, RATE) < 0.999 * needed
        if "delay of" in sentence:
            delay = float(sentence.split("delay of ")[1].split(" ms")[0]) * 1e-3
            cured = replace(cured, late_s=delay - 0.5 * cured.tick_s)
        else:
            hand += float(sentence.split("together with it ")[1].split(" mN")[0]) * 1e-3
        assert allowed_stiffness(cured, hand, RATE) >= 0.999 * needed


def test_no_cure_is_a_delay_of_nothing() -> None:
    """A rig that takes no energy at all needs some: no delay is short enough."""
    free = replace(RIG, coulomb_Nm=0.0, damping_Nm_s_per_rad=0.0)
    cures = stated_cures(free, 0.0, RATE, 10.0)
    assert not any("step of 0 rad" in sentence or "delay of 0 ms" in sentence for sentence in cures)
    assert all("friction" in sentence for sentence in cures)
    assert any("together" in sentence for sentence in cures)


def test_a_delay_below_half_the_tick_names_the_tick() -> None:
    fine = replace(RIG, encoder_step_rad=1e-7)
    quick, _ = stated_cures(fine, 0.0, RATE, 100.0)
    assert "with a tick below" in quick


def test_friction_alone_without_a_known_dry_friction_is_refused(paper: ModelPackage) -> None:
    """A package of friction only needs no stiffness, and blades still have to rest."""
    flat = Table([0.0, 1e-2], [0.0, 0.0], [0.0, 0.0])
    tables = replace(paper.tables, fracture_energy=0.0, response=flat)
    assert needs_of(tables, LIMIT).friction_Nm > 0.0
    with pytest.raises(InputError, match="Capture friction again"):
        admit(tables, replace(RIG, coulomb_Nm=0.0), ASKED)


def test_what_was_rendered_where_nothing_is_allowed_fails(paper: ModelPackage) -> None:
    found = admit(paper.tables, RIG, ASKED)
    assert _admitted(found).status == "pass"
    assert _admitted(replace(found, allowed_in_hand=0.0)).status == "fail"


def test_friction_near_rest_follows_the_encoder_and_the_delay(paper: ModelPackage) -> None:
    """Its own stiffness stays within the rule; a coarse encoder widens it further."""
    known = admit(paper.tables, RIG, ASKED)
    level = needs_of(paper.tables, LIMIT).friction_Nm
    assert level / known.friction_width_rad <= known.allowed_in_hand * 1.000001
    coarse = replace(RIG, encoder_step_rad=2.0 * math.pi / 5000)
    wide = admit(paper.tables, coarse, ASKED)
    assert wide.friction_width_rad == pytest.approx(4.0 * coarse.encoder_step_rad)
    config = passivity_config(known, rig().identity)
    assert config.friction_width == known.friction_width_rad
    assert config.is_measured
    assert 0.0 < config.most_damping < 0.1


def test_without_dry_friction_or_far_too_late_it_is_refused(paper: ModelPackage) -> None:
    for unfit in (replace(RIG, coulomb_Nm=0.0), replace(RIG, late_s=0.05)):
        with pytest.raises(InputError, match="cannot render the package stably"):
            admit(paper.tables, unfit, ASKED)


def test_a_material_damper_that_the_rate_is_too_late_for_is_rendered_weaker(
    paper: ModelPackage,
) -> None:
    oily = replace(paper.tables, rate_damping=100.0)
    found = admit(oily, RIG, ASKED)
    assert found.derated
    assert 0.0 < found.damping_share < 1.0
    assert "damping" in found.reasons[-1]
    weaker = needs_of(replace(oily, rate_damping=100.0 * found.damping_share), LIMIT)
    assert weaker.damper == pytest.approx(allowed_damper(RIG), rel=1e-3)
    assert rendered_tables(oily, found).rate_damping == pytest.approx(100.0 * found.damping_share)


def test_what_a_probe_adds(paper: ModelPackage) -> None:
    """Its delay always, its upper end; friction and inertia where no fit has them."""
    probe = ProbeResult(
        device="rig",
        identity="0",
        made_at="2026-11-22T20:00:00+00:00",
        delay_s=Estimate(1.0e-3, 1.0e-4),
        inertia_kg_m2=Estimate(2.0e-4, 1e-5),
        coulomb_Nm=Estimate(0.01, 1e-3),
        viscous_Nm_s_per_rad=Estimate(0.002, 2e-3),
    )
    fitted = rig_facts(paper)
    known = with_probe(fitted, probe)
    assert known.late_s == pytest.approx(1.1645e-3, rel=1e-3)
    assert (known.coulomb_Nm, known.inertia_kg_m2) == (fitted.coulomb_Nm, fitted.inertia_kg_m2)
    bare = with_probe(RigFacts(), probe)
    assert bare.coulomb_Nm == pytest.approx(0.00836, rel=1e-2)
    assert bare.damping_Nm_s_per_rad == 0.0
    assert bare.inertia_kg_m2 == 2.0e-4
    assert "probe of 2026" in bare.source
    assert with_probe(fitted, None) is fitted


def test_an_unknown_rig_is_not_evaluated(silent_paper: ModelPackage) -> None:
    found = admit(silent_paper.tables, None, ASKED)
    assert not found.evaluated
    assert not found.derated
    assert "not known" in found.reasons[0]
    assert rig_facts(silent_paper) == RigFacts()


def test_facts_are_the_weaker_ends_of_the_fit_and_say_where_they_come_from(
    paper: ModelPackage,
) -> None:
    known = rig_facts(paper)
    assert known.coulomb_Nm is not None
    assert 0.008 < known.coulomb_Nm < 0.014
    facts, sources = loop_facts(rig().identity, known)
    assert facts is not None
    assert facts.late_s == pytest.approx(2e-3)
    assert any("no probe measured it" in sentence for sentence in sources)
    measured = replace(known, late_s=7e-4, late_source="the probe of 22 November")
    facts, sources = loop_facts(rig().identity, measured)
    assert facts is not None
    assert facts.delay_s == pytest.approx(1.2e-3)
    assert any("the probe" in sentence for sentence in sources)
