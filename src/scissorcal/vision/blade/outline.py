"""A whole outline to a fraction of a pixel: every border of what lies on a sheet."""

import numpy as np
from numpy.typing import NDArray

from scissorcal.vision.blade.profile import Light, crossings, sampled, steepest
from scissorcal.vision.blade.view import View

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_SMOOTH_PX = 2.5
_REACH_PX = 4.0
_FARTHEST_PX = 16.0


def refine_outline(light: Light, view: View, outline: Array) -> tuple[Array, Flags]:
    """Move a rough outline (n, 2) on the sheet to the border in the picture.

    Returns pixels (m, 2), about one for every pixel of its length, and (m,) whether each crossing
    is a clear one; at corners, where the border is no line across the normal, few are. The outline
    runs in either sense, around a thing darker than the sheet or around an opening in it.
    """
    from scipy.ndimage import gaussian_filter1d

    pixels = view.to_pixels(outline)
    closed = np.vstack([pixels, pixels[:1]])
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1))])
    count = max(int(length[-1]), 16)
    even = np.linspace(0.0, length[-1], count, endpoint=False)
    points = np.stack([np.interp(even, length, closed[:, k]) for k in (0, 1)], axis=1)
    points = gaussian_filter1d(points, _SMOOTH_PX, axis=0, mode="wrap")
    along = np.roll(points, -1, axis=0) - np.roll(points, 1, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    normals = np.column_stack([along[:, 1], -along[:, 0]])
    sides = sampled(light, points, normals, _REACH_PX, _REACH_PX)
    normals = normals * (1.0 if np.median(sides[:, 2] - sides[:, 0]) > 0.0 else -1.0)
    shift = steepest(light, points, normals, _REACH_PX, 1.0, innermost=False)
    points = points + normals * shift[:, None]
    found = crossings(light, points, normals, _REACH_PX)
    blur = float(np.median(found.blur))
    if 4.0 * blur > _REACH_PX:
        found = crossings(light, points, normals, min(4.0 * blur, _FARTHEST_PX))
    return points + normals * found.place[:, None], found.good & (found.outer > found.inner)
