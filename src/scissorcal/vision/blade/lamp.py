"""Where the lamp is: the side on which scissors have their cast shadow."""

import numpy as np

from scissorcal.vision.blade.scissors import Scissors
from scissorcal.vision.blade.silhouette import Silhouette

_LEAST_DARK, _MOST_DARK = 0.04, 0.6
_REACH = 0.12
_LEAST_LEAN = 0.2
"""Mean direction of penumbra from the silhouette, from 0 (alike on all sides) to 1, that counts."""


def lamp_direction(shape: Silhouette, scissors: Scissors) -> float | None:
    """The direction in which the shadow falls, in degrees from between the tips; None without one.

    Around the silhouette the sheet is darkened by the penumbra, on the side away from the lamp
    farther than on the other. Each darkened place counts with its darkness and its direction from
    the nearest place of the silhouette.
    """
    import cv2

    inside = (shape.mask > 0).astype(np.uint8)
    distance, nearest = cv2.distanceTransformWithLabels(
        1 - inside, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL
    )
    dark = 1.0 - cv2.GaussianBlur(shape.relative, (0, 0), 1.0)
    reach = _REACH * scissors.length / shape.pixel
    rows, columns = np.nonzero(
        (distance > 1.5) & (distance < reach) & (dark > _LEAST_DARK) & (dark < _MOST_DARK)
    )
    if len(rows) < 50 or not len(scissors.blades):
        return None
    places = np.zeros((int(nearest.max()) + 1, 2))
    own = np.nonzero(inside)
    places[nearest[own]] = np.column_stack([own[1], own[0]])
    away = np.column_stack([columns, rows]) - places[nearest[rows, columns]]
    weight = dark[rows, columns]
    total = float(np.sum(weight * np.linalg.norm(away, axis=1)))
    lean = np.sum(weight[:, None] * away, axis=0) / max(total, 1e-12)
    if float(np.linalg.norm(lean)) < _LEAST_LEAN:
        return None
    forward = np.sum([blade.axis for blade in scissors.blades], axis=0)
    turn = np.arctan2(lean[1], lean[0]) - np.arctan2(forward[1], forward[0])
    return float(np.degrees(turn) % 360.0)
