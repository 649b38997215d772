"""Subpixel places at which a border crosses lines of pixels."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d
from scipy.special import ndtr

from scissorcal.aliases import Array

Light = NDArray[np.float32]

STEP_PX = 0.5
_STEPS = 12
_SHIFT_COST = 0.05
COARSE, LOSS = 2.5, 1.5
"""A change is sharp where its slope falls by more than this factor when smoothed this much more."""

ENOUGH, ASIDE = 0.35, 0.25
"""Share of the steepest or sharpest that counts fully; gain of the place farthest in or out."""

DARKEST = 1e-2
_NARROWEST, _NOISE_FLOOR = 0.35, 1e-3


@dataclass(frozen=True)
class Crossings:
    """Borders across lines of pixels, all (n,); lengths in pixels along the line.

    ``place`` is where, with ``sd``; ``blur`` is the standard deviation of the blur there, ``inner``
    and ``outer`` the light on either side, ``misfit`` the rms residual as a share of the
    contrast. ``good`` says whether there is one clear border.
    """

    place: Array
    sd: Array
    blur: Array
    inner: Array
    outer: Array
    misfit: Array
    good: NDArray[np.bool_]


def sampled(light: Light, points: Array, normals: Array, reach: float, step: float) -> Array:
    """Light (n, m) along each normal, from -reach to +reach pixels about each point."""
    u = np.arange(-round(reach / step), round(reach / step) + 1) * step
    x = points[:, :1] + normals[:, :1] * u
    y = points[:, 1:] + normals[:, 1:] * u
    taken = cv2.remap(
        light,
        x.astype(np.float32),
        y.astype(np.float32),
        cv2.INTER_CUBIC,
        borderMode=cv2.BORDER_REPLICATE,
    )
    return np.asarray(taken, dtype=np.float64)


def steepest(
    light: Light, points: Array, normals: Array, reach: float, soft: float, *, innermost: bool
) -> Array:
    """Offsets (n,) in pixels to the line along which light rises outward most steeply.

    Light is smoothed by ``soft`` pixels first. The line is the best one of all that lie within
    ``reach`` and shift by no more than a pixel from one point to the next (Viterbi's algorithm):
    glare and dirt may interrupt a border without shifting it. A shadow lies outside the object and
    may have the stronger border: with ``innermost``, the innermost of the lines that are steep
    enough (a share of the steepest, in the logarithm of light) is taken.
    """
    profile = sampled(light, points, normals, reach, 1.0)
    if innermost:
        profile = np.log(np.maximum(profile, DARKEST))
    rise = gaussian_filter1d(profile, soft, axis=1, order=1, mode="nearest")
    top = max(float(np.quantile(rise.max(axis=1), 0.75)), 1e-6)
    u = np.arange(profile.shape[1]) - profile.shape[1] // 2
    if innermost:
        gain = np.clip(rise / (ENOUGH * top), -0.2, 1.0) - ASIDE * u / (reach + 1)
    else:
        gain = np.clip(rise / top, -0.2, 1.2) * (1.0 - 0.3 * np.abs(u) / (reach + 1))
    return np.asarray(u[best_path(gain)], dtype=np.float64)


def outermost_sharp(
    light: Light, points: Array, normals: Array, reach: float, soft: float
) -> Array:
    """Offsets (n,) in pixels to the outermost line at which light changes sharply, in either sense.

    An object ends at the first sharp change that one meets from outside, while a cast shadow has a
    penumbra: its border grows soft with the height of what casts it. Metal may be darker or
    brighter than its shadow, and sheet, shadow and metal may have one hue, so neither decides.
    The line is the best of all within ``reach`` by `sharpness` at the scale ``soft`` (pixels), up
    to a share of the sharpest, and the farther out the better.
    """
    profile = np.log(np.maximum(sampled(light, points, normals, reach, 1.0), DARKEST))
    sharp = _sharpness_across(profile, soft)
    top = max(float(np.quantile(sharp.max(axis=1), 0.75)), 1e-6)
    u = np.arange(profile.shape[1]) - profile.shape[1] // 2
    gain = np.clip(sharp / (ENOUGH * top), 0.0, 1.0) + ASIDE * u / (reach + 1)
    return np.asarray(u[best_path(gain)], dtype=np.float64)


def _sharpness_across(profile: Array, soft: float) -> Array:
    """How much a change along each row (n, m) loses when the row is smoothed more.

    A step of blur b has the slope 1 / sqrt(b^2 + s^2) after smoothing by s; what remains of it
    less `LOSS` times that at `COARSE` times the scale is positive for b below 1.8 ``soft`` only.
    """
    fine, coarse = (
        gaussian_filter1d(profile, s, axis=1, order=1, mode="nearest")
        for s in (soft, COARSE * soft)
    )
    return np.asarray(np.maximum(np.abs(fine) - LOSS * np.abs(coarse), 0.0))


def best_path(gain: Array) -> NDArray[np.int64]:
    """Columns (n,) of the path down ``gain`` (n, m) with the largest sum, steps of at most one."""
    rows, columns = gain.shape
    came = np.zeros((rows, columns), dtype=np.int64)
    index = np.arange(columns)
    # one column more on either side, from which no path starts
    total = np.full(columns + 2, -np.inf)
    total[1:-1] = gain[0]
    choices = np.empty((3, columns))
    for row in range(1, rows):
        np.subtract(total[:-2], _SHIFT_COST, out=choices[0])
        choices[1] = total[1:-1]
        np.subtract(total[2:], _SHIFT_COST, out=choices[2])
        taken = choices.argmax(axis=0)
        came[row] = index + taken - 1
        np.add(choices[taken, index], gain[row], out=total[1:-1])
    path = np.empty(rows, dtype=np.int64)
    path[-1] = int(np.argmax(total[1:-1]))
    for row in range(rows - 1, 0, -1):
        path[row - 1] = came[row, path[row]]
    return path


def crossings(light: Light, points: Array, normals: Array, reach: float) -> Crossings:
    """Fit a blurred step across each point's normal.

    The model is (a + b v) (1 - F(v / blur)) + (c + d v) F(v / blur), v the distance from the border
    and F the normal distribution: either side may have a gradient, as under a shadow.
    A symmetric blur does not shift the place. Neighbouring samples are half a pixel apart and so
    count half.

    All points are fitted at once (Levenberg-Marquardt, each with its own damping): a solver of
    scipy for each of the hundreds of points ends at the same places to 1e-5 px, 16 times as slowly.
    """
    profile = sampled(light, points, normals, reach, STEP_PX)
    u = np.arange(profile.shape[1]) * STEP_PX - STEP_PX * (profile.shape[1] // 2)
    state = _start(profile, u)
    damping = np.full(len(points), 1e-2)
    model, J = _model(state, u)
    cost = np.sum((profile - model) ** 2, axis=1)
    for _ in range(_STEPS):
        across = J.transpose(0, 2, 1)
        gradient = (across @ (profile - model)[..., None])[..., 0]
        normal = across @ J
        diagonal = np.einsum("nkk->nk", normal)
        lifted = normal + np.eye(6) * (damping[:, None] * diagonal + 1e-12)[:, None, :]
        step = np.linalg.solve(lifted, gradient[..., None])[..., 0]
        tried = state + step
        tried[:, 4] = np.clip(tried[:, 4], -reach, reach)
        tried[:, 5] = np.clip(tried[:, 5], _NARROWEST, 0.6 * reach)
        new_model, new_J = _model(tried, u)
        new_cost = np.sum((profile - new_model) ** 2, axis=1)
        better = new_cost <= cost
        state[better], model[better], J[better] = tried[better], new_model[better], new_J[better]
        cost = np.where(better, new_cost, cost)
        damping = np.where(better, damping * 0.3, damping * 8.0)
    return _judged(u, state, J, cost, reach)


def _start(profile: Array, u: Array) -> Array:
    end = max(len(u) // 6, 2)
    inner, outer = profile[:, :end].mean(axis=1), profile[:, -end:].mean(axis=1)
    rise = np.gradient(profile, axis=1) * np.where(outer >= inner, 1.0, -1.0)[:, None]
    weight = np.maximum(rise, 0.0) ** 2 + 1e-12
    place = np.sum(weight * u, axis=1) / weight.sum(axis=1)
    zero = np.zeros_like(inner)
    return np.column_stack([inner, zero, outer, zero, place, np.full_like(inner, 1.0)])


def _model(state: Array, u: Array) -> tuple[Array, Array]:
    a, b, c, d, place, blur = (state[:, [k]] for k in range(6))
    v = u - place
    z = v / blur
    share = ndtr(z)
    density = np.exp(-0.5 * z**2) / np.sqrt(2.0 * np.pi)
    inner, outer = a + b * v, c + d * v
    model = inner * (1.0 - share) + outer * share
    jump = (outer - inner) * density
    by_place = -b * (1.0 - share) - d * share - jump / blur
    J = np.stack(
        [1.0 - share, v * (1.0 - share), share, v * share, by_place, -jump * z / blur], axis=2
    )
    return model, J


def _judged(u: Array, state: Array, J: Array, cost: Array, reach: float) -> Crossings:
    contrast = state[:, 2] - state[:, 0]
    variance = cost / max(len(u) - 6, 1) + _NOISE_FLOOR**2
    normal = np.einsum("nmk,nml->nkl", J, J) + 1e-12 * np.eye(6)
    inverse = np.linalg.inv(normal)
    sd = np.sqrt(np.maximum(inverse[:, 4, 4], 0.0) * variance / STEP_PX)
    misfit = np.sqrt(cost / len(u)) / np.maximum(np.abs(contrast), 1e-6)
    good = (
        (np.abs(contrast) > 0.04)
        & (misfit < 0.12)
        & (np.abs(state[:, 4]) < 0.8 * reach)
        & (state[:, 5] < 0.5 * reach)
        & (sd < 0.5)
    )
    return Crossings(state[:, 4], sd, state[:, 5], state[:, 0], state[:, 2], misfit, good)
