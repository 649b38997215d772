"""What photographs gave: shown where the scene asks for it, with pictures, and no more."""

import base64
import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import jsonschema
import numpy as np
import pytest

from scissorcal.calibration import FitResult, SeenPair
from scissorcal.recipe import GeometryKind, Recipe, schemas_dir
from scissorcal.report import Evidence, Geometry, build_report
from scissorcal.report.pictures import PICTURE_BYTES, place_pictures
from tests.report.conftest import CREATED, Built, paper
from tests.report.fits import friction_fit
from tests.report.geometry_fits import (
    blade_result,
    camera_fit,
    geometry,
    imported_camera,
    noise,
    plate_fit,
)
from tests.report.pages import panel_of, read_page, read_twin, values_of

HOSTILE = '<script>alert("x")</script>'
DATA = "data:image/jpeg;base64,"


@dataclass(frozen=True)
class Shown:
    """A report of photographs and what it was made from."""

    built: Built
    geometry: Geometry


def photographed() -> Recipe:
    """The paper recipe, with its edge and its plate's pose from photographs."""
    recipe = paper()
    edge = recipe.rig.edge.model_copy(update={"source": "photographs"})
    rig = recipe.rig.model_copy(update={"edge": edge})
    scene = recipe.scene.model_copy(update={"plate_pose": "estimated"})
    return recipe.model_copy(update={"rig": rig, "scene": scene})


def report_of(
    folder: Path,
    found: Geometry | None,
    recipe: Recipe | None = None,
    fits: Sequence[FitResult] = (),
) -> Built:
    files = build_report(
        recipe or photographed(), fits, Evidence(geometry=found), folder, created=CREATED
    )
    return Built(folder, read_page(files.html), read_twin(files.json))


@pytest.fixture(scope="module")
def shown(tmp_path_factory: pytest.TempPathFactory) -> Shown:
    folder = tmp_path_factory.mktemp("photographed")
    found = geometry(folder / "fits")
    return Shown(report_of(folder, found), found)


def test_photographs_alone_make_a_report(shown: Shown) -> None:
    assert shown.built.twin["provenance"]["fits"] == []
    assert {"camera", "blade", "plate"} <= set(shown.built.page.ids)
    assert shown.built.page.unbalanced == []


def test_the_twin_follows_its_schema_and_has_the_numbers(shown: Shown) -> None:
    twin = shown.built.twin
    schema = json.loads((schemas_dir() / "report.schema.json").read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator(schema).validate(twin)
    fit = camera_fit()
    camera = values_of(panel_of(twin, "camera-parameters"))
    assert [camera[name]["value"]["number"] for name in ("fx", "fy")] == [
        fit.camera.fx,
        fit.camera.fy,
    ]
    assert camera["fx"]["value"]["sd"] == pytest.approx(0.5)
    assert list(values_of(panel_of(twin, "camera-views"))) == [
        "board-2.jpg",
        "board-1.jpg",
        "board-3.jpg",
    ]
    blade = blade_result().blades[0]
    edge, residuals, taper = panel_of(twin, "blade-shape")["charts"]
    drawn = next(one for one in edge["series"] if one["kind"] == "line")
    assert drawn["y"] == pytest.approx(1e3 * blade.offset.mean, rel=1e-4)
    degrees = next(one for one in taper["series"] if one["kind"] == "line")
    assert degrees["y"] == pytest.approx(np.degrees(blade.taper.mean), rel=1e-4)
    assert {one["name"] for one in residuals["series"]} >= {"blade-1.jpg", "blade-2.jpg"}
    nick = values_of(panel_of(twin, "blade-nicks"))["nick 1"]
    assert nick["from the pivot"]["number"] == pytest.approx(42.1)
    pose = values_of(panel_of(twin, "plate-pose"))
    assert [pose[axis]["before the camera"]["number"] for axis in "xyz"] == [10.0, -20.0, 400.0]
    turned = pose["turn about z"]["in the rig's frame"]
    assert turned["number"] == pytest.approx(np.degrees(0.1))
    assert turned["unit"] == "°"
    angles = plate_fit().camera_plate.euler_angles
    yaw = pose["yaw"]["before the camera"]
    assert (yaw["number"], yaw["unit"]) == (pytest.approx(angles.yaw_deg), "°")
    assert yaw["sd"] == pytest.approx(angles.sd_deg[0])
    notes = " ".join(panel_of(twin, "plate-pose")["notes"])
    assert "Quaternion (w, x, y, z) before the camera: " in notes
    assert "intrinsic z-y'-x''" in notes
    origins = {row["fit"]: row for row in twin["provenance"]["geometry"]}
    assert origins["blade"] == {
        "fit": "blade",
        "inputs_hash": "b1ade",
        "file_sha256": "22",
        "sources": ["blade-1.jpg", "blade-2.jpg"],
    }


def test_verdicts_join_the_list_on_top(shown: Shown) -> None:
    rows = panel_of(shown.built.twin, "verdicts-all")["verdicts"]
    assert [row["status"] for row in rows] == ["fail", "not_evaluated", "pass"]
    ids = shown.built.page.ids
    assert ids.index("verdicts") < ids.index("camera")
    rows = values_of(panel_of(shown.built.twin, "decision-trust"))
    assert {name: row["decision"]["text"] for name, row in rows.items()} == {
        "camera": "✗ do not use",
        "blade": "✓ checks passed",
        "plate": "! use with care",
    }


def test_the_page_says_what_staff_must_know(shown: Shown) -> None:
    text = shown.built.page.text
    for words in (
        "board-2.jpg fits far worse than the others",
        "differ by 0.20 px (rms) where 0.17 px is claimed",
        "10.00 ± 0.10",  # the plate's x in mm
        "odds of 40 to 1",
        "The edge is an arc",
        "42.1",  # the nick's place in mm
        "−8.000 ± 0.020",  # the edge's offset in mm
    ):
        assert words in text, words


def test_pictures_are_within_the_page_and_in_words(shown: Shown) -> None:
    page = shown.built.page
    pictures = page.all("img")
    assert len(pictures) == 8  # the thumbnail, and all but the chart that is drawn anew
    for picture in pictures:
        assert picture["src"].startswith(DATA)
        raw = np.frombuffer(base64.b64decode(picture["src"].removeprefix(DATA)), np.uint8)
        image = cv2.imdecode(raw, cv2.IMREAD_COLOR)
        assert image is not None
        assert image.shape[:2] == (int(picture["height"]), int(picture["width"]))
        assert len(picture["alt"]) > 40
    assert len({picture["alt"] for picture in pictures}) == 7  # the thumbnail is one of them
    for figure in page.all("figure", **{"class": "photo"}):
        assert figure["tabindex"] == "0"
    assert page.values("src") == [picture["src"] for picture in pictures]


def test_the_same_input_gives_the_same_bytes(shown: Shown, tmp_path: Path) -> None:
    again = report_of(tmp_path, shown.geometry)
    assert again.page.source == shown.built.page.source


def test_what_the_scene_does_not_require_is_not_shown(shown: Shown, tmp_path: Path) -> None:
    plain = report_of(tmp_path, shown.geometry, paper(), [friction_fit()])
    assert not {"camera", "blade", "plate"} & set(plain.page.ids)
    assert plain.page.all("img") == []
    assert not {"camera", "blade", "plate"} & {panel["part"] for panel in plain.twin["panels"]}
    verdicts = panel_of(plain.twin, "verdicts-all")["verdicts"]
    assert all(row["scope"] != "fit.camera" for row in verdicts)
    left_out = values_of(panel_of(plain.twin, "left-out-list"))
    for what in ("blade photographs", "plate pose"):
        assert left_out[what]["because it is"]["text"] == "not needed"


def test_what_is_missing_names_the_command(shown: Shown, tmp_path: Path) -> None:
    lost = "The scene requires it: its inputs changed since. Run `scissorcal fit plate`."
    found = replace(shown.geometry, blade=None, plate=None, missing={"plate": lost})
    report = report_of(tmp_path, found)
    assert "scissorcal capture blade --image blade-*.jpg" in report.page.text
    assert "its inputs changed since. Run scissorcal fit plate" in report.page.text
    reasons = values_of(panel_of(report.twin, "left-out-list"))
    for what in ("blade fit", "plate fit"):
        assert reasons[what]["because it is"]["text"] == "not there yet"


def test_an_imported_camera_and_an_edge_without_scale(tmp_path: Path) -> None:
    found = Geometry(imported_camera(), blade_result(metric=False, nicked=False))
    report = report_of(tmp_path, found)
    text = report.page.text
    assert "The uncertainty of this camera is not stated" in text
    assert "k6 radial distortion, in the denominator" in text
    assert "Its size is not known" in text
    assert "No nick was found" in text
    assert "µm" not in " ".join(figure["aria-label"] for figure in report.page.all("svg"))


def test_both_blades_of_open_scissors_have_parts_of_their_own(tmp_path: Path) -> None:
    (one,) = blade_result().blades
    pair = tuple(replace(one, name=name) for name in ("left", "right"))
    openings = (SeenPair("blade-1.jpg", np.radians(40.0)), SeenPair("blade-2.jpg", 0.0))
    found = Geometry(blade=replace(blade_result(), blades=pair, openings=openings))
    page = report_of(tmp_path, found).page
    assert len(set(page.ids)) == len(page.ids)
    assert {"blade-left-shape", "blade-right-shape", "blade-openings"} <= set(page.ids)
    assert "blade-1.jpg 40" in page.text
    assert "blade-2.jpg closed" in page.text


def test_words_from_photographs_never_become_markup(tmp_path: Path) -> None:
    camera = camera_fit()
    views = tuple(replace(view, name=HOSTILE) for view in camera.views)
    found = geometry(tmp_path / "fits")
    found = replace(found, camera=replace(camera, views=views, board=HOSTILE, sources=(HOSTILE,)))
    page = report_of(tmp_path, found).page
    assert page.source.count("<script") == 1  # the page's own
    assert page.unbalanced == []


def test_many_pictures_are_dropped_and_named(tmp_path: Path) -> None:
    found = geometry(tmp_path / "fits", size=(1100, 900))
    report = report_of(tmp_path, found)
    size = len(report.page.source.encode())
    kept = report.page.all("img")
    assert PICTURE_BYTES // 2 < size < 5_000_000
    assert 0 < len(kept) < 8
    assert sum(len(picture["src"]) for picture in kept) <= PICTURE_BYTES
    assert report.page.text.count("left out to keep this page small") == 8 - len(kept)


def test_the_first_of_each_fit_come_before_the_second_of_any(tmp_path: Path) -> None:
    files = {
        kind: [(noise(tmp_path / kind / f"{n}.png", (64, 48)), 1000) for n in range(3)]
        for kind in ("camera", "blade")
    }
    whole = place_pictures(files, 10**9)
    room = len(whole["camera"][0].data) + len(whole["blade"][0].data)
    some = place_pictures(files, room)
    assert [[bool(one.data) for one in own] for own in some.values()] == [[True, False, False]] * 2
    assert "2.png is left out" in some["blade"][2].missing


def test_a_picture_that_is_gone_is_named(shown: Shown, tmp_path: Path) -> None:
    torn = tmp_path / "001-blade-1.png"
    torn.write_bytes(b"no picture")
    pictures: dict[GeometryKind, tuple[Path, ...]] = {"blade": (torn, tmp_path / "002-blade-2.png")}
    report = report_of(tmp_path, replace(shown.geometry, pictures=pictures))
    assert report.page.all("img") == []
    assert report.page.text.count("not there any more, or damaged") == 3  # and the thumbnail
