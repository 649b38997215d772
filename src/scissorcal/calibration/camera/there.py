"""How well a camera is known where a measured thing stands in its picture."""

from dataclasses import dataclass

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.camera.result import PixelMap
from scissorcal.verdicts import Check, Verdict


@dataclass(frozen=True)
class CameraThere:
    """The camera's standard error at the pixels of a thing, in pixels and in metres on the thing.

    A part of the picture where no corner of the camera's board was seen is extrapolated. That does
    harm to what stands there, and to nothing else: so the share of the picture that is covered is
    no verdict on a camera, and this is one on each thing that is measured with it.
    """

    worst_px: float
    worst_m: float

    @classmethod
    def of(cls, places: PixelMap, pixels: Array, px_per_m: float) -> "CameraThere":
        """Of a thing that shows pixels (n, 2), with so many of them to a metre of it."""
        worst = places.worst_px(pixels)
        return cls(worst, worst / px_per_m)

    def verdict(self, check: Check, why: str = "") -> Verdict:
        """Judge by a check whose limit a camera's fit has where corners were seen."""
        known = np.isfinite(self.worst_px)
        place = (
            f"The camera is known there to {self.worst_px:.2g} px at worst, "
            f"{1e3 * self.worst_m:.2g} mm (limit {check.threshold:g} px)."
            if known
            else "The camera is not known at all where a part of it lies in the picture."
        )
        good = f"{why} {place}".lstrip()
        bad = (
            f"{place} It was fitted without a corner in that part of the picture: put this nearer "
            "to the middle, or add photographs of the camera board there and run 'scissorcal fit "
            "camera'."
        )
        return check.judge(self.worst_px if known else 1e6, good, bad)
