"""Pareto front and recommendation: what no other setting beats, and the cheapest within a limit."""

from dataclasses import replace

from hypothesis import given
from hypothesis import strategies as st

from scissorcal.bench.trade.assemble import pareto_front
from scissorcal.bench.trade.point import (
    Curve,
    Error,
    NextCapture,
    Point,
    Quantity,
    Setting,
    Spread,
)
from scissorcal.bench.trade.recommend import (
    Captures,
    choices_of,
    recommend,
    together_sentence,
    unsimulated,
)

NUMBERS = st.floats(0.0, 10.0).map(lambda value: round(value, 1))


@given(st.lists(st.tuples(NUMBERS, NUMBERS), min_size=1, max_size=12))
def test_a_point_is_on_the_front_exactly_where_no_other_is_better(
    points: list[tuple[float, float]],
) -> None:
    front = pareto_front([a for a, _ in points], [b for _, b in points])
    assert any(front)
    for (cost, error), on in zip(points, front, strict=True):
        beaten = any((a < cost and b <= error) or (a <= cost and b < error) for a, b in points)
        assert on != beaten


def spread(*values: float) -> Spread:
    return Spread.of([Quantity(value, "s") for value in values])


def point(label: str, costs: Spread, share: float | None, *, present: bool = False) -> Point:
    errors = {} if share is None else {"error": Error(share, "N m", share)}
    return Point(Setting(label, 1.0, present=present), {"time": costs}, errors)


CURVE = Curve("made", "Made", "time", "error", against="the truth")
COARSE = point("coarse", spread(1.0), 0.2)
MIDDLE = point("middle", spread(2.0, 2.2), 0.004)
FINE = point("fine", spread(5.0), 0.001, present=True)


def recommended(*points: Point) -> Curve:
    return recommend(replace(CURVE, points=points), 0.01, 0.07)


def test_the_cheapest_setting_within_the_limit_is_recommended() -> None:
    found = recommended(COARSE, MIDDLE, FINE)
    assert choices_of([found]) == (("made", "middle"),)
    assert found.sentences[0] == (
        "middle is enough: 2.1 s time in place of 5 s with fine, 58 % less. Its error is 0.4 % of "
        "the scene's largest torque against the truth; the limit of one knob is 1 %, its part of "
        "the tolerance of 7 %. Cheaper, but passed over: coarse: its error is 20 %."
    )


def test_the_present_setting_stays_where_costs_cannot_be_told_apart() -> None:
    close = replace(FINE, costs={"time": spread(2.1, 2.3)})
    assert choices_of([recommended(COARSE, MIDDLE, close)]) == (("made", "fine"),)


def test_a_clear_saving_is_recommended_where_the_cheapest_cannot_be_told_from_the_present() -> None:
    noisy = point("noisy", spread(1.0, 1.9, 6.0), 0.004)
    assert choices_of([recommended(noisy, MIDDLE, FINE)]) == (("made", "middle"),)
    found = recommended(noisy, FINE)
    assert choices_of([found]) == (("made", "fine"),)
    assert found.sentences[0].startswith(
        "fine stays: no measured setting costs less time by more than the repeats differ and by "
        "10 %. "
    )


def test_a_time_must_be_lower_by_more_than_its_noise_and_another_cost_need_not() -> None:
    near = point("near", spread(4.6), 0.004)
    assert choices_of([recommended(near, FINE)]) == (("made", "fine"),)

    def bytes_of(one: Point, value: float) -> Point:
        return replace(one, costs={"time": Spread.of([Quantity(value, "B")])})

    found = recommended(bytes_of(near, 460.0), bytes_of(FINE, 500.0))
    assert choices_of([found]) == (("made", "near"),)


def test_no_objection_is_a_limit_that_is_kept() -> None:
    found = recommended(point("near", spread(4.6), 0.002), COARSE, FINE)
    assert "coarse would save 80 % time, but its error is 20 %." in found.sentences[0]
    failing = replace(MIDDLE, rejected=("k-hat",))
    assert recommended(failing).sentences[0] == (
        "No setting is recommended: middle leaves the lowest error, but it fails the check k-hat."
    )


def test_a_reference_that_stays_is_named_with_what_it_stands_for() -> None:
    known = replace(FINE, errors={}, reference=True)
    said = recommended(COARSE, known).sentences[0]
    assert said.endswith("its error is 20 %. Errors are counted against the truth.")


def test_a_cheaper_setting_is_needed_where_the_present_one_is_beyond_the_limit() -> None:
    present = point("present", spread(2.11), 0.2, present=True)
    said = recommended(MIDDLE, present).sentences[0]
    assert said.startswith(
        "middle is needed: 2.1 s time in place of 2.11 s with present, which is not within the "
        "limit."
    )


def test_a_remark_is_said_with_its_setting() -> None:
    draft = replace(MIDDLE, setting=replace(MIDDLE.setting, remark="It compares nothing."))
    assert recommended(draft, FINE).sentences[0].endswith("of 7 %. It compares nothing.")
    same = replace(FINE, costs=MIDDLE.costs)
    assert "compares" not in recommended(draft, same).sentences[0]


def test_the_present_setting_stays_where_what_is_cheaper_is_too_far_off() -> None:
    found = recommended(COARSE, FINE)
    assert choices_of([found]) == (("made", "fine"),)
    assert "fine stays: coarse would save 80 % time, but its error is 20 %." in found.sentences[0]


def test_a_setting_whose_fit_fails_a_check_of_its_own_is_not_recommended() -> None:
    failing = replace(MIDDLE, rejected=("k-hat",))
    assert choices_of([recommended(COARSE, failing, FINE)]) == (("made", "fine"),)
    cheapest = recommended(failing, FINE).sentences[0]
    assert "middle would save 58 % time, but it fails the check k-hat." in cheapest
    both = replace(FINE, rejected=("k-hat",))
    assert choices_of([recommended(COARSE, failing, both)]) == (("made", "middle"),)


def test_a_setting_with_a_guarded_error_beyond_the_present_one_is_not_recommended() -> None:
    def guarded(one: Point, value: float) -> Point:
        return replace(one, errors={**one.errors, "needed": Error(value, "", guarded=True)})

    allowed = recommended(guarded(MIDDLE, 0.9), guarded(FINE, 0.1))
    assert choices_of([allowed]) == (("made", "middle"),)
    worse = recommended(guarded(MIDDLE, 4.0), guarded(FINE, 2.0))
    assert choices_of([worse]) == (("made", "fine"),)
    assert "but its needed is 4 in place of 2." in worse.sentences[0]


def test_every_cheaper_setting_that_is_passed_over_has_its_reason() -> None:
    refused = replace(point("refused", spread(0.5), 0.004), rejected=("bound share",))
    also = replace(point("also refused", spread(0.6), 0.004), rejected=("bound share",))
    said = recommended(refused, also, COARSE, MIDDLE, FINE).sentences[0]
    assert said.endswith(
        "Cheaper, but passed over: refused, also refused: it fails the check bound share; coarse: "
        "its error is 20 %."
    )
    said = recommended(refused, COARSE, FINE).sentences[0]
    assert "fine stays: refused would save 90 % time, but it fails the check bound share." in said
    assert said.endswith("passed over: coarse: its error is 20 %.")


def simulated(one: Point, error: float, loss: float) -> Point:
    return replace(one, next_capture=NextCapture(4, error, loss))


def on_captures(*points: Point, scatter: float | None = None) -> Curve:
    return recommend(replace(CURVE, points=points), 0.01, 0.07, captures=Captures(True, scatter))


def test_a_setting_is_recommended_with_what_the_next_capture_gives() -> None:
    found = on_captures(simulated(MIDDLE, 0.03, 0.002), simulated(FINE, 0.04, 0.0))
    assert choices_of([found]) == (("made", "middle"),)
    assert found.sentences[0].endswith(
        "On 9 of 10 captures of the same specimen the worst torque error is at most 3 % with it "
        "and 4 % with fine (4 captures simulated from the fits): expect up to 3.4 %, both "
        "together, against the truth."
    )


def test_a_setting_that_the_next_capture_may_reverse_is_not_recommended() -> None:
    found = on_captures(simulated(MIDDLE, 0.03, 0.02), simulated(FINE, 0.02, 0.0))
    assert choices_of([found]) == (("made", "fine"),)
    assert (
        "but on the next capture its worst torque error may be 2 % larger than with fine (4 "
        "captures simulated)." in found.sentences[0]
    )


def test_a_setting_without_simulated_captures_is_not_recommended() -> None:
    found = on_captures(MIDDLE, FINE)
    assert choices_of([found]) == (("made", "fine"),)
    assert "but no other capture was simulated with it within the budget." in found.sentences[0]
    without = recommend(replace(CURVE, points=(MIDDLE, simulated(FINE, 0.02, 0.0))), 0.01, 0.07)
    assert choices_of([without]) == (("made", "middle"),)
    assert "at most 2 % with the present settings" in without.sentences[0]


def test_the_cheapest_setting_without_captures_is_simulated_next() -> None:
    cheap = point("cheap", spread(1.0), 0.004)

    def wanted(*points: Point, needed: bool = True) -> str:
        found = unsimulated(replace(CURVE, points=points), 0.01, Captures(needed))
        return found.setting.label if found else ""

    assert wanted(cheap, MIDDLE, FINE) == "cheap"
    assert wanted(simulated(cheap, 0.1, 0.1), MIDDLE, FINE) == "middle"
    assert wanted(simulated(cheap, 0.01, 0.0), MIDDLE, FINE) == ""
    assert wanted(COARSE, FINE) == ""
    assert wanted(cheap, FINE, needed=False) == ""


def test_a_setting_that_saves_nothing_must_be_better_on_every_capture() -> None:
    present = point("present", spread(2.0), 0.2, present=True)
    dear = point("dear", spread(2.5), 0.001)
    assert choices_of([on_captures(simulated(dear, 0.1, 0.001), present)]) == ()
    found = on_captures(simulated(dear, 0.1, 0.0), present)
    assert choices_of([found]) == (("made", "dear"),)


def test_a_setting_that_mends_the_present_one_must_be_better_even_where_it_saves() -> None:
    present = point("present", spread(5.0), 0.2, present=True)
    assert choices_of([on_captures(simulated(MIDDLE, 0.1, 0.001), present)]) == ()
    said = on_captures(simulated(MIDDLE, 0.1, 0.0), present).sentences[0]
    assert said.startswith("middle is needed: ")


def test_an_error_inside_what_captures_differ_by_is_not_determined() -> None:
    said = on_captures(COARSE, FINE, scatter=0.3).sentences[0]
    assert "its error is 20 %, inside the 30 % by which captures differ." in said
    assert said.endswith("is not determined: capture again and repeat the benchmark.")
    assert "not determined" not in on_captures(COARSE, FINE, scatter=0.1).sentences[0]


def test_nothing_is_recommended_beyond_the_limit_or_without_a_share() -> None:
    found = recommended(COARSE)
    assert choices_of([found]) == ()
    assert found.sentences[0].startswith("No measured setting keeps the error within 1 %")
    lengths = [replace(one, errors={"error": Error(1.0, "um")}) for one in (COARSE, MIDDLE, FINE)]
    found = recommended(*lengths)
    assert choices_of([found]) == ()
    assert "no share of the torque" in found.sentences[0]


def test_a_failed_setting_is_named_with_its_reason() -> None:
    broken = Point(Setting("broken", 0.0), {}, {}, failed="It broke.")
    assert "broken gave no result: It broke." in recommended(broken, MIDDLE, FINE).sentences


def test_all_settings_at_once_are_told_with_their_measured_costs() -> None:
    both = replace(CURVE, points=(FINE, MIDDLE))
    assert together_sentence(both) == (
        "All recommended settings at once, measured: time 2.1 s in place of 5 s; error 0.4 % of "
        "the scene's largest torque in place of 0.1 %."
    )
    said = together_sentence(both, ["Loop rate (500 Hz)"])
    assert said.endswith(
        " Not part of this measurement, which they do not change: Loop rate (500 Hz)."
    )
    assert "not measured within the budget" in together_sentence(replace(CURVE, points=(FINE,)))


def test_a_spread_has_median_ends_and_multiples_of_the_baseline() -> None:
    found = Spread.of([Quantity(v, "ms") for v in (3.0, 1.0, 2.0)], baseline_s=0.001)
    assert (found.median, found.low, found.high, found.ratio) == (2.0, 1.0, 3.0, 2.0)
    assert Spread.of([Quantity(5.0, "B")], baseline_s=0.001).ratio is None
