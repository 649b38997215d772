"""The page stands alone, can be navigated, and says what the fits say."""

import re
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2

from scissorcal.report.subjects.overview import budget_chart, not_in_band_sentence
from tests.report.conftest import Built
from tests.report.fits import cut_fit, friction_fit
from tests.report.pages import panel_of, values_of

FETCHING = ("src", "srcset", "poster", "data", "action", "background", "xlink:href")


@pytest.fixture(params=["whole", "linear", "lost"])
def any_report(request: pytest.FixtureRequest) -> Built:
    report = request.getfixturevalue(request.param)
    assert isinstance(report, Built)
    return report


def test_nothing_is_fetched_from_outside(any_report: Built) -> None:
    page = any_report.page
    assert len(page.all("script")) == 1
    assert page.all("script") == [{}]
    assert not page.all("link")
    for attribute in FETCHING:
        assert not page.values(attribute)
    assert all(target.startswith("#") for target in page.values("href"))
    reached = re.findall(r"url\(\s*['\"]?([^)'\"]+)", page.source)
    assert reached
    assert all(target.startswith("#") for target in reached)
    assert "@import" not in page.source
    assert not re.search(r"https?://", page.source)
    (policy,) = page.all("meta", **{"http-equiv": "Content-Security-Policy"})
    assert policy["content"].startswith("default-src 'none'")
    assert "script-src 'sha256-" in policy["content"]


def test_the_page_is_well_formed_and_small(any_report: Built) -> None:
    assert any_report.page.unbalanced == []
    size = len(any_report.page.source.encode())
    assert 20_000 < size < 5_000_000


def test_every_link_leads_somewhere_and_ids_are_unique(any_report: Built) -> None:
    page = any_report.page
    assert len(set(page.ids)) == len(page.ids)
    wanted = {target.removeprefix("#") for target in page.values("href")}
    wanted |= set(re.findall(r"url\(#([^)]+)\)", page.source))
    wanted |= {name for names in page.values("aria-labelledby") for name in names.split()}
    assert wanted <= set(page.ids)


def test_every_figure_says_in_words_what_it_shows(whole: Built) -> None:
    figures = whole.page.all("svg")
    assert len(figures) > 30
    for figure in figures:
        assert figure["role"] in {"img", "group"}
        assert len(figure["aria-label"]) > 40
        assert "viewbox" in figure
        assert "width" not in figure
    assert len({figure["aria-label"] for figure in figures}) == len(figures)


def test_figures_take_the_colours_of_the_page(whole: Built) -> None:
    drawn = whole.page.source.partition("</style>")[2]
    assert not re.search(r"#[0-9a-f]{6}\b", drawn)
    used = set(re.findall(r"var\(--([a-z]+)\)", whole.page.source))
    assert {"ink", "blue", "vermillion"} <= used
    style = whole.page.source.partition("</style>")[0]
    root, dark = style.split("@media (prefers-color-scheme: dark)")
    for name in used:
        assert f"--{name}:" in root
    for name in ("ink", "paper", "muted", "grid", "link", "pass", "fail", "open"):
        assert f"--{name}:" in dark


def test_the_palette_is_legible_by_day_and_by_night(whole: Built) -> None:
    style = whole.page.source.partition("</style>")[0]
    day, night = style.split("@media (prefers-color-scheme: dark)")
    for part in (day, night.split("}")[0]):
        colours = dict(re.findall(r"--([a-z]+): (#[0-9a-f]{6})", part))
        for text in ("ink", "muted", "link", "pass", "fail", "open"):
            assert _contrast(colours[text], colours["paper"]) >= 4.5, text
            assert _contrast(colours[text], colours["raised"]) >= 4.5, text
        for mark in ("blue", "vermillion", "green"):
            assert _contrast(colours[mark], colours["paper"]) >= 3.0, mark


def test_verdicts_stand_on_top_and_failures_first(whole: Built) -> None:
    ids = whole.page.ids
    assert ids.index("decision") < ids.index("verdicts") < ids.index("friction") < ids.index("cut")
    badges = [
        attributes["class"].removeprefix("badge ")
        for attributes in whole.page.all("span")
        if attributes.get("class", "").startswith("badge ")
    ]
    decided, listed = badges[:2], badges[2:10]
    assert decided == ["not_evaluated", "fail"]  # friction asks for care, the cut is rejected
    assert listed == ["fail", "not_evaluated"] + ["pass"] * 6
    for verdict in (*friction_fit().verdicts, *cut_fit().verdicts):
        assert verdict.why in whole.page.text


def test_residuals_lead_to_their_strokes_from_the_worst(whole: Built) -> None:
    panel = panel_of(whole.twin, "friction-residuals")
    rows = list(values_of(panel).values())
    sizes = np.array([row["rms"]["number"] for row in rows])
    samples = np.array([row["samples"]["number"] for row in rows])
    # the worst is the one of the largest error that is shown beyond chance, which here is not the
    # largest: n rms^2 over the variance is chi-squared, and all strokes together err in one of 20
    shown = sizes * np.sqrt(samples / chi2.ppf(1.0 - 0.05 / len(rows), samples))
    assert np.all(np.diff(shown) < 0.0)
    assert sizes[0] < sizes.max()
    assert next(iter(values_of(panel))) in panel["sentence"]
    links = whole.page.values("href")
    for place, row in enumerate(panel["rows"][:20]):
        address = row.get("link") or row["anchor"]
        found = links.count(f"#{address}")  # from its bar, and from the table to its chart
        assert found >= (2 if place < 12 else 1)
    bars = [link for link in links if link.startswith("#friction-r")]
    assert bars[0] == f"#{panel['rows'][0]['link']}"


def test_it_is_read_without_a_script_and_detail_opens_on_demand(whole: Built) -> None:
    page = whole.page
    parts = page.all("details", **{"class": "part"})
    assert len(parts) >= 7
    assert not any("open" in part for part in parts)
    assert len(page.all("summary")) == len(page.all("details"))
    (tools,) = page.all("p", **{"class": "tools"})
    assert "hidden" in tools  # the script shows the search
    assert not page.all("button", **{"class": "key"})


def test_strokes_can_be_switched_and_values_read(whole: Built) -> None:
    source = whole.page.source
    entries = whole.page.all("li")
    switched = {entry["data-group"] for entry in entries if "data-group" in entry}
    assert {"friction-r0-s0", "cut-r0-s11"} <= switched
    groups = {g["data-group"] for g in whole.page.all("g") if "data-group" in g}
    assert switched <= groups
    for figure in whole.page.all("svg"):
        for name in ("data-x", "data-y"):
            low, high, start, end, kind = figure[name].split(" ")
            assert float(low) < float(high)
            assert float(start) != float(end)
            assert kind in {"lin", "log"}
    assert 'addEventListener("pointermove"' in source
    assert 'addEventListener("keydown"' in source


def test_the_decision_page_answers_in_order(whole: Built) -> None:
    charts = ("-clip", "-torque", "-friction", "-budget")
    ids = [n for n in whole.page.ids if n.startswith("decision") and not n.endswith(charts)]
    assert ids == [
        "decision",
        "decision-origin",
        "decision-trust",
        "decision-picture",
        "decision-data",
        "decision-checked",
        "decision-felt",
        "decision-weaknesses",
        "decision-signature",
    ]
    for words in ("Do not use", "Not signed", "Felt error", "Known weaknesses of this fit"):
        assert words in whole.page.text


def test_limits_state_their_direction(whole: Built) -> None:
    assert "at most 0.7" in whole.page.text
    assert "at least 0.01" in whole.page.text


def test_scrolling_parts_can_be_reached_by_keyboard(whole: Built) -> None:
    regions = [
        attributes
        for attributes in whole.page.all("div")
        if attributes.get("class", "").startswith("scroll")
    ]
    assert len(regions) > 10
    for region in (*regions, *whole.page.all("pre")):
        assert region["tabindex"] == "0"
        assert region["aria-label"]
    first = next(attributes for tag, attributes in whole.page.elements if tag == "a")
    assert first["class"] == "skip"


def test_numbers_carry_the_digits_that_they_are_worth(whole: Built) -> None:
    text = whole.page.text
    assert "3.412 × 10⁻⁴ ± 4.1 × 10⁻⁶" in text  # inertia: mean, sd
    assert "0.02103 ± 0.00019" in text  # coulomb: mean, sd
    assert "0.02103 (0.02072 to 0.02134)" in text  # coulomb: median and 90 % interval
    assert "kg m²" in text
    assert "kg m^2" not in text


def test_a_sliding_joint_has_newtons_metres_and_kilograms(linear: Built) -> None:
    text = linear.page.text
    labels = " ".join(figure["aria-label"] for figure in linear.page.all("svg"))
    for unit in ("N m", "rad", "torque", "Torque", "kg m"):
        body = text.partition("Recipe, ")[0]  # the recipe's own keys name radians
        assert not re.search(rf"\b{unit}\b", body), unit
        assert not re.search(rf"\b{unit}\b", labels), unit
    assert "95.11" in text
    assert "force [N]" in text
    assert "position [m]" in text


def test_what_is_not_finite_is_said_to_be_not_available(lost: Built) -> None:
    assert "not available" in lost.page.text
    assert not re.search(r"\b(nan|NaN|inf|Infinity|None)\b", lost.page.text)
    assert values_of(panel_of(lost.twin, "friction-parameters"))["inertia"]["mean"].keys() == {
        "name",
        "unit",
        "digits",
    }


def test_the_recipe_and_the_hashes_are_there(whole: Built, linear: Built) -> None:
    assert "offset_mm = -8.0" in whole.page.source
    for row in whole.twin["provenance"]["sources"]:
        assert row["content_hash"] in whole.page.text
        assert row["used_by"] in (["friction"], ["cut"])
    assert "as read, in JSON" in linear.page.text


def _contrast(one: str, other: str) -> float:
    """Contrast ratio of two colours, as WCAG 2 defines it."""
    light, dark = sorted((_luminance(one), _luminance(other)), reverse=True)
    return (light + 0.05) / (dark + 0.05)


def _luminance(colour: str) -> float:
    channels = [int(colour[place : place + 2], 16) / 255 for place in (1, 3, 5)]
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in channels]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def test_the_first_page_shows_measured_and_modelled(whole: Built) -> None:
    picture = next(p for p in whole.twin["panels"] if p["id"] == "decision-picture")
    charts = {chart["id"]: chart for chart in picture["charts"]}
    assert list(charts) == ["decision-picture-torque", "decision-picture-friction"]
    kinds = {series["kind"] for series in charts["decision-picture-torque"]["series"]}
    assert kinds == {"points", "band", "line"}
    weak = next(p for p in whole.twin["panels"] if p["id"] == "decision-weaknesses")
    assert not any("up to" in note for note in weak.get("notes", ())), "the felt error says it"


def test_printing_opens_few_panels_and_no_long_table(whole: Built) -> None:
    printed = [one["id"] for one in whole.page.all("details") if "data-print" in one]
    assert any(name.endswith("-torque") for name in printed)
    assert not any(name.endswith(("-residuals", "-heldout", "-grid", "-pairs")) for name in printed)


def test_the_error_is_one_bar_of_what_is_in_the_band_and_what_is_not() -> None:
    share = np.array([0.01, 0.05, np.nan, 0.06])
    open_checks = (("delay", 0.35), ("tilt", None))
    torque: Any = SimpleNamespace(share=share, not_in_band=open_checks, tolerance=0.07)
    bar = budget_chart(torque, "budget")
    assert bar is not None
    ends = [(one.low[0], one.x[0]) for one in bar.series if one.kind == "bars"]
    assert ends == [(0.0, pytest.approx(5.0)), (pytest.approx(5.0), pytest.approx(40.0))]
    assert "tilt" in bar.caption
    assert not_in_band_sentence(torque) == (
        "Not measured, and so not in the band: delay (up to 35 %), tilt (no bound)."
    )
