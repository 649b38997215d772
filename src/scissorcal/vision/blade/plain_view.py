"""The mapping from pixels to a bare sheet: no mat, a camera that is held above it by hand."""

from dataclasses import dataclass, replace

import numpy as np

from scissorcal.aliases import Array
from scissorcal.recipe.photograph_priors import BladePriors

FOCAL_SHARE = 0.85
"""Focal length over the picture's longer side: 0.72 of a telephone's wide lens to 1.0 of a normal
one. It only turns a tilt into a change of scale across the picture."""


@dataclass(frozen=True)
class PlainView:
    """A photograph of a bare sheet: shapes up to similarity, or to scale with ``scale``.

    ``scale`` is metres per pixel, None where it is unknown. ``lean`` is the camera's tilt (rad,
    towards x and y of the picture) and the two components by which the tilt foreshortens lengths;
    ``lean_covariance`` (4, 4) is theirs. The sheet's unit is that of a pixel in the middle.
    """

    bounds: tuple[float, float, float, float]
    scale: float | None = None
    scale_share_sd: float = 0.0
    lean: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    lean_covariance: Array | None = None

    @classmethod
    def by_hand(
        cls, width: int, height: int, priors: BladePriors, scale: float | None = None
    ) -> "PlainView":
        """A picture of ``width`` by ``height`` pixels by a camera whose tilt has a prior only.

        Foreshortening is of second order: with tilts p and q it is (p^2 - q^2) / 4 and p q / 2.
        """
        unit = scale or 1.0
        tilt = np.radians(priors.tilt_sd_deg) ** 2
        covariance = np.diag([tilt, tilt, 0.25 * tilt**2, 0.25 * tilt**2])
        bounds = (0.0, 0.0, (width - 1) * unit, (height - 1) * unit)
        sd = 0.01 * priors.scale_sd_percent if scale else 0.0
        return cls(bounds, scale, sd, lean_covariance=covariance)

    @property
    def metric(self) -> bool:
        return self.scale is not None

    @property
    def uncertainty(self) -> str:
        tilt = np.degrees(np.hypot(*self.lean[:2]))
        seen = f"the blades' lengths suggest a tilt of {tilt:.1f} deg, which is allowed for"
        if self.scale is None:
            return f"No mat: the shape has no scale, and {seen}."
        return f"No mat: the scale is as stated, and {seen}."

    @property
    def values(self) -> Array:
        return np.array([*self.lean, 1.0])

    @property
    def covariance(self) -> Array:
        covariance = np.zeros((5, 5))
        if self.lean_covariance is not None:
            covariance[:4, :4] = self.lean_covariance
        covariance[4, 4] = self.scale_share_sd**2
        return covariance

    @property
    def shared(self) -> int:
        return 1

    @property
    def own_error(self) -> str:
        return "tilt"

    def leaning(self, lean: Array, covariance: Array) -> "PlainView":
        """The same view with another estimate of its tilt."""
        p, q, u, v = (float(value) for value in lean)
        return replace(self, lean=(p, q, u, v), lean_covariance=covariance)

    def to_sheet(self, pixels: Array, values: Array | None = None) -> Array:
        p, q, u, v, share = self.values if values is None else values
        middle, focal, unit = self._frame()
        n = (pixels - middle) / focal
        stretched = n @ np.array([[1.0 + u, v], [v, 1.0 - u]])
        depth = 1.0 - n @ np.array([p, q])
        return np.asarray((middle + focal * stretched / depth[:, None]) * (unit * share))

    def to_pixels(self, points: Array) -> Array:
        p, q, u, v, share = self.values
        middle, focal, unit = self._frame()
        m = (points / (unit * share) - middle) / focal
        # (S + m t') n = m, two by two for each point
        a, b = 1.0 + u + m[:, 0] * p, v + m[:, 0] * q
        c, d = v + m[:, 1] * p, 1.0 - u + m[:, 1] * q
        n = np.column_stack([d * m[:, 0] - b * m[:, 1], a * m[:, 1] - c * m[:, 0]])
        return np.asarray(middle + focal * n / (a * d - b * c)[:, None])

    def _frame(self) -> tuple[Array, float, float]:
        """Middle of the picture and focal length in pixels, and the size of a pixel."""
        unit = self.scale or 1.0
        size = np.array(self.bounds[2:]) / unit
        return 0.5 * size, FOCAL_SHARE * float(size.max() + 1.0), unit
