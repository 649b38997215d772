"""Two runs side by side: what differs is marked, what cannot be compared is refused."""

from dataclasses import replace
from datetime import UTC, datetime

import pytest

from scissorcal.errors import InputError
from scissorcal.recipe import Recipe
from scissorcal.report import Side, compare, document_of, document_of_fit
from scissorcal.report.comparison import Comparison
from scissorcal.report.panel import Panel
from scissorcal.report.text import panel_text
from tests.calibration.truth import Truth
from tests.report.conftest import paper
from tests.report.laws import known_cut, known_friction


def recipe() -> Recipe:
    """The paper recipe, without friction in what is rendered."""
    plain = paper()
    scene = plain.scene.model_copy(update={"render_friction": False})
    return plain.model_copy(update={"scene": scene})


def side(name: str, toughness: float = 0.5) -> Side:
    fits = [known_friction(Truth()), known_cut(Truth(fracture_energy=toughness))]
    return Side(name, document_of(recipe(), fits))


def compared(first: Side, second: Side) -> Comparison:
    return compare(first, second, created=datetime(2025, 2, 1, tzinfo=UTC), version="0")


def panel(found: Comparison, name: str) -> Panel:
    return next(panel for panel in found.panels if panel.id == name)


def test_a_run_does_not_differ_from_itself() -> None:
    found = compared(side("a"), side("b"))
    assert found.sentence.startswith("No parameter differs by more than 3 standard deviations.")
    assert "differs by at most 0 N m" in found.sentence
    assert not any(row.marked for panel in found.panels for row in panel.rows)


def test_another_toughness_is_marked_in_sd_and_felt_over_the_scene() -> None:
    found = compared(side("a", 0.50), side("b", 0.60))
    rows = {row.name: row for row in panel(found, "cut-parameters").rows}
    assert [name for name, row in rows.items() if row.marked] == ["fracture_energy"]
    in_sd = rows["fracture_energy"].value("in sd")
    assert in_sd is not None
    assert in_sd.number == pytest.approx(0.1 / (0.005**2 + 0.006**2) ** 0.5, rel=0.01)
    assert "fracture_energy differ by more than 3 standard deviations." in found.sentence
    largest = panel(found, "torque").row("largest difference")
    assert largest is not None
    difference = largest.value("B − A")
    assert difference is not None
    assert abs(difference.number or 0.0) > 0.001
    assert "by more than the tolerance of 7.0 % at" in found.sentence
    assert "fracture_energy" in panel_text(panel(found, "cut-parameters"))


def test_runs_of_another_material_law_or_kind_are_refused() -> None:
    one = side("a")
    assert one.document.scene is not None
    tin = replace(one.document, material="tin")
    with pytest.raises(InputError, match="the material differs"):
        compared(one, Side("b", tin))
    with pytest.raises(InputError, match="no fit of the same kind"):
        compared(
            Side("a", document_of_fit(known_cut(Truth()), None)),
            Side("b", document_of_fit(known_friction(Truth()), None)),
        )
    other = replace(known_cut(Truth()), candidate="exponential, smooth")
    with pytest.raises(InputError, match="have other laws"):
        compared(one, Side("b", document_of_fit(other, None)))


def test_a_fit_alone_has_parameters_and_no_torque_to_compare() -> None:
    alone = Side("cut.nc", document_of_fit(known_cut(Truth()), None))
    found = compared(alone, alone)
    assert "is a fit alone" in panel(found, "torque").notes[0]
    assert panel(found, "cut-parameters").sentence == (
        "No parameter has changed by more than 3 standard deviations."
    )
