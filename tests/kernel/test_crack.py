"""The walk of a crack in C: against its plain twin, its energy, closed forms, and the extremes."""

import dataclasses
import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scissorcal.calibration import Sheet, Unevenness, crack_law, material_torque
from scissorcal.kernel import CrackPath, walk_crack
from scissorcal.model import Cutting, Edge, Response, settled_contact, torque_at
from tests.kernel import golden_crack
from tests.kernel.reference_crack import walk

LINE = Edge("line", -0.008, 0.03, 0.075)
BENT = Edge("cubic", -0.008, 0.02, 0.075, curvature_per_m=1.2, bend_per_m2=8.0)
POWER = Response("power", 1.5, 1.4, 3e-4)
TICK_S = 1e-3
EVEN = Sheet(np.ones(2), 1.0)
"""Toughness that grows by a tenth every centimetre or so, in straight pieces."""
UNEVEN = Sheet(1.0 + 0.1 * np.sin(np.arange(80.0)), 1e-3)


def cutting(edge: Edge = LINE, blades: int = 1, kappa: float = 0.7, **named) -> Cutting:
    face = 1e-4 / blades
    given = {"response": POWER, "fracture_energy": 0.55, **named}
    return Cutting(
        edge, given.pop("response"), blades, face, given.pop("fracture_energy"), kappa, **given
    )


def strokes(count: int, advance: float = -0.03):
    """Two closings with an opening between, deeper the second time; the sledge creeps on."""
    phase = np.linspace(0.0, 3 * np.pi, count)
    opening = 0.5 + 0.3 * np.cos(phase) - 0.03 * phase / np.pi
    return opening, advance + 0.002 * np.linspace(0.0, 1.0, count)


def work(path: CrackPath, opening, advance) -> float:
    return float(-path.torque @ np.diff(opening) + path.push @ np.diff(advance))


@pytest.mark.parametrize(
    "one",
    [
        cutting(),
        cutting(blades=2, kappa=0.5),
        cutting(BENT, blades=1, kappa=0.85),
        cutting(BENT, blades=2, closure="eq4"),
        cutting(fracture_energy=None),
    ],
    ids=["line", "both blades", "bent", "bent, eq4", "pressed"],
)
@pytest.mark.parametrize("sheet", [EVEN, UNEVEN], ids=["even", "uneven"])
def test_the_c_code_equals_the_python_reference(one, sheet):
    """Places to 1e-9 m, torques and forces to 1e-9 of the largest, the same jumps."""
    opening, advance = strokes(240)
    found = walk_crack(crack_law(one, TICK_S, sheet), opening, advance)
    energy = one.fracture_energy or 0.0
    knots = sheet.step_m * np.arange(len(sheet.relative))
    plain = walk(
        one, lambda place: energy * np.interp(place, knots, sheet.relative), opening, advance
    )
    assert found.jumps == plain.jumps
    assert (found.jumps > 10) == (one.fracture_energy is not None)
    assert np.abs(found.place - plain.places).max() < 1e-9
    assert found.lost == pytest.approx(plain.lost, rel=1e-9)
    for ours, theirs in ((found.torque, plain.torque), (found.push, plain.push)):
        assert np.abs(ours - theirs).max() < 1e-9 * np.abs(theirs).max()


@pytest.mark.parametrize("blades", [1, 2])
@pytest.mark.parametrize("edge", [LINE, BENT], ids=["line", "bent"])
@pytest.mark.parametrize("kappa", [1.0, 0.6])
def test_work_is_stored_or_lost(edge, blades, kappa):
    """Simpson's rule over 20,000 ticks; a smooth crack loses its energy times its length."""
    opening, advance = strokes(20_000)
    one = cutting(edge, blades, kappa)
    path = walk_crack(crack_law(one, TICK_S), opening, advance)
    done = work(path, opening, advance)
    assert path.stored + path.lost == pytest.approx(done, rel=1e-7)
    length = path.place[-1] - path.place[0]
    assert length > 5e-3
    if kappa == 1.0:
        assert path.lost == pytest.approx(0.55 * length, rel=1e-9)
        assert path.jumps == 0
    else:
        assert 0.6 < path.lost / (0.55 * length) < 0.9


@pytest.mark.parametrize(
    "response", [POWER, Response("exponential", 1.5, 1.2, 3e-4)], ids=["power", "exponential"]
)
def test_a_smooth_crack_gives_the_torque_of_the_model(response):
    opening, advance = strokes(2_000)
    one = cutting(BENT, 2, 1.0, response=response)
    path = walk_crack(crack_law(one, TICK_S), opening, advance)
    running = np.flatnonzero(np.diff(path.place, prepend=0.0) > 0)[5:-5]
    running = running[np.isin(running + 1, running)]
    assert len(running) > 200
    ends = np.stack([opening[running], opening[running + 1]])
    moved = np.stack([advance[running], advance[running + 1]])
    place = np.stack([path.place[running], path.place[running + 1]])
    wanted = torque_at(one, ends, np.maximum(place - moved, settled_contact(one, ends))).mean(
        axis=0
    )
    assert path.torque[running] == pytest.approx(wanted, rel=1e-5)


def test_no_step_of_the_result_depends_on_the_sampling():
    """The same motion in straight pieces, sampled four times as densely."""
    opening, advance = strokes(300)
    fine = np.linspace(0, 299, 4 * 299 + 1)
    dense = (np.interp(fine, np.arange(300), each) for each in (opening, advance))
    law = crack_law(cutting(), TICK_S, UNEVEN)
    coarse, finer = walk_crack(law, opening, advance), walk_crack(law, *dense)
    assert coarse.jumps == finer.jumps
    assert finer.place[::4] == pytest.approx(coarse.place, abs=1e-12)
    assert coarse.lost == pytest.approx(finer.lost, rel=1e-9)


def test_a_damped_blade_presses_harder_while_it_sinks_in():
    opening, advance = strokes(3_000)
    still, moving = (
        walk_crack(crack_law(cutting(rate_damping=c), TICK_S), opening, advance) for c in (0.0, 5.0)
    )
    assert np.array_equal(still.place, moving.place)
    closing = (np.diff(opening) < 0) & (still.torque > 0)
    assert np.all(moving.torque[closing] > still.torque[closing])
    assert np.all(moving.torque[~closing] <= still.torque[~closing])


EXTREMES = {
    "kappa": st.floats(0.0, 1.0),
    "energy": st.sampled_from([1e-9, 1e-3, 0.5, 1e4]),
    "force": st.sampled_from([1e-6, 1.0, 1e6]),
    "exponent": st.floats(0.3, 5.0),
    "opening": st.lists(st.floats(-0.5, 2.0), min_size=2, max_size=30),
    "advance": st.floats(-0.2, 0.2),
    "blades": st.sampled_from([1, 2]),
    "damping": st.sampled_from([0.0, 1e3]),
}


def stays_finite(kappa, energy, force, exponent, opening, advance, blades, damping):
    """Crossed blades, leaps of the opening, sheets behind the pivot, stiffness of steel or foam."""
    one = cutting(
        BENT,
        blades,
        kappa,
        response=Response("power", force, exponent, 3e-4),
        fracture_energy=energy,
        rate_damping=damping,
    )
    theta = np.array(opening)
    path = walk_crack(crack_law(one, TICK_S, UNEVEN), theta, np.full(len(theta), advance))
    for values in (path.torque, path.push, path.place, [path.stored, path.lost]):
        assert np.all(np.isfinite(values))
    assert np.all(np.diff(path.place) >= 0.0)


@settings(max_examples=30)
@given(**EXTREMES)
def test_extremes_stay_finite(**extreme):
    stays_finite(**extreme)


@pytest.mark.slow
@settings(max_examples=200)
@given(**EXTREMES)
def test_more_extremes_stay_finite(**extreme):
    stays_finite(**extreme)


def test_an_invalid_path_is_refused():
    law = crack_law(cutting(), TICK_S)
    with pytest.raises(ValueError, match="one length"):
        walk_crack(law, np.zeros(3), np.zeros(2))
    with pytest.raises(ValueError, match="not empty"):
        walk_crack(law, np.zeros(0), np.zeros(0))
    assert len(walk_crack(law, np.ones(1), np.zeros(1)).torque) == 0


def test_a_fresh_sheet_is_cut_from_its_edge_and_air_gives_no_force():
    opening, advance = strokes(3_000)
    sheets = np.repeat([-1, 0, 1], 1000)
    uneven = Unevenness(0.05, 1e-3, 0.01)
    made = [
        material_torque(
            cutting(), uneven, (opening, advance, sheets), TICK_S, np.random.default_rng(seed)
        )
        for seed in (1, 1, 2)
    ]
    (torque, paths), (again, _), (other, _) = made
    assert np.array_equal(torque, again)
    assert not np.array_equal(torque, other)
    assert np.all(torque[:1000] == 0.0)
    assert [path.place[0] for path in paths] == [0.0, 0.0]


def test_an_uneven_sheet_has_the_process_that_it_is_drawn_from():
    rng = np.random.default_rng(3)
    sheets = [Sheet.draw(Unevenness(0.05, 1e-3, 0.02), 0.1, rng) for _ in range(300)]
    values = np.stack([sheet.relative for sheet in sheets])
    lag = round(1e-3 / sheets[0].step_m)
    within = values - values.mean(axis=1, keepdims=True)
    assert values.std() == pytest.approx(np.hypot(0.05, 0.02), rel=0.03)
    assert values.mean(axis=1).std() == pytest.approx(0.0211, rel=0.12)
    correlation = np.mean(within[:, lag:] * within[:, :-lag]) / np.mean(within**2)
    assert correlation == pytest.approx(np.exp(-1.0), abs=0.03)


def test_the_golden_vectors_are_the_python_references():
    stored = json.loads(golden_crack.PATH.read_text(encoding="utf-8"))
    made = json.loads(json.dumps(golden_crack.golden()))
    assert [case["title"] for case in stored["cases"]] == [case["title"] for case in made["cases"]]
    for case, twin in zip(stored["cases"], made["cases"], strict=True):
        for name in ("torque", "push", "place"):
            scale = np.abs(twin[name]).max()
            assert case[name] == pytest.approx(twin[name], abs=1e-10 * scale), name
        assert case["jumps"] == twin["jumps"]


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("tick_s", 0.0),
        ("kappa", np.nan),
        ("kappa", 1.5),
        ("damping_s_per_m", -1.0),
        ("tough", np.array([])),
        ("tough", np.array([np.inf])),
        ("tough_step", 0.0),
        ("upper_face_m", np.nan),
        ("moving_blades", 3),
    ],
)
def test_a_law_that_no_crack_has_is_refused(name, value):
    law = crack_law(cutting(), TICK_S)
    with pytest.raises(ValueError, match="no law of a crack"):
        dataclasses.replace(law, **{name: value})


def test_a_motion_that_is_not_finite_is_refused():
    law = crack_law(cutting(), TICK_S)
    opening, advance = strokes(50)
    opening[7] = np.nan
    with pytest.raises(ValueError, match="finite"):
        walk_crack(law, opening, advance)
