"""What identifies the inputs of `bench trade`: every part of its case, by content."""

from dataclasses import fields, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from scissorcal.bench.trade.case import Case, Photographed
from scissorcal.calibration import RESIDUALS
from scissorcal.identity import file_digest
from scissorcal.model import Edge, EdgeDistribution
from scissorcal.vision import Camera
from scissorcal.workday import inputs_hash
from scissorcal.workday.runs import bench_case
from tests.bench.trade.cases import case
from tests.package.fits import recipe

CAMERA = Camera(1000.0, 1000.0, 599.5, 449.5, (0.0,) * 5, 1200, 900, np.eye(9))
LINE = Edge("line", offset_m=-0.008, taper_rad=0.03, length_m=0.07)
EDGE = EdgeDistribution(LINE, ("offset_m",), np.diag([1e-10]))


class Files(SimpleNamespace):
    """As much of an engine as tells files and what is in them."""

    def file(self, name: str) -> Path:
        path: Path = self.folder / name
        return path


@pytest.fixture
def engine(tmp_path: Path) -> Any:
    """Two fits and three photographs in a folder."""
    for name in ("fit friction", "fit cut", "one.png", "two.png", "plate.png"):
        (tmp_path / name).write_text(name, encoding="utf-8")
    return Files(folder=tmp_path, index=SimpleNamespace(digest=file_digest))


@pytest.fixture
def whole(engine: Any) -> Case:
    """A case that has everything."""
    return replace(
        case(),
        edge=EDGE,
        photographs=(Photographed((engine.file("one.png"), engine.file("two.png")), True),),
        plate=Photographed((engine.file("plate.png"),), True),
        camera=CAMERA,
    )


def other_values(whole: Case) -> dict[str, Any]:
    """Another value for each field of a case that is told by itself, not by a file."""
    recording = replace(whole.cut[0], content_hash="another")
    return {
        "recipe": recipe("press-only"),
        "friction": (recording,),
        "cut": (recording,),
        "edge": replace(EDGE, covariance=np.diag([2e-10])),
        "edge_verdicts": (RESIDUALS.judge(0.1, "Said."),),
        "friction_fit": None,
        "cut_fit": None,
        "effort": "thorough",
        "seed": 1,
        "simulated": False,
        "table_tolerance": 1e-3,
        "number_format": "int16",
        "photographs": (replace(whole.photographs[0], both=True),),
        "camera": replace(CAMERA, fx=1001.0),
        "plate": None,
    }


def test_every_part_of_a_case_counts(engine: Any, whole: Case) -> None:
    others = other_values(whole)
    assert {*others, "held"} == {one.name for one in fields(Case)}
    found = {name: inputs_hash(engine, replace(whole, **{name: v})) for name, v in others.items()}
    found["as it is"] = inputs_hash(engine, whole)
    assert len(set(found.values())) == len(found)
    assert inputs_hash(engine, replace(whole)) == found["as it is"]


@pytest.mark.parametrize("name", ["fit friction", "fit cut", "one.png", "two.png", "plate.png"])
def test_every_file_counts_by_its_content(engine: Any, whole: Case, name: str) -> None:
    before = inputs_hash(engine, whole)
    engine.file(name).write_text("another", encoding="utf-8")
    assert inputs_hash(engine, whole) != before


def test_photographs_count_wherever_they_stand(engine: Any, whole: Case) -> None:
    moved = engine.file("moved.png")
    moved.write_bytes(engine.file("plate.png").read_bytes())
    assert whole.plate is not None
    elsewhere = replace(whole, plate=replace(whole.plate, paths=(moved,)))
    assert inputs_hash(engine, elsewhere) == inputs_hash(engine, whole)


def test_the_computer_and_the_algorithm_count(
    engine: Any, whole: Case, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = inputs_hash(engine, whole)
    monkeypatch.setattr(bench_case, "machine", lambda: "another computer")
    elsewhere = inputs_hash(engine, whole)
    monkeypatch.setattr(bench_case, "ALGORITHM", bench_case.ALGORITHM + 1)
    assert len({before, elsewhere, inputs_hash(engine, whole)}) == 3
