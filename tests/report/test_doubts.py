"""What the report says against a fit: critic, replay, prior, verification, correlations."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from scissorcal.calibration import (
    FORMAT,
    Calibration,
    Coverage,
    FitResult,
    Halves,
    HalvesRow,
    Proposal,
    RankBand,
    RankedQuantity,
    ReplayComparison,
    ReplayRow,
    Sensitivity,
    SensitivityRow,
    VerifyResult,
)
from scissorcal.report import Evidence, build_report
from scissorcal.report.subjects.posterior import correlate, prior_panel
from scissorcal.verdicts import Verdict
from tests.report.conftest import CREATED, Built, built, paper
from tests.report.fits import FRICTION_SOURCE, friction_fit, friction_recording
from tests.report.pages import panel_of, values_of

COMMANDS = ("scissorcal fit friction --force", "scissorcal verify friction")


def doubted() -> FitResult:
    """A friction fit with all that may be said against one."""
    fit = friction_fit()
    rng = np.random.default_rng(4)
    proposal = Proposal(
        "load",
        "|load| sgn(rate)",
        0.12,
        0.02,
        "1",
        0.0031,
        0.93,
        0.18,
        41.0,
        'terms = ["load"]',
        "It bends.",
    )
    rows = tuple(
        ReplayRow(stroke, FRICTION_SOURCE, "speed", 0.3, 0.9, 0.02, replay, model, float("nan"))
        for stroke, replay, model in ((4, 0.004, 0.001), (8, 0.001, 0.002))
    )
    table = np.linspace(0.0, 1.0, 5)
    replay = ReplayComparison(
        2, FRICTION_SOURCE, "closing", 0.12, table, table, rows, "The law is better on 1 of 2."
    )
    prior = fit.map_point * np.exp(rng.normal(size=(300, len(fit.parameters))))
    bent = 3e-4 * np.sign(fit.series.opening_rate) * fit.series.time_s
    return replace(fit, critic=(proposal,), proposed=bent, replay=replay, prior_draws=prior)


def checked(fit: FitResult, ranks: tuple[int, ...]) -> VerifyResult:
    """A verification of one quantity with these ranks of 100."""
    z = tuple(np.linspace(0.05, 0.95, 19).tolist())
    band = RankBand(0.05, z, tuple(v - 0.1 for v in z), tuple(v + 0.1 for v in z))
    cover = Coverage(0.9, float(np.mean([5 <= r < 95 for r in ranks])), 0.84, 0.96)
    quantity = RankedQuantity(
        "coulomb", "N m", ranks, (0.02,) * len(ranks), 0.4, None, 1.0, 0.0, (cover,)
    )
    return VerifyResult(
        FORMAT,
        "friction",
        fit.inputs_hash,
        fit.candidate,
        fit.effort,
        0,
        Calibration(
            fits=len(ranks),
            levels=100,
            prior="local",
            spread=3.0,
            generating="around it",
            noise="AR(1)",
            quantities=(quantity,),
            band=band,
            escalated=0.1,
            unreliable=0.0,
            broken=(),
            effective=500.0,
            seconds=1.0,
        ),
        Halves(
            "every second stroke",
            (0, 2),
            (1, 3),
            (HalvesRow("coulomb", "N m", 0.02, 0.03, 0.001, 7.1),),
            9.0,
            1,
            50.0,
            1e-6,
            0.3,
            0.02,
            1e-5,
        ),
        Sensitivity(0.05, (SensitivityRow("coulomb", 0.2, 0.3, "prior-data conflict"),)),
        (),
        0.01,
        (Verdict("verify.friction", "halves", "fail", 1e-6, 0.05, "The halves disagree."),),
    )


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Built:
    fit = doubted()
    narrow = tuple(np.random.default_rng(1).integers(0, 2, 100).tolist())
    return built(
        tmp_path_factory.mktemp("doubted"),
        [fit],
        [friction_recording()],
        checks={"friction": checked(fit, narrow)},
    )


def test_what_is_missing_names_the_command(whole: Built) -> None:
    for command in COMMANDS:
        assert command in whole.page.text


def test_a_proposal_shows_how_often_and_how_much(report: Built) -> None:
    for words in ("|load| sgn(rate)", "0.120 ± 0.020", 'terms = ["load"]'):
        assert words in report.page.text
    row = values_of(panel_of(report.twin, "friction-critic"))["|load| sgn(rate)"]
    found = row["found without a quarter of the strokes"]
    size, falls = row["torque, twice the rms"], row["hold-out error falls by"]
    assert (found["number"], found["unit"], falls["number"]) == (pytest.approx(93), "%", 18)
    assert (size["number"], size["unit"]) == (0.0031, "N m")


def test_what_is_proposed_is_drawn_among_the_residuals(report: Built) -> None:
    charts = {one["id"]: one for one in panel_of(report.twin, "friction-residuals")["charts"]}
    for over in ("spread", "spread-rate", "spread-time"):
        lines = [one for one in charts[f"friction-{over}"]["series"] if one["kind"] == "line"]
        assert [one["name"] for one in lines] == ["load, closing", "load, opening"]
    closing, opening = lines
    assert np.all(np.diff(opening["y"]) > 0.0)
    assert np.all(np.diff(closing["y"]) < 0.0)


def test_a_replay_is_tied_to_its_strokes(report: Built) -> None:
    panel = panel_of(report.twin, "friction-replay")
    assert [row["link"] for row in panel["rows"]] == ["friction-r0-s4", "friction-r0-s8"]
    first, second = values_of(panel).values()
    assert first["model of that one stroke"].get("number") is None
    assert [row.get("marked", False) for row in panel["rows"]] == [False, True]
    assert second["replay"]["number"] == 0.001
    assert "The law is better on 1 of 2." in report.page.text


def test_ranks_outside_the_band_are_named(report: Built) -> None:
    text = report.page.text
    assert "Intervals do not hold the truth as often as they claim for coulomb" in text
    assert "Outside: coulomb" in text
    assert "The prior matters for coulomb" in text
    assert "differs by 30 % rms" in text


def test_even_ranks_stay_inside(tmp_path: Path) -> None:
    fit = doubted()
    even = checked(fit, tuple(range(100)))
    files = build_report(
        paper(),
        [fit],
        Evidence((friction_recording(),), {"friction": even}),
        tmp_path,
        created=CREATED,
    )
    page = files.html.read_text(encoding="utf-8")
    assert "Intervals hold the truth as often as they claim" in page
    assert "None leaves it." in page


def test_a_failed_trust_check_rejects_the_fit(report: Built) -> None:
    trust = panel_of(report.twin, "decision-trust")
    assert trust["title"] == "Do not use"
    row = values_of(trust)["friction"]
    assert (row["decision"]["text"], row["why"]["text"]) == ("✗ do not use", "halves failed")
    assert panel_of(report.twin, "verdicts-all")["sentence"].startswith("1 failed")


def test_the_decision_page_has_the_coverage_that_the_trust_check_found(report: Built) -> None:
    said = values_of(panel_of(report.twin, "decision-checked"))["friction"]["trust check"]["text"]
    assert said.startswith("failed: halves; 90 % intervals held the truth in 0")
    (row,) = report.twin["provenance"]["trust_checks"]
    assert (row["fit"], row["fit_hash"]) == ("friction", friction_fit().inputs_hash)


def test_a_trust_check_of_another_fit_is_not_shown(tmp_path: Path) -> None:
    fit = doubted()
    other = replace(checked(fit, (1, 2, 3)), fit_hash="0" * 64)
    files = build_report(
        paper(),
        [fit],
        Evidence((friction_recording(),), {"friction": other}),
        tmp_path,
        created=CREATED,
    )
    page = files.html.read_text(encoding="utf-8")
    assert "The halves disagree." not in page
    assert "scissorcal verify friction" in page


def test_correlations_and_priors_are_those_of_the_draws() -> None:
    fit = doubted()
    rng = np.random.default_rng(8)
    draws = fit.draws.copy()
    draws[:, 3] = 2.0 * draws[:, 2] + 1e-9 * rng.normal(size=len(draws))
    top, *_ = correlate(replace(fit, draws=draws))
    assert {top.first, top.second} == {"coulomb", "viscous"}
    assert top.value == pytest.approx(1.0, abs=1e-3)
    rows = prior_panel(fit, "friction").rows
    assert [row.name for row in rows] == [parameter.name for parameter in fit.parameters]
    median = rows[2].value("prior median")
    assert median is not None
    assert fit.prior_draws is not None
    assert median.number == pytest.approx(float(np.median(fit.prior_draws[:, 2])), rel=1e-4)
    assert prior_panel(replace(fit, prior_draws=None), "friction").rows == ()


def test_a_report_that_says_the_same_keeps_its_time(tmp_path: Path) -> None:
    fit = doubted()
    first = build_report(paper(), [fit], Evidence(), tmp_path, created=CREATED)
    before = first.json.read_bytes()
    later = CREATED.replace(year=CREATED.year + 1)
    build_report(paper(), [fit], Evidence(), tmp_path, created=later)
    assert first.json.read_bytes() == before
    build_report(paper(), [replace(fit, notes=("New.",))], Evidence(), tmp_path, created=later)
    assert b"2026-01-31" in first.json.read_bytes()
