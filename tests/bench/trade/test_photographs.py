"""Photographs as knobs: numbers and widths, failures, and errors of edge and pose."""

import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from scissorcal.bench.trade.case import Case, Photographed
from scissorcal.bench.trade.knobs.photographs import (
    EDGE,
    PLACE,
    TAPER,
    TURN,
    Photographs,
    Plate,
)
from scissorcal.bench.trade.pictures import factors_of, fit_edge, locate_plate
from scissorcal.bench.trade.point import Sample
from scissorcal.bench.trade.torque import WORST
from scissorcal.errors import InputError, MissingError
from scissorcal.vision import Camera, Photo, Pose, read_photo
from tests.bench.trade.cases import case
from tests.package.fits import recipe

SIZE = (1200, 900)
CAMERA = Camera(1000.0, 1000.0, 599.5, 449.5, (0.0,) * 5, *SIZE, None)


def blank(folder: Path, count: int) -> tuple[Path, ...]:
    """Photographs that show nothing."""
    paths = tuple(folder / f"{number}.png" for number in range(count))
    for path in paths:
        Image.new("L", SIZE, 200).save(path)
    return paths


@pytest.fixture
def photographed(tmp_path: Path) -> Case:
    """A case with three photographs of the blade and two of the plate, all blank."""
    first, second = blank(tmp_path, 3)[:2], blank(tmp_path, 3)[2:]
    return replace(
        case(recipe("paper-photographed")),
        photographs=(Photographed(first, True), Photographed(second, True)),
        plate=Photographed(first, True),
        camera=CAMERA,
    )


def test_settings_are_fewer_photographs_then_coarser_ones_then_all(photographed):
    settings = Photographs().settings(photographed)
    assert [setting.label for setting in settings] == [
        "1 photograph, 1200 px wide",
        "2 photographs, 1200 px wide",
        "3 photographs, 400 px wide",
        "3 photographs, 600 px wide",
        "3 photographs, 1200 px wide",
    ]
    assert [setting.accuracy for setting in settings] == [0, 0, 0, 0, 1]
    assert [setting.present for setting in settings] == [False] * 4 + [True]
    kept = Photographs().applied(photographed, settings[1])
    assert [len(one.paths) for one in kept.photographs] == [2]
    plate = Plate().settings(photographed)
    assert Plate().applied(photographed, plate[0]).plate.paths == photographed.plate.paths[:1]


def test_a_photograph_that_shows_nothing_is_a_named_failure(photographed):
    knob = pickle.loads(pickle.dumps(Photographs()))
    with pytest.raises(InputError, match=r"\d.png"):
        knob.measure(photographed, knob.settings(photographed)[0], 0)
    with pytest.raises(InputError, match=r"\d.png"):
        Plate().measure(photographed, Plate().settings(photographed)[0], 0)
    with pytest.raises(InputError, match="cannot be read more coarsely"):
        fit_edge(photographed, (1, 7), np.random.default_rng(0))
    with pytest.raises(MissingError, match="no photograph of the plate"):
        locate_plate(replace(photographed, plate=None), (1, 1), np.random.default_rng(0))


def test_errors_of_an_edge_are_those_along_the_blade(photographed):
    def sample(shift_m: float, turn_rad: float, torque: float) -> Sample:
        station = np.linspace(0.0, 0.07, 11)
        offset, taper = (shift_m + turn_rad * station).tolist(), [0.03 + turn_rad] * 11
        outcome = {"offset_m": offset, "taper_rad": taper, "torque": [torque, None]}
        return Sample({}, outcome)

    known = sample(0.0, 0.0, 0.1)
    errors = Photographs().errors(photographed, sample(5e-6, 2e-3, 0.102), known)
    along = 5.0 + 2e3 * np.linspace(0.0, 0.07, 11)
    assert errors[EDGE].value == pytest.approx(np.sqrt(np.mean(along**2)))
    assert errors[TAPER].value == pytest.approx(2.0)
    assert errors[WORST].share == pytest.approx(0.02)
    same = Photographs().errors(photographed, known, known)
    assert same[EDGE].value == same[TAPER].value == same[WORST].value == 0.0


def test_errors_of_a_pose_are_shift_and_turn(photographed):
    def sample(turn_deg: float, shift_mm: float) -> Sample:
        pose = Pose.from_rotation_vector([0.0, 0.0, np.radians(turn_deg)], [1e-3 * shift_mm, 0, 0])
        outcome = {"quaternion": list(pose.quaternion), "translation_m": list(pose.translation_m)}
        return Sample({}, outcome)

    errors = Plate().errors(photographed, sample(1.5, 2.0), sample(1.0, 1.0))
    assert errors[PLACE].value == pytest.approx(1.0)
    assert errors[TURN].value == pytest.approx(0.5)
    assert Plate().errors(photographed, sample(1.0, 1.0), None) == {}


def test_a_scene_without_photographs_says_so():
    assert "states the edge" in Photographs().missing(case())
    assert "as known" in Plate().missing(case())
    without = case(recipe("paper-photographed"))
    assert "no photographs of the blade" in Photographs().missing(without)
    assert "no photographs of the plate" in Plate().missing(without)


def test_a_coarser_photograph_averages_blocks_and_keeps_its_places(tmp_path):
    rng = np.random.default_rng(0)
    image = rng.integers(0, 255, (6, 8), dtype=np.uint8)
    path = tmp_path / "photo.png"
    Image.fromarray(image).save(path)
    photo: Photo = read_photo(path, colour=False)
    coarse = photo.reduced(2)
    blocks = image.reshape(3, 2, 4, 2).mean(axis=(1, 3))
    assert np.abs(coarse.image - blocks).max() <= 0.5
    assert (coarse.width, coarse.height, coarse.reduction) == (8, 6, 2)
    assert coarse.whole([[0.0, 0.0]]).tolist() == [[0.5, 0.5]]
    assert coarse.within(coarse.whole([[1.0, 2.0]])).tolist() == [[1.0, 2.0]]
    with pytest.raises(ValueError, match="no multiples of 4"):
        photo.reduced(4)
    assert factors_of(640, 480) == (1,)


@pytest.mark.slow
def test_rendered_photographs_give_the_edge_and_the_pose(tmp_path):
    """Fewer and coarser photographs of one rendered blade and plate, against all of them."""
    from scissorcal.vision import SIM_LENS, render_blade_photographs, render_plate_photographs
    from scissorcal.workday import specimen_blade

    chosen = recipe("paper-photographed")
    lens = SIM_LENS
    camera = Camera(
        lens.focal_px, lens.focal_px, *lens.centre_px, lens.distortion, lens.width, lens.height
    )
    one = replace(
        case(chosen),
        photographs=(
            Photographed(render_blade_photographs(specimen_blade(chosen), tmp_path, 3), True),
        ),
        plate=Photographed(render_plate_photographs(chosen, tmp_path, 3, count=2), True),
        camera=camera,
    )
    for knob, error, most in ((Photographs(), EDGE, 60.0), (Plate(), PLACE, 0.2)):
        settings = knob.settings(one)
        whole, single = (knob.measure(one, settings[place], 0) for place in (-1, 0))
        half = knob.measure(one, settings[-2], 0)
        assert knob.errors(one, whole, whole)[error].value == 0.0
        assert 0.0 < knob.errors(one, single, whole)[error].value < most
        assert 0.0 < knob.errors(one, half, whole)[error].value < most
