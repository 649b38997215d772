"""Building a report: refusals, bytes, what is kept when it fails, and hostile words."""

import hashlib
import json
import os
import re
from dataclasses import replace
from datetime import datetime
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from scissorcal.calibration import FitSeries, FittedParameter
from scissorcal.errors import InputError, MissingError
from scissorcal.package import REPORT_PAGE, REPORT_TWIN, Review
from scissorcal.recipe import schemas_dir
from scissorcal.report import Fact, FactSheet, build_report, sign_page
from scissorcal.report.signature_block import unsigned_digest
from scissorcal.report.twin import schema_text
from scissorcal.verdicts import Verdict
from tests.report.conftest import CREATED, Built, built, paper
from tests.report.fits import cut_fit, linear_fit, linear_recording
from tests.report.pages import panel_of, values_of

HOSTILE = '<script>alert("x")</script>'


def validator() -> jsonschema.Draft202012Validator:
    schema = json.loads((schemas_dir() / "report.schema.json").read_text(encoding="utf-8"))
    return jsonschema.Draft202012Validator(schema)


@pytest.mark.parametrize("name", ["whole", "linear", "lost"])
def test_the_twin_follows_its_schema(name: str, request: pytest.FixtureRequest) -> None:
    validator().validate(request.getfixturevalue(name).twin)


def test_the_schema_refuses_what_is_no_twin(linear: Built) -> None:
    twin = linear.twin
    assert not validator().is_valid({**twin, "more": 1})
    assert not validator().is_valid({key: twin[key] for key in twin if key != "panels"})
    assert not validator().is_valid({**twin, "format": "scissorcal-report/1"})


def test_the_schema_on_disk_is_the_one_of_the_code() -> None:
    assert (schemas_dir() / "report.schema.json").read_text(encoding="utf-8") == schema_text()


def test_the_twin_holds_the_facts_of_the_fits(whole: Built) -> None:
    fit = cut_fit()
    told = values_of(panel_of(whole.twin, "cut-parameters"))
    assert list(told) == [p.name for p in fit.parameters]
    for parameter in fit.parameters:
        mean, median = told[parameter.name]["mean"], told[parameter.name]["median, 90 %"]
        assert (mean["number"], mean["sd"], mean["unit"]) == (
            parameter.mean,
            parameter.sd,
            parameter.unit,
        )
        assert (median["low"], median["number"], median["high"]) == (
            parameter.q05,
            parameter.q50,
            parameter.q95,
        )
    assert len(panel_of(whole.twin, "cut-heldout")["rows"]) == len(fit.held_out)
    residual = fit.series.measured - fit.series.predicted
    for name, values in values_of(panel_of(whole.twin, "cut-residuals")).items():
        stroke = int(name.removeprefix("stroke ").partition(",")[0])
        here = residual[fit.series.stroke == stroke]
        assert values["rms"]["number"] == pytest.approx(float(np.sqrt(np.mean(here**2))))
        assert values["samples"]["number"] == len(here)
    assert whole.twin["created"] == "2025-01-31T15:02:00Z"


def test_the_same_input_gives_the_same_bytes(linear: Built, tmp_path: Path) -> None:
    again = built(tmp_path, [linear_fit()], [linear_recording()])
    for name in ("report.html", "report.json"):
        assert (again.folder / name).read_bytes() == (linear.folder / name).read_bytes()


def test_without_a_fit_it_says_what_to_run(tmp_path: Path) -> None:
    with pytest.raises(MissingError, match="Run scissorcal fit"):
        build_report(paper(), [], [], tmp_path, created=CREATED)
    assert list(tmp_path.iterdir()) == []


def test_a_time_without_a_zone_is_refused(tmp_path: Path) -> None:
    naive = datetime(2025, 1, 31)
    with pytest.raises(ValueError, match="time zone"):
        build_report(paper(), [linear_fit()], [], tmp_path, created=naive)


def test_a_place_that_cannot_be_written_is_named_and_old_files_stay(tmp_path: Path) -> None:
    taken = tmp_path / "report"
    taken.write_text("a file of mine")
    with pytest.raises(InputError, match="cannot be written") as refused:
        build_report(paper(), [linear_fit()], [], taken, created=CREATED)
    assert str(taken) in str(refused.value)
    assert taken.read_text() == "a file of mine"


def test_a_failure_half_way_leaves_the_old_report_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    old = tmp_path / "report.html"
    old.write_text("the old page")
    monkeypatch.setattr("scissorcal.files.os.urandom", bytes)
    host = re.sub(r"[^A-Za-z0-9_-]", "-", os.uname().nodename)[:40]
    in_the_way = tmp_path / f"report.json.{host}.{os.getpid()}.00000000.part"
    in_the_way.mkdir()
    with pytest.raises(InputError):
        build_report(paper(), [linear_fit()], [], tmp_path, created=CREATED)
    assert old.read_text() == "the old page"


def test_words_from_outside_never_become_markup(tmp_path: Path) -> None:
    fit = replace(
        linear_fit(),
        candidate=HOSTILE,
        parameters=tuple(_hostile(p) for p in linear_fit().parameters),
        candidates=({"name": HOSTILE, "bic": 1.0, "held_out_rms": 1.0, "chosen": True},),
        verdicts=(Verdict(HOSTILE, HOSTILE, "fail", 1.0, 2.0, f"`{HOSTILE}` {HOSTILE} $x$ `"),),
        diagnostics={HOSTILE: HOSTILE},
        notes=(f"`{HOSTILE}`",),
        sources=(HOSTILE,),
    )
    recipe = paper()
    material = recipe.material.model_copy(update={"name": HOSTILE})
    recipe = recipe.model_copy(update={"material": material, "description": HOSTILE})
    sheet = FactSheet(HOSTILE, HOSTILE, (Fact(HOSTILE, HOSTILE, HOSTILE),), notes=(HOSTILE,))
    files = build_report(
        recipe, [fit], [], tmp_path, created=CREATED, recipe_text=HOSTILE, sheets=[sheet]
    )
    page = files.html.read_text(encoding="utf-8")
    assert page.count("<script") == 1  # the page's own
    assert page.count("&lt;script&gt;") > 15


@pytest.mark.parametrize("unit", ["$N$ <m>", "µN²"])
def test_odd_units_reach_the_figures_as_text(unit: str, tmp_path: Path) -> None:
    report = built(tmp_path, [replace(linear_fit(), effort_unit=unit)], [])
    assert f"torque [{unit}]" in report.page.text


def test_a_fit_without_samples_is_still_reported(tmp_path: Path) -> None:
    none, whole = np.zeros(0), np.zeros(0, np.int64)
    series = FitSeries(none, whole, whole, none, none, none, none, none, none, none)
    fit = replace(cut_fit(), series=series, held_out=(), candidates=(), parameters=(), verdicts=())
    report = built(tmp_path, [fit], [])
    assert "holds no samples" in report.page.text
    decision = values_of(panel_of(report.twin, "decision-trust"))["cut"]["decision"]
    assert decision["text"] == "! use with care"


def test_two_fits_of_a_kind_have_addresses_of_their_own(tmp_path: Path) -> None:
    report = built(tmp_path, [linear_fit(), linear_fit(seed=4)], [])
    parts = [fit["part"] for fit in report.twin["provenance"]["fits"]]
    assert parts == ["friction", "friction-2"]
    assert len(set(report.page.ids)) == len(report.page.ids)


def test_a_signature_shows_on_the_page_and_leaves_the_twin_as_it_was(tmp_path: Path) -> None:
    plain = built(tmp_path, [linear_fit()], [])
    assert "Not signed" in plain.page.text
    before = (tmp_path / "report.json").read_bytes()
    review = review_of((tmp_path / "report.html").read_text(encoding="utf-8"), before)
    sign_page(tmp_path / "report.html", review)
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "Signed by <strong>A. &lt;b&gt; Lovelace</strong> on" in page
    assert "2025-02-01" in page
    assert "Not signed" not in page
    assert (tmp_path / "report.json").read_bytes() == before
    again = built(tmp_path, [linear_fit()], [], review=review)
    assert again.page.source == page
    (tmp_path / "signature.json").write_text(review.model_dump_json(), encoding="utf-8")
    assert built(tmp_path, [linear_fit()], []).page.source == page


def test_a_signature_of_another_report_is_not_shown(tmp_path: Path) -> None:
    other = review_of("another page", b"another report")
    assert "Not signed" in built(tmp_path, [linear_fit()], [], review=other).page.text
    (tmp_path / "report.html").write_text("no page", encoding="utf-8")
    with pytest.raises(InputError, match="cannot take the signature"):
        sign_page(tmp_path / "report.html", other)


def review_of(page: str, twin: bytes) -> Review:
    """An accepted review of a page and its twin, by someone whose name holds markup."""
    return Review.of(
        name="A. <b> Lovelace",
        decision="accept",
        note="",
        time_utc="2025-02-01T08:00:00Z",
        content={
            REPORT_PAGE: unsigned_digest(page),
            REPORT_TWIN: hashlib.sha256(twin).hexdigest(),
        },
        fit_hashes={"friction": "1f"},
    )


def _hostile(parameter: FittedParameter) -> FittedParameter:
    return replace(parameter, unit=HOSTILE, meaning=HOSTILE)
