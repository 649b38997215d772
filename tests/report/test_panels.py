"""Panels: headlines, strokes over several recordings, groups, what was left out, completeness."""

from dataclasses import replace

import numpy as np
import pytest

from scissorcal.calibration import FitResult
from scissorcal.recording import Recording, Stroke
from scissorcal.report.inputs import Cell, Evidence
from scissorcal.report.panel import LARGEST_WIDTH, Panel, Row, Value, columns, panel_text
from scissorcal.report.strokes import block_means, group_strokes, strokes_of
from scissorcal.report.subjects.closing import left_out_panel, trace
from scissorcal.report.subjects.decision import (
    cells_of,
    data_panels,
    origin_of,
    origin_panel,
    trust_panel,
    weaknesses_panel,
)
from scissorcal.report.subjects.torque import torque_panel
from scissorcal.report.subjects.trust import Headline, geometry_headline, write_headline
from scissorcal.verdicts import Verdict
from tests.report.conftest import paper
from tests.report.fits import (
    cut_fit,
    cut_recording,
    friction_fit,
    friction_recording,
    linear_fit,
)


def headline_of(fit: FitResult) -> Headline:
    return write_headline(fit)


def good(fit: FitResult) -> FitResult:
    """The same fit with nothing against it."""
    passed = tuple(replace(verdict, status="pass") for verdict in fit.verdicts)
    sure = tuple(replace(parameter, identifiability=0.1) for parameter in fit.parameters)
    return replace(fit, verdicts=passed, parameters=sure)


def test_a_fit_without_its_trust_check_is_unverified() -> None:
    headline = headline_of(good(friction_fit()))
    assert headline.assessment == "unverified"
    assert "is not verified: it passed all 4 checks, but" in headline.sentence
    assert "trust" not in headline.sentence
    assert headline.next_steps[0].startswith("Run `scissorcal verify friction`")


def test_a_fit_that_passed_is_trusted_with_its_error() -> None:
    fit = good(friction_fit())
    halves = Verdict("verify.friction", "halves", "pass", 0.4, 0.0025, "They agree.")
    ranks = Verdict("verify.friction", "calibration", "pass", 0.4, 0.005, "Ranks are uniform.")
    fit = replace(fit, verdicts=fit.verdicts[:-1])
    alone = write_headline(fit, (halves,))
    assert (alone.assessment, alone.brief) == (
        "unverified",
        "passed all 4 checks; coverage not counted",
    )
    headline = write_headline(fit, (ranks, halves))
    assert headline.assessment == "trust"
    assert "passed all 5 checks" in headline.sentence
    assert "% (median; worst" in headline.sentence
    assert headline.next_steps == ("Read on, and sign with `scissorcal report sign`.",)


def test_one_failure_rejects_and_says_what_to_do() -> None:
    headline = headline_of(cut_fit())
    assert headline.assessment == "reject"
    assert "whiteness failed" in headline.sentence
    assert headline.next_steps[0] == next(
        v.why for v in cut_fit().verdicts if v.check == "whiteness"
    )
    assert "scissorcal fit cut" in headline.next_steps[-1]


def test_a_failure_of_an_unknown_check_states_its_reason() -> None:
    odd = Verdict("fit.cut", "phase of the moon", "fail", 1.0, 0.5, "It waxes.")
    headline = headline_of(replace(cut_fit(), verdicts=(odd,)))
    assert headline.next_steps[0] == "It waxes."


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"verdicts": ()}, "nothing was checked"),
        ({"effort": "draft"}, "intervals are those of a draft"),
        (
            {"verdicts": (Verdict("f", "trust check", "not_evaluated", None, None, "No."),)},
            "trust check could not be evaluated",
        ),
    ],
)
def test_doubts_ask_for_care(change: dict[str, object], words: str) -> None:
    headline = headline_of(replace(good(friction_fit()), **change))  # type: ignore[arg-type]
    assert headline.assessment == "care"
    assert words in headline.sentence
    assert headline.next_steps


def test_a_parameter_that_repeats_its_prior_asks_for_care() -> None:
    fit = good(friction_fit())
    silent = replace(fit.parameters[-1], identifiability=0.97)
    headline = headline_of(replace(fit, parameters=(*fit.parameters[:-1], silent)))
    assert headline.assessment == "care"
    assert "`angle_slope` repeats the prior" in headline.sentence


def test_strokes_are_numbered_on_over_recordings() -> None:
    fit = cut_fit()
    second = fit.series.stroke >= 6
    series = replace(fit.series, recording=np.where(second, 1, 0).astype(np.int64))
    fit = replace(fit, series=series, sources=("a.mcap sha256:aa", "b.mcap sha256:bb"))
    strokes = cut_recording().strokes
    halves = [
        _summary("b.mcap", "bb", strokes[6:]),
        _summary("elsewhere/a.mcap", "aa", strokes[:6]),
    ]
    found = list(strokes_of(fit, "cut", halves))
    assert [name.stroke for name in found] == list(range(12))
    assert [name.speed for name in found] == [stroke.speed for stroke in strokes]
    assert found[7].label == "stroke 7, closing at 0.25 rad/s, recording 2"
    assert found[7].recording == "b.mcap"


def test_samples_of_a_stroke_stand_in_order_of_time() -> None:
    """A cut's series has its elastic segments before the running ones."""
    fit = cut_fit()
    rng = np.random.default_rng(1)
    mixed = rng.permutation(len(fit.series.stroke))
    series = replace(
        fit.series, **{name: values[mixed] for name, values in vars(fit.series).items()}
    )
    for stroke in strokes_of(replace(fit, series=series), "cut", []):
        assert np.all(np.diff(series.time_s[stroke.places]) > 0.0)


def test_without_recordings_the_direction_names_a_stroke() -> None:
    named = list(strokes_of(replace(friction_fit(), held_out=()), "f", []))
    assert [name.kind for name in named[:4]] == ["closing", "opening", "closing", "opening"]
    assert all(name.speed is None for name in named)


def test_what_slides_moves_forward_and_backward() -> None:
    fit = linear_fit()
    way = np.where(fit.series.opening_rate > 0, 1, 0).astype(np.int64)
    fit = replace(fit, series=replace(fit.series, stroke=way), held_out=())
    labels = [stroke.label for stroke in strokes_of(fit, "f", [])]
    assert labels == ["stroke 0, backward", "stroke 1, forward"]


def test_speeds_that_are_nearly_the_same_share_a_group() -> None:
    fit, recording = cut_fit(), cut_recording()
    uneven = tuple(
        replace(stroke, speed=stroke.speed * (1 + 0.004 * stroke.index))
        for stroke in recording.strokes
    )
    strokes = strokes_of(fit, "cut", [replace(recording, strokes=uneven)])
    groups = group_strokes(fit, strokes)
    assert [len(group.strokes) for group in groups] == [4, 4, 4]


def test_groups_say_how_far_off_the_model_is() -> None:
    fit = friction_fit()
    strokes = strokes_of(fit, "friction", [friction_recording()])
    panel = torque_panel(fit, strokes, "friction")
    titles = [row.name for row in panel.rows]
    assert titles[0] == "closing and opening at 0.05 rad/s"
    assert titles[-1] == "stroke 20, excitation"
    assert panel.charts[-1].x.label == "time"
    values = {value.name: value.number for value in panel.rows[0].values}
    assert values["samples"] == 4 * 1320
    assert values["rms residual"] == pytest.approx(0.0011 / np.sqrt(1 - 0.25), rel=0.1)
    assert values["width of the band"] == pytest.approx(0.0004)


def test_block_means_skip_what_is_missing() -> None:
    values = np.array([1.0, 3.0, np.nan, 5.0, np.nan, np.nan])
    assert np.array_equal(block_means(values, 3), [2.0, 5.0, np.nan], equal_nan=True)
    assert np.array_equal(block_means(values, 100), values, equal_nan=True)
    assert len(block_means(np.zeros(0), 5)) == 0


def test_many_strokes_do_not_swell_the_report() -> None:
    fit = friction_fit()
    many = np.sort(np.arange(len(fit.series.stroke)) % 1500)
    strokes = strokes_of(replace(fit, series=replace(fit.series, stroke=many)), "friction", [])
    charts = torque_panel(fit, strokes, "friction").charts
    assert sum(len(series.x) for chart in charts for series in chart.series) <= 40_000


def test_what_was_left_out_is_named() -> None:
    recipe = paper()
    told = left_out(left_out_panel(recipe, [friction_fit()], {}))
    assert told["cut fit"][0] == "not there yet"
    assert told["force along the cut"][0] == "not needed"
    reason, why = told["friction: stribeck + angle, symmetric"]
    assert reason == "not chosen"
    assert "BIC is 0.9 higher" in why
    assert "0.84 % smaller" in why
    assert "friction: stribeck, symmetric" not in told


def test_a_scene_that_only_presses_needs_no_toughness() -> None:
    recipe = paper()
    pressing = recipe.model_copy(update={"scene": recipe.scene.model_copy(update={"cut": False})})
    told = left_out(left_out_panel(pressing, [], {}))
    assert {"toughness and fracture", "press fit", "friction fit"} <= set(told)


def left_out(panel: Panel) -> dict[str, tuple[str, ...]]:
    """Reason and explanation by what was left out."""
    return {row.name: tuple(value.text for value in row.values) for row in panel.rows}


def test_every_planned_stroke_is_counted_as_recorded_and_used() -> None:
    fit, summary = cut_fit(), cut_recording()
    kept = fit.series.stroke != 0
    series = replace(fit.series, **{n: v[kept] for n, v in vars(fit.series).items()})
    fit = replace(fit, series=series)
    strokes = strokes_of(fit, "cut", [summary])
    cells = cells_of([(fit, strokes)], Evidence(recordings=(summary,)))
    assert [(c.name, c.planned, c.recorded, c.used) for c in cells] == [
        ("closing at 0.1 rad/s", 4, None, 3),
        ("closing at 0.25 rad/s", 4, None, 4),
        ("closing at 0.6 rad/s", 4, None, 4),
    ]
    decision, every = data_panels(cells)
    assert "cut, closing at 0.1 rad/s: 3 of 4 strokes used" in decision.sentence
    assert [row.marked for row in every.rows] == [True, False, False]


def test_a_capture_that_ended_early_says_what_was_recorded() -> None:
    remark = "1.2 s recorded"
    short = Cell("cut", "closing at 0.6 rad/s", 4, 1, 1, remark=remark)
    decision, every = data_panels([short])
    assert "1 of 4 strokes recorded" in decision.sentence
    assert every.rows[0].note == remark


def test_what_was_counted_by_cell_takes_the_place_of_strokes() -> None:
    fit, summary = cut_fit(), cut_recording()
    counted = (
        Cell("cut", "closing at 0.6 rad/s", 4, 4, 4),
        Cell("cut", "closing at 0.6 rad/s", 8, 8, 3, "ranges of opening", "4.2 s recorded"),
    )
    evidence = Evidence(recordings=(summary,), completeness=counted)
    cells = cells_of([(fit, strokes_of(fit, "cut", [summary]))], evidence)
    assert cells == counted
    decision, every = data_panels(cells)
    assert [row.name for row in decision.rows] == ["cut strokes", "cut ranges of opening"]
    assert "cut, closing at 0.6 rad/s: 3 of 8 ranges of opening used" in decision.sentence
    assert [row.marked for row in every.rows] == [False, True]


def test_missing_excitation_makes_the_data_incomplete() -> None:
    row = Cell("friction", "excitation", 12, 3, None, "s of excitation", "3.4 s recorded")
    decision, every = data_panels([row])
    assert decision.sentence == (
        "Incomplete: friction, excitation: 3 of 12 s of excitation recorded."
    )
    assert every.rows[0].marked


def test_failed_checks_and_unused_data_are_weaknesses() -> None:
    wrong = Verdict("fit.friction", "whiteness", "fail", 1.0, 0.5, "Made to fail.")
    slow = Cell("friction", "closing at 0.05 rad/s", 2, 2, 0)
    panel = weaknesses_panel([], None, [wrong], [slow])
    assert panel.sentence == ""
    assert panel.notes == (
        "Failed checks: fit.friction whiteness.",
        "Not used: friction, closing at 0.05 rad/s: 0 of 2 strokes used.",
    )
    good = weaknesses_panel([], None, [replace(wrong, status="pass")], [replace(slow, used=2)])
    assert good.notes == ()
    assert good.sentence.startswith("No check failed, ")


def test_what_no_device_states_is_not_called_simulated() -> None:
    summary = cut_recording()
    simulated = replace(summary, device={"capabilities": 0x8003})
    every = origin_panel("simulated", [simulated]).sentence
    assert every.startswith("All recordings that state their device come from a virtual rig")
    assert "do not state it" not in every
    some = origin_panel("simulated", [simulated, summary]).sentence
    assert "1 of 2 recordings do not state it." in some


def test_photographs_that_passed_claim_no_trust_check() -> None:
    passed = Verdict("fit.blade", "halves", "pass", 0.4, 0.01, "They agree.")
    headline = geometry_headline("blade", [passed])
    assert "verified" not in headline.sentence
    assert "no verification" in headline.sentence
    alone = trust_panel([headline], [])
    assert alone.title == "Checks passed"
    assert alone.rows[0].values[0].text == "✓ checks passed"
    both = trust_panel([headline, headline_of(good(friction_fit()))], ["friction"])
    assert both.title == "Not verified"
    assert [row.values[0].text for row in both.rows] == ["✓ checks passed", "? not verified"]


def test_a_simulator_is_named_by_what_its_device_states() -> None:
    summary = cut_recording()
    simulated = replace(summary, device={"capabilities": 0x8003})
    real = replace(summary, device={"capabilities": 0x0003})
    assert origin_of([simulated]) == "simulated"
    assert origin_of([real, real]) == "real"
    assert origin_of([simulated, real]) == "mixed"
    assert origin_of([summary]) == "unknown"


def test_a_panel_in_the_terminal_has_its_numbers_units_and_limits() -> None:
    rows = (
        Row("a", (Value("mean", 0.0213, "N m", sd=0.0002), Value("used", 3))),
        Row("b", (Value("mean", 1.5, "rad/s"),)),
    )
    verdict = Verdict("fit.cut", "hold-out", "fail", 0.31, 0.2, "New strokes differ.", "at most")
    text = panel_text(Panel("p", "cut", "Rows", "Two.", rows, verdicts=(verdict,)))
    assert columns(rows) == (("mean", ""), ("used", ""))
    assert "0.02130 ± 0.00020 N m" in text
    assert "1.50 rad/s" in text
    assert "FAIL  fit.cut hold-out  0.31, at most 0.2  New strokes differ." in text


def test_sources_whose_recording_is_missing_are_named_all_the_same() -> None:
    fits = {"cut": cut_fit(), "friction": friction_fit()}
    origin = trace(paper(), fits, Evidence((friction_recording(),)))
    assert [row.used_by for row in origin.sources] == [("friction",), ("cut",)]
    assert origin.sources[1].content_hash


def _summary(source: str, digest: str, strokes: tuple[Stroke, ...]) -> Recording:
    return replace(cut_recording(), source=source, content_hash=digest, strokes=strokes)


def test_the_terminal_keeps_to_a_width_and_writes_the_note_of_a_row() -> None:
    names = [f"a quantity with a long name, {place}" for place in range(9)]
    wide = Row("a", tuple(Value(name, 1.5, "N m") for name in names))
    text = panel_text(Panel("p", "cut", "Rows", rows=(wide, Row("b", note="Failed: no result."))))
    title, head, first, second, rest = text.splitlines()
    assert max(map(len, (head, first))) <= LARGEST_WIDTH
    assert head.split("  ")[-1] == f"{names[2]} [N m]"
    assert "Failed: no result." in second
    assert rest.strip() == "... and 6 more columns"
    assert title == "Rows"
