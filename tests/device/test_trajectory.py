"""Plans: smooth, within limits, labelled, and with every cut in fresh material."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scissorcal.device.cut_trajectory import Blade, cut_plan, hand_requests
from scissorcal.device.paths import PathBuilder, SwingLimits, glide, multisine
from scissorcal.device.trajectory import (
    Plan,
    approach,
    check_reference,
    friction_plan,
    usable_opening,
)
from scissorcal.errors import DeviceError, InputError
from scissorcal.model import edge_through
from scissorcal.recipe import TURN_ACCELERATION, Edge, StatedCurve, builtin_recipe
from tests.device.conftest import IDENTITY
from tests.device.recipes import changed

TICK_S = 1e-3
CUTTING = ("paper-80gsm", "cotton-cloth")


@given(
    distance=st.floats(-2, 2).filter(lambda d: abs(d) > 1e-6),
    speed=st.floats(1e-2, 50),
    acceleration=st.floats(1, 200),
)
@settings(max_examples=60)
def test_glides_arrive_at_rest_within_their_bounds(
    distance: float, speed: float, acceleration: float
) -> None:
    way, rate = glide(distance, speed, acceleration, TICK_S)
    assert way[-1] == pytest.approx(distance)
    assert rate[-1] == 0.0
    assert np.abs(rate).max() <= speed * (1 + 1e-9)
    assert np.all(np.diff(np.abs(way)) >= -1e-12)
    assert np.abs(np.diff(rate, prepend=0.0)).max() / TICK_S <= acceleration * (1 + 1e-6)
    middle = (rate[1:] + rate[:-1]) / 2
    assert np.allclose(np.diff(way)[:-1] / TICK_S, middle[:-1], atol=0.05 * speed)


def test_a_glide_of_no_distance_takes_no_time() -> None:
    assert len(glide(0.0, 1.0, 1.0, TICK_S)[0]) == 0


def test_multisine_keeps_its_limits_and_uses_one_of_them() -> None:
    limits = SwingLimits(amplitude=0.3, rate=1.5, acceleration=80.0)
    way, rate = multisine(8.0, (1.0, 15.0), limits, TICK_S)
    shares = (
        np.abs(way).max() / limits.amplitude,
        np.abs(rate).max() / limits.rate,
        np.abs(np.gradient(rate)).max() / TICK_S / limits.acceleration,
    )
    assert max(shares) == pytest.approx(1.0, abs=0.01)
    assert (way[-1], rate[-1]) == (0.0, 0.0)
    assert np.abs(way[0]) < 1e-6
    assert np.allclose(np.gradient(way) / TICK_S, rate, atol=0.01)


def each_stroke(plan: Plan) -> list[tuple[int, np.ndarray, np.ndarray, np.ndarray]]:
    """Stroke index with its opening, rate and advance, in order."""
    found = []
    for segment in plan.segments:
        reference = segment.reference
        for index in np.unique(reference.stroke[reference.stroke >= 0]):
            of = reference.stroke == index
            axes = (reference.opening, reference.opening_rate, reference.advance)
            opening, rate, advance = (axis[of] for axis in axes)
            found.append((int(index), opening, rate, advance))
    return found


def test_friction_sweeps_every_speed_both_ways_across_the_whole_scene() -> None:
    recipe = builtin_recipe("paper-80gsm")
    plan = friction_plan(recipe, IDENTITY, advance=-0.06)
    low, high = recipe.scene.opening_rad
    cells = np.zeros((10, 2, len(recipe.capture.friction.speeds_rad_per_s)), dtype=bool)
    for index, opening, rate, advance in each_stroke(plan)[:-1]:
        stroke = plan.strokes[index]
        assert np.all(advance == -0.06)
        assert np.all(rate <= 0 if stroke.kind == "closing" else rate >= 0)
        cruising = np.abs(rate) > 0.99 * stroke.speed
        inside = np.histogram(opening[cruising], 10, (low + 0.03, high - 0.03))[0] > 0
        speed = recipe.capture.friction.speeds_rad_per_s.index(stroke.speed)
        cells[:, int(stroke.kind == "opening"), speed] |= inside
    assert np.all(cells)
    planned = {(stroke.kind, stroke.speed) for stroke in plan.strokes[:-1]}
    speeds = recipe.capture.friction.speeds_rad_per_s
    assert planned == {(kind, speed) for kind in ("closing", "opening") for speed in speeds}
    assert len(plan.strokes) == (2 + 3) * len(speeds) + 1
    assert plan.strokes[-1].kind == "excitation"
    assert [index for index, *_ in each_stroke(plan)] == list(range(len(plan.strokes)))


@settings(max_examples=20)
@given(
    speeds=st.lists(st.floats(0.03, 1.5), min_size=2, max_size=4, unique=True),
    repeats=st.integers(1, 3),
)
def test_half_of_the_sweeps_turn_in_the_middle(speeds: list[float], repeats: int) -> None:
    """Each sweep covers the range both ways; every second begins after a turn in its middle."""
    recipe = changed(
        "paper-80gsm",
        capture__friction={
            "speeds_rad_per_s": tuple(speeds),
            "repeats": repeats,
            "excitation_s": 1.0,
        },
    )
    low, high = recipe.scene.opening_rad
    plan = friction_plan(recipe, IDENTITY)
    reference = plan.segments[0].reference
    moving = np.sign(reference.opening_rate)
    turned = from_ends = 0
    for index, opening, _, _ in each_stroke(plan)[:-1]:
        begin = int(np.flatnonzero(reference.stroke == index)[0])
        before = moving[:begin][moving[:begin] != 0]
        there = 1.0 if plan.strokes[index].kind == "opening" else -1.0
        assert abs(opening[-1] - opening[0]) > 0.3 * (high - low)
        middle = abs(opening[0] - 0.5 * (low + high)) < 0.25 * (high - low)
        assert not middle or before[-1] == -there, "it begins with a turn"
        turned, from_ends = turned + middle, from_ends + (not middle)
    sweeps = len(speeds) * repeats
    middles = sum((place + repeat) % 2 for repeat in range(repeats) for place in range(len(speeds)))
    assert turned == middles
    assert from_ends == 2 * (sweeps - middles) + 2 * middles


@pytest.mark.parametrize("name", [*CUTTING, "press-only"])
def test_plans_are_steady_and_within_limits(name: str) -> None:
    recipe = builtin_recipe(name)
    stops = usable_opening(IDENTITY)
    for plan in (friction_plan(recipe, IDENTITY), cut_plan(recipe, IDENTITY)):
        for segment in plan.segments:
            reference = segment.reference
            check_reference(reference, IDENTITY)
            assert reference.opening.min() >= stops[0]
            assert reference.opening.max() <= stops[1]
            assert np.abs(np.diff(reference.opening)).max() < 2e-3
            assert np.abs(np.diff(reference.advance)).max() < 1e-4
            assert np.abs(np.diff(reference.opening_rate)).max() < 0.1


@pytest.mark.parametrize("name", CUTTING)
def test_every_cut_goes_through_fresh_material_within_the_scene(name: str) -> None:
    recipe = builtin_recipe(name)
    plan = cut_plan(recipe, IDENTITY)
    blade = Blade.of(recipe)
    assert len(plan.segments) == recipe.capture.cut.sheets
    low, high = recipe.scene.contact_m
    tolerance = 1e-4
    for segment in plan.segments:
        assert segment.load == "sheet"
        crack = 0.0
        for stroke in plan.strokes:
            of = segment.reference.stroke == stroke.index
            if stroke.kind != "closing" or not of.any():
                continue
            assert stroke.sheet == segment.sheet
            crossing = blade.crossing(segment.reference.opening[of])
            assert low - tolerance <= crossing.min()
            assert crossing.max() <= high + tolerance
            assert len(set(segment.reference.advance[of])) == 1
            reach = segment.reference.advance[of] + crossing
            assert reach[0] < crack, "a stroke starts behind the end of the cut"
            assert reach[-1] > crack + 0.02
            crack = reach[-1]
        assert crack < recipe.material.sheet_length_mm * 1e-3
        assert segment.reference.advance[-1] == segment.reference.advance[0]
        assert segment.reference.opening[-1] == segment.reference.opening[0]
    speeds = [stroke.speed for stroke in plan.strokes if stroke.kind == "closing"]
    wanted = recipe.capture.cut.speeds_rad_per_s
    assert speeds == [wanted[i % len(wanted)] for i in range(len(speeds))]


def test_pushing_on_never_touches_the_sheet() -> None:
    recipe = builtin_recipe("paper-80gsm")
    segment = cut_plan(recipe, IDENTITY).segments[0]
    reference = segment.reference
    ahead = np.diff(reference.advance, append=reference.advance[-1]) > 0
    reach = reference.advance + Blade.of(recipe).crossing(reference.opening)
    crack = np.maximum.accumulate(np.where(reference.stroke >= 0, reach, 0.0))
    assert np.all(reach[ahead] < crack[ahead])


def test_a_short_sheet_is_used_and_not_severed() -> None:
    recipe = changed("paper-80gsm", material={"sheet_length_mm": 30.0})
    plan = cut_plan(recipe, IDENTITY)
    reference = plan.segments[0].reference
    reach = (reference.advance + Blade.of(recipe).crossing(reference.opening)).max()
    assert 0.027 < reach < 0.03
    with pytest.raises(InputError, match="sheet_length_mm = 4"):
        cut_plan(changed("paper-80gsm", material={"sheet_length_mm": 4.0}), IDENTITY)


def test_presses_stay_above_the_middle_and_visit_several_contacts() -> None:
    recipe = builtin_recipe("press-only")
    plan = cut_plan(recipe, IDENTITY)
    blade = Blade.of(recipe)
    assert {stroke.kind for stroke in plan.strokes} == {"press", "opening"}
    assert {s.speed for s in plan.strokes} == set(recipe.capture.cut.speeds_rad_per_s)
    contacts = set()
    for index, opening, _, advance in each_stroke(plan):
        if plan.strokes[index].kind == "press":
            contact = -advance[0]
            contacts.add(round(contact, 6))
            assert blade.crossing(opening[0]) < contact < blade.crossing(opening[-1])
            assert blade.crossing(opening[-1], above=-recipe.upper_face_m) < contact
    assert len(contacts) == recipe.capture.cut.strokes_per_sheet
    low, high = recipe.scene.contact_m
    assert low <= min(contacts) < max(contacts) <= high


def test_approach_starts_where_the_rig_stands_and_moves_one_axis_at_a_time() -> None:
    start = cut_plan(builtin_recipe("paper-80gsm"), IDENTITY).segments[0].reference
    way = approach(0.3, -0.075, start, TICK_S)
    assert abs(way.opening[0] - 0.3) < 1e-4
    assert abs(way.advance[0] + 0.075) < 1e-5
    assert way.opening[-1] == start.opening[0]
    assert way.advance[-1] == start.advance[0]
    assert np.all(way.stroke == -1)
    moves = (np.abs(np.diff(way.opening)) > 0) & (np.abs(np.diff(way.advance)) > 0)
    assert not moves.any()


def test_the_crossing_is_the_root_of_the_edge() -> None:
    edge = {"family": "arc", "offset_mm": -8.0, "taper_deg": 2.0, "length_mm": 75.0}
    given = Edge.model_validate({**edge, "curvature_per_m": -1.5})
    paper = builtin_recipe("paper-80gsm")
    upper = paper.model_copy(update={"rig": paper.rig.model_copy(update={"edge": given})})
    blade = dataclasses.replace(Blade.of(upper), moving_blades=1)
    for opening in np.radians([15.0, 25.0, 35.0]):
        x = float(blade.crossing(opening))
        station = np.linspace(0, blade.length, 200_001)
        offset = -8e-3 + np.tan(np.radians(2.0)) * station - 1.5 * station**2 / 2
        along = station * np.cos(opening) - offset * np.sin(opening)
        height = station * np.sin(opening) + offset * np.cos(opening)
        assert np.interp(x, along, height) == pytest.approx(blade.upper_face, abs=1e-9)
        assert blade.opening_at(x, (0.1, 0.9)) == pytest.approx(opening, abs=1e-6)


def test_no_opening_is_planned_in_a_gap_of_the_crossing() -> None:
    """A wavy edge rises through the face twice at some openings: there it crosses at no place."""
    station = np.linspace(0.0, 75.0, 60)
    offset = -8.0 + 0.035 * station + 2.0 * np.sin(2 * np.pi * station / 40.0 + 1.5)
    curve = StatedCurve(*edge_through(np.column_stack([station, offset]) * 1e-3))
    blade, openings = Blade(2, curve, 5e-5), (float(np.radians(4.0)), float(np.radians(50.0)))
    planned = [blade.opening_at(x, openings) for x in np.linspace(0.012, 0.062, 80)]
    known = np.array([one for one in planned if one is not None])
    assert 0 < len(known) < len(planned)
    assert np.isfinite(blade.crossing(known)).all()


def points_edge(lift_mm: float = 0.0) -> dict[str, object]:
    stations = np.linspace(0.0, 75.0, 40)
    offsets = -8.0 + lift_mm + 0.035 * stations + 0.4 * np.sin(2 * np.pi * stations / 40.0)
    pairs = tuple(zip(stations.tolist(), offsets.tolist(), strict=True))
    nothing = dict.fromkeys(("offset_mm", "taper_deg", "length_mm"))
    return {"family": "points", "points_mm": pairs, **nothing}


@pytest.mark.parametrize("name", ["paper-80gsm", "press-only"])
def test_points_on_a_line_are_planned_as_the_line(name: str) -> None:
    line = builtin_recipe(name).rig.edge
    stations = np.linspace(0.0, 1e3 * line.length_m, 9)
    offsets = line.offset_mm + stations * np.tan(np.radians(line.taper_deg))
    pairs = tuple(zip(stations.tolist(), offsets.tolist(), strict=True))
    edge = points_edge() | {"points_mm": pairs}
    for planned, expected in zip(
        cut_plan(changed(name, rig__edge=edge), IDENTITY).segments,
        cut_plan(builtin_recipe(name), IDENTITY).segments,
        strict=True,
    ):
        for key in ("opening", "advance"):
            own, other = getattr(planned.reference, key), getattr(expected.reference, key)
            assert own == pytest.approx(other, abs=1e-9)


def test_cuts_along_a_wave_meet_the_plate_where_the_wave_is() -> None:
    recipe = changed("paper-80gsm", rig__edge=points_edge())
    blade, low = Blade.of(recipe), recipe.scene.contact_m[0]
    stations = np.linspace(0.0, 0.075, 20_001)
    offset = -8e-3 + 0.035 * stations + 0.4e-3 * np.sin(2 * np.pi * stations / 0.04)
    for _, opening, _, _ in each_stroke(cut_plan(recipe, IDENTITY)):
        beta = opening[len(opening) // 2] / 2
        height = stations * np.sin(beta) + offset * np.cos(beta) - recipe.upper_face_m
        (at,) = np.flatnonzero(np.diff(np.sign(height)) > 0)
        along = stations[at] * np.cos(beta) - offset[at] * np.sin(beta)
        assert float(blade.crossing(2 * beta)) == pytest.approx(along, abs=2e-4)
        assert low - 1e-4 <= along <= recipe.scene.contact_m[1] + 1e-4


def test_points_that_never_meet_the_plate_are_refused() -> None:
    edge = points_edge(lift_mm=20.0)
    with pytest.raises(InputError, match=r"With rig\.edge \(40 points\).*without waves"):
        cut_plan(changed("paper-80gsm", rig__edge=edge), IDENTITY)


def test_a_rig_without_advance_motor_cuts_by_hand_only() -> None:
    recipe = builtin_recipe("paper-80gsm")
    with pytest.raises(DeviceError, match="--hand"):
        cut_plan(recipe, IDENTITY._replace(capabilities=1))
    assert len(hand_requests(recipe)) == recipe.capture.cut.sheets


def test_what_cannot_be_planned_is_refused_with_a_reason() -> None:
    with pytest.raises(InputError, match="share at least 3 degrees"):
        friction_plan(
            builtin_recipe("paper-80gsm"), IDENTITY._replace(opening_min=0.86, opening_max=1.2)
        )
    with pytest.raises(InputError, match="offset_mm < 0"):
        cut_plan(changed("paper-80gsm", rig__edge={"offset_mm": 8.0}), IDENTITY)
    with pytest.raises(DeviceError, match="goes no further back"):
        cut_plan(builtin_recipe("paper-80gsm"), IDENTITY._replace(advance_min=0.0))
    with pytest.raises(InputError, match="scissorcal import"):
        friction_plan(changed("paper-80gsm", rig={"joint": "linear"}), IDENTITY)


def test_references_beyond_the_limits_are_refused() -> None:
    path = PathBuilder(0.5, 0.0, TICK_S)
    path.open_to(1.0, 0.5, TURN_ACCELERATION)
    with pytest.raises(InputError, match="planned opening goes from"):
        check_reference(path.reference(), IDENTITY)
    path = PathBuilder(0.5, float("nan"), TICK_S)
    path.rest(0.1)
    with pytest.raises(InputError, match="not finite"):
        check_reference(path.reference(), IDENTITY)
