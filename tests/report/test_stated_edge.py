"""The panel of an edge by points: what its picture says of who uses the curve."""

import re

import pytest

from scissorcal.recipe import parse_recipe
from scissorcal.report.subjects.stated_edge import stated_edge_panel
from tests.workday.made import RECIPE

POINTS = "[[0.0, -8.0], [25.0, -7.2], [50.0, -6.3], [75.0, -5.4]]"


@pytest.mark.parametrize(
    ("source", "said"),
    [
        ("recipe", "the curve that model, fits and package use."),
        ("photographs", "the curve that plans the captures; model, fits and package use the edge"),
    ],
)
def test_the_caption_says_who_uses_the_curve(source: str, said: str) -> None:
    edge = f'[rig.edge]\nsource = "{source}"\nfamily = "points"\npoints_mm = {POINTS}\n'
    text, count = re.subn(r"\[rig\.edge\].*?(?=\n\[)", edge, RECIPE, flags=re.DOTALL)
    assert count == 1
    panel = stated_edge_panel(parse_recipe(text))
    assert said in panel.charts[0].caption
    assert ("Photographs take its place" in panel.sentence) == (source == "photographs")
