"""A page that compares two sides goes to others: it names them without the folders of this disk."""

from pathlib import Path

import pytest

from scissorcal.workday.runs.report import shown_path


@pytest.mark.parametrize(
    ("path", "told"),
    [
        ("paper-a", "paper-a"),
        ("paper-a/report/report.json", "paper-a/report/report.json"),
        ("elsewhere/cut.nc", "cut.nc"),
    ],
)
def test_a_side_is_named_from_its_workspace_on(tmp_path: Path, path: str, told: str) -> None:
    for folder in ("paper-a/report", "elsewhere"):
        (tmp_path / folder).mkdir(parents=True)
    (tmp_path / "paper-a" / "recipe.toml").touch()
    if Path(path).suffix:
        (tmp_path / path).touch()
    assert shown_path(tmp_path / path) == told


def test_a_relative_name_stays_as_it_was_given() -> None:
    assert shown_path(Path("../other/report/report.json")) == "../other/report/report.json"
