"""Pictures of a fit, drawn with matplotlib into axes that are given or new ones."""

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.friction.curve import friction_curve, partial_residuals
from scissorcal.errors import InputError, needs_extra

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from scissorcal.calibration import FitResult

MOST_POINTS = 5000
"""Points of a scatter plot: more make its file large and show nothing more."""
MOST_PAIRED = 6
"""Parameters of a pair plot where none are named: the first ones."""
DATA: dict[str, Any] = {"s": 3.0, "linewidths": 0.0, "color": "tab:gray", "alpha": 0.5}
BINS = 40
GAP = 5.0
"""Steps of time from which on a line of the model is interrupted."""


class FitPlots:
    """Pictures of one fit, as ``fit.plot``.

    Each draws into ``axes``, a new figure's where none are given, and returns them, so that titles,
    limits and files are matplotlib's: ``fit.plot.torque().figure.savefig("torque.png")``. Raises
    InputError where matplotlib is not installed.
    """

    def __init__(self, fit: "FitResult") -> None:
        self._fit = fit

    def friction_curve(self, axes: "Axes | None" = None) -> "Axes":
        """Draw friction over the rate with its band, and what was measured less all but friction.

        The band is 5 to 95 % of the posterior, at the middle opening. Raises InputError for a cut.
        """
        fit, curve = self._fit, friction_curve(self._fit)
        if curve is None:
            raise InputError(
                f"This fit of {fit.what} has no friction curve: draw that of the fit of friction, "
                "or fit.plot.torque()."
            )
        axes = axes or _new_axes()
        rate, measured = _thinned(fit.series.opening_rate, partial_residuals(fit))
        axes.scatter(rate, measured, label="measured", **DATA)
        slower, faster = curve.rate < 0.0, curve.rate > 0.0
        for way, label in ((slower, "fit, 5 to 95 %"), (faster, None)):
            axes.fill_between(
                curve.rate[way], curve.low[way], curve.high[way], color="tab:blue", alpha=0.4
            )
            axes.plot(curve.rate[way], curve.friction[way], color="tab:blue", label=label)
        axes.set_xlabel(f"rate ({fit.position_unit}/s)")
        axes.set_ylabel(f"friction ({fit.effort_unit})")
        axes.legend(frameon=False, markerscale=3.0)
        return axes

    def torque(self, axes: "Axes | None" = None) -> "Axes":
        """Draw measured torque and the model with its band over the opening, stroke by stroke.

        The measured torque is band-limited as the likelihood uses it.
        """
        fit, series = self._fit, self._fit.series
        axes = axes or _new_axes()
        opening, measured = _thinned(series.opening, series.measured)
        axes.scatter(opening, measured, label="measured", **DATA)
        for index, way in enumerate(self._ways()):
            place = series.opening[way]
            low, high = series.band_low[way], series.band_high[way]
            axes.fill_between(place, low, high, color="tab:blue", alpha=0.2, linewidth=0.0)
            label = "model, 5 to 95 %" if index == 0 else None
            axes.plot(place, series.predicted[way], color="tab:blue", linewidth=0.7, label=label)
        axes.set_xlabel(f"opening ({fit.position_unit})")
        axes.set_ylabel(self._effort)
        axes.legend(frameon=False, markerscale=3.0)
        return axes

    def residuals(self, axes: "Axes | None" = None) -> "Axes":
        """Draw measured minus model over the opening, closing and opening strokes apart."""
        fit, series = self._fit, self._fit.series
        axes = axes or _new_axes()
        left = series.measured - series.predicted
        for sign, label, colour in ((-1.0, "closing", "tab:red"), (1.0, "opening", "tab:blue")):
            way = np.sign(series.opening_rate) == sign
            opening, residual = _thinned(series.opening[way], left[way])
            axes.scatter(opening, residual, label=label, **{**DATA, "color": colour})
        axes.axhline(0.0, color="black", linewidth=0.8)
        axes.set_xlabel(f"opening ({fit.position_unit})")
        axes.set_ylabel(f"measured minus model ({fit.effort_unit})")
        axes.legend(frameon=False, markerscale=3.0)
        return axes

    def pairs(self, names: Sequence[str] = ()) -> Any:
        """Draw the draws of each two parameters, and the histogram of each; an array of axes.

        The first six parameters where none are named. Raises UnknownNameError for another name.
        """
        fit = self._fit
        chosen = tuple(names) or tuple(p.name for p in fit.parameters[:MOST_PAIRED])
        draws = {name: fit.sample(name) for name in chosen}
        pyplot, count = _pyplot(), len(chosen)
        side = 2.0 * count + 1.0
        figure, grid = pyplot.subplots(
            count, count, figsize=(side, side), squeeze=False, layout="constrained"
        )
        for row, name in enumerate(chosen):
            for column, other in enumerate(chosen):
                axes = grid[row, column]
                if column > row:
                    axes.set_visible(False)
                elif column == row:
                    axes.hist(draws[name], bins=BINS, color="tab:blue")
                    axes.set_yticks([])
                else:
                    axes.scatter(*_thinned(draws[other], draws[name]), **DATA)
                axes.ticklabel_format(scilimits=(-2, 3))
                axes.tick_params(labelsize="small")
                if row == count - 1:
                    axes.set_xlabel(f"{other}\n({fit[other].unit})")
                if column == 0 and row > 0:
                    axes.set_ylabel(f"{name}\n({fit[name].unit})")
        figure.align_labels()
        return grid

    @property
    def _effort(self) -> str:
        quantity = "torque" if self._fit.effort_unit == "N m" else "force"
        return f"{quantity} ({self._fit.effort_unit})"

    def _ways(self) -> list[slice]:
        """Runs of points that follow each other in time, in one stroke and one direction."""
        series = self._fit.series
        step = np.diff(series.time_s)
        usual = float(np.median(step[step > 0.0])) if np.any(step > 0.0) else 0.0
        ends = (np.diff(series.recording) != 0) | (np.diff(series.stroke) != 0)
        ends |= np.diff(np.sign(series.opening_rate)) != 0
        ends |= (step > GAP * usual) | (step < 0.0)
        bounds = [0, *(np.flatnonzero(ends) + 1).tolist(), len(series.time_s)]
        return [slice(start, end) for start, end in pairwise(bounds) if end - start > 1]


def _pyplot() -> Any:
    try:
        from matplotlib import pyplot
    except ImportError:
        raise needs_extra("fit.plot", "matplotlib", "plots", "draw fit.series yourself") from None
    return pyplot


def _new_axes() -> "Axes":
    axes: Axes = _pyplot().subplots(figsize=(6.0, 3.6), layout="constrained")[1]
    return axes


def _thinned(across: Array, up: Array) -> tuple[Array, Array]:
    """Two columns (n,), of which no more than ``MOST_POINTS`` rows are left, evenly."""
    step = max(1, -(-len(across) // MOST_POINTS))
    return across[::step], up[::step]
