"""A blade in one photograph: measured to a fraction of a pixel, or refused with the reason."""

from dataclasses import dataclass, fields, replace

import cv2
import numpy as np
import pytest
from benchmarks.photographs import Glare

from scissorcal.errors import InputError
from scissorcal.vision.blade.borders import PicturedBlade
from scissorcal.vision.blade.measure import measure_blade
from scissorcal.vision.blade.photo import (
    BladeLayout,
    NickMark,
    blade_picture,
    photograph_blade,
    photograph_scissors,
)
from scissorcal.vision.blade.silhouette import lone_blade
from scissorcal.vision.blade.view import CameraView
from scissorcal.vision.photo import Photo
from scissorcal.vision.sim import Nick, SimPose, blade_layer, render, target_layers
from scissorcal.vision.targets.boards import BLADE_MAT, CAMERA_BOARD, MAT_PIVOT_M
from scissorcal.vision.targets.sides import linear_light
from tests.vision.blade.scenes import (
    CAMERA,
    LENS,
    LOOKS,
    POSE,
    SHAPE,
    blade_photo,
    photo_of,
    scissors_photo,
    true_edge,
)


@pytest.fixture(scope="module")
def measured():
    photo = blade_photo(shadow=0.3, shadow_m=(-1e-3, 1.2e-3))
    return {known: photograph_blade(photo, CAMERA if known else None) for known in (True, False)}


@pytest.mark.parametrize("known", [True, False])
def test_the_measured_edge_is_the_true_edge(measured, known):
    one = measured[known].measured[0]
    off = one.offset - true_edge(SHAPE, one.station)
    assert len(one.station) > 200
    assert abs(np.median(off)) < 15e-6
    assert np.median(np.abs(off)) < 30e-6
    assert abs(np.polyfit(one.station, off, 1)[0]) < 6e-4
    assert one.length == pytest.approx(SHAPE.length_m, abs=3e-4)
    assert one.hole_radius == pytest.approx(SHAPE.hole_m, abs=5e-5)
    assert one.metric


def test_noise_and_common_errors_match_their_standard_deviations(measured):
    one = measured[True].measured[0]
    off = one.offset - true_edge(SHAPE, one.station)
    smooth = np.polyval(np.polyfit(one.station, off, 5), one.station)
    spread = 1.4826 * np.median(np.abs(off - smooth))
    assert 0.5 < spread / np.median(one.sd) < 2.0
    named = dict.fromkeys(one.mode_names)
    assert {"shared mapping", "mapping", "tone", "grain", "pivot", "centreline"} <= set(named)
    together = np.sqrt(np.sum(one.modes**2, axis=1))
    assert np.median(np.abs(off)) < 2.0 * np.median(np.hypot(together, one.sd))


@dataclass(frozen=True)
class MovedView(CameraView):
    """The view with its mapping moved, for all that measures through it."""

    moved: tuple[float, ...] = ()

    def to_sheet(self, pixels, values=None):
        return super().to_sheet(pixels, np.array(self.moved) if values is None else values)


def test_a_mode_equals_the_difference_of_a_repeated_measurement(measured):
    """Each independent error of the mapping in turn moves the view, which measures once more."""
    photo = measured[True]
    one, view = photo.measured[0], photo.view
    light = linear_light(photo.photo.grey)
    parts = lone_blade(photo.outline, "blade.jpg")
    columns = [k for k, name in enumerate(one.mode_names) if "mapping" in name]
    sd = np.sqrt(np.diag(view.covariance))
    own = len(sd) - view.shared
    order = [k for k in [*range(own, len(sd)), *range(own)] if sd[k] > 0]
    unit = np.outer(sd[order], sd[order])
    correlation = view.covariance[np.ix_(order, order)] / unit + 1e-9 * np.eye(len(order))
    root = sd[order, None] * np.linalg.cholesky(correlation)
    assert len(columns) == len(order)
    held = {field.name: getattr(view, field.name) for field in fields(view)}
    for column, error in zip(columns, root.T, strict=True):
        values = view.values.copy()
        values[order] += error
        moved = MovedView(**held, moved=tuple(values))
        again = measure_blade(PicturedBlade(light, moved, parts, "blade.jpg"))
        low, high = again.station[[0, -1]]
        s = one.station[(one.station > low) & (one.station < high)]
        change = np.interp(s, again.station, again.offset) - np.interp(s, one.station, one.offset)
        mode = np.interp(s, one.station, one.modes[:, column])
        # a line through each: what single points do is their noise
        along = np.linspace(-1.0, 1.0, len(s))
        measured_line, line = np.polyfit(along, change, 1), np.polyfit(along, mode, 1)
        assert np.abs(measured_line - line).max() < 0.1 * np.abs(line).max() + 3e-7
    modes = one.modes[:, columns]
    assert np.abs(np.diff(modes, 2, axis=0)).max() < 0.02 * np.abs(modes).max()


def test_without_a_camera_the_uncertainty_is_stated(measured):
    assert "No camera fit" in measured[False].measured[0].uncertainty
    assert "Fitted camera" in measured[True].measured[0].uncertainty


def test_edge_side_up_selects_the_other_side():
    # turned by half a turn, tip to the left, its edge faces the upper rim
    photo = blade_photo(turn=np.pi + 0.02, where=(0.16, 0.09))
    one = photograph_blade(photo, CAMERA, layout=BladeLayout(edge_side="up")).measured[0]
    assert abs(np.median(one.offset - true_edge(SHAPE, one.station))) < 2e-5


def test_a_blade_that_is_not_seen_where_it_is_halved_is_refused(measured):
    photo = measured[True]
    parts = replace(lone_blade(photo.outline, "blade.jpg"), halved=(0.795, 0.7999))
    light = linear_light(photo.photo.grey)
    with pytest.raises(InputError, match=r"blade\.jpg: too little of the blade's edge .* halves"):
        measure_blade(PicturedBlade(light, photo.view, parts, "blade.jpg"))


def test_a_given_pivot_replaces_the_hole():
    photo = blade_photo(replace(SHAPE, hole_m=0.0))
    with pytest.raises(InputError, match=r"no round pivot hole .* --pivot"):
        photograph_blade(photo, CAMERA)
    place = LENS.sees(np.array([MAT_PIVOT_M]), POSE)[0]
    one = photograph_blade(
        photo, CAMERA, layout=BladeLayout(pivot_px=(place[0], place[1]))
    ).measured[0]
    assert abs(np.median(one.offset - true_edge(SHAPE, one.station))) < 1e-4


@pytest.mark.parametrize("mat", [True, False])
def test_both_blades_of_open_scissors(mat):
    found = photograph_scissors(scissors_photo(0.7, mat=mat), CAMERA, layout=BladeLayout(mat=mat))
    assert len(found.measured) == 2
    assert found.scissors.screw
    # without the mat perspective stays in
    assert found.scissors.opening == pytest.approx(0.7, abs=0.01 if mat else 0.06)
    for one in found.measured:
        assert one.metric == mat
        if mat:
            assert one.length == pytest.approx(0.08, abs=1e-3)
            off = one.offset - true_edge(replace(SHAPE, length_m=0.08), one.station)
            assert np.median(np.abs(off)) < 4e-4
    if not mat:
        assert "has no scale" in found.view.uncertainty


def test_closed_scissors_hide_their_edges():
    found = photograph_scissors(scissors_photo(0.0), CAMERA)
    assert found.measured == ()
    assert found.scissors.opening == 0.0


def test_the_overlay_shows_the_measurement(measured):
    seen = measured[True]
    one = seen.measured[0]
    slope, level = np.polyfit(one.station, one.offset, 1)
    drawn = blade_picture(seen, [lambda s: level + slope * s], [[NickMark(0.04, "nick 0.3 mm")]])
    assert max(drawn.shape[:2]) <= 1600
    green = (drawn[..., 1].astype(int) - drawn[..., 0] > 60) & (drawn[..., 1] > 150)
    assert green.sum() > 100


def two_blades():
    layers = [
        *target_layers(BLADE_MAT, POSE),
        blade_layer(SHAPE, POSE, (0.062, 0.06)),
        blade_layer(SHAPE, POSE, (0.062, 0.12)),
    ]
    return photo_of(render(layers, LENS, LOOKS, np.random.default_rng(0)))


def wrong_board():
    pose = SimPose.looking_at((0.117, 0.09), 0.3)
    layers = target_layers(CAMERA_BOARD, pose)
    return photo_of(render(layers, LENS, LOOKS, np.random.default_rng(0)))


BAD = {
    "no marker": (lambda: blade_photo(mat=False), "blade mat"),
    "wrong board": (wrong_board, "camera board"),
    "blurred": (
        lambda: blade_photo(looks=replace(LOOKS, defocus_px=9.0, motion_px=25.0)),
        "blur|no marker|sharp",
    ),
    "runs out of the field": (lambda: blade_photo(where=(0.175, 0.09)), "extends beyond"),
    "two blades": (two_blades, "one blade is expected"),
    "crossed blades": (lambda: scissors_photo(0.7), "Two blades|one blade|round pivot"),
    "nothing there": (lambda: blade_photo(reflectance=0.84, brushed=0.0), "dark enough|nothing"),
    "mirror along the edge": (
        lambda: blade_photo(
            turn=0.0,
            glares=tuple(
                Glare((0.07 + 0.01 * k, 0.0972 - 0.00035 * k), 0.008, 0.0016, strength=0.62)
                for k in range(7)
            ),
        ),
        "clear border|fragmented|glare",
    ),
    "another size than the camera's": (None, "was fitted at"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_photographs_are_refused_with_the_reason(name):
    make, words = BAD[name]
    camera = CAMERA
    if make is None:
        photo, camera = blade_photo(), replace(CAMERA, width=4000, height=3000)
    else:
        photo = make()
    with pytest.raises(InputError, match=words) as refused:
        photograph_blade(photo, camera)
    assert photo.source in str(refused.value)


def test_a_tip_outside_the_picture_is_refused():
    pose = SimPose.looking_at((0.06, 0.09), 0.16)
    with pytest.raises(InputError, match=r"extends beyond|markers"):
        photograph_blade(blade_photo(pose=pose), CAMERA)


def test_a_nick_is_not_smoothed_away():
    nick = Nick(0.045, 1.5e-3, 4e-4)
    one = photograph_blade(blade_photo(replace(SHAPE, nicks=(nick,))), CAMERA).measured[0]
    off = one.offset - true_edge(SHAPE, one.station)
    deepest = one.station[np.argmax(off)]
    assert deepest == pytest.approx(0.045, abs=4e-4)
    assert off.max() == pytest.approx(4e-4, abs=8e-5)


def reduced(photo: Photo) -> Photo:
    """The same photograph read at half its size."""
    half = cv2.resize(photo.image, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
    return replace(photo, image=half, reduction=2)


def test_scale_and_pivot_are_in_the_pixels_of_the_whole_photograph_however_it_was_read():
    whole = scissors_photo(0.8, mat=False)
    lengths = [
        max(
            one.length
            for one in photograph_scissors(
                photo, layout=BladeLayout(mat=False, m_per_px=1e-4)
            ).measured
        )
        for photo in (whole, reduced(whole))
    ]
    assert lengths[1] == pytest.approx(lengths[0], rel=0.02)
    photo = blade_photo()
    known = photograph_blade(photo, CAMERA)
    pixel = known.view.to_pixels(known.measured[0].parts.pivot[None])[0]
    pivots = [
        photograph_blade(
            one, CAMERA, layout=BladeLayout(pivot_px=(float(pixel[0]), float(pixel[1])))
        ).measured[0]
        for one in (photo, reduced(photo))
    ]
    assert pivots[1].length == pytest.approx(pivots[0].length, abs=5e-4)
