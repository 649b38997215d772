"""What people ask of a fit in Python: its table, one parameter, draws, a prediction, pictures."""

from typing import TYPE_CHECKING, Any, cast

from numpy.typing import ArrayLike, NDArray

from scissorcal.errors import UnknownNameError, check_known, needs_extra, unknown_name

if TYPE_CHECKING:
    import numpy as np
    import xarray

    from scissorcal.calibration import (
        FitPlots,
        FitResult,
        FitSummary,
        FittedParameter,
        TorqueBand,
    )


class FitViews:
    """Views of a fit of friction or of a cut; each loads what it needs when it is asked for."""

    @property
    def _fit(self) -> "FitResult":
        """This object, as the type that it is part of."""
        return cast("FitResult", self)

    def __getitem__(self, name: str) -> "FittedParameter":
        """Give one parameter by name, derived and nuisance parameters among them.

        It has ``mean``, ``sd``, ``interval`` (5 and 95 %) and ``unit``. UnknownNameError (a
        KeyError) names the nearest name.

        >>> from scissorcal import examples, fit_friction
        >>> fit = fit_friction(examples.load("friction"), effort="draft")
        >>> fit["inertia"].unit
        'kg m^2'
        >>> fit["inertai"]
        Traceback (most recent call last):
        scissorcal.errors.UnknownNameError: "inertai" is no parameter of this fit of friction. \
Did you mean "inertia"?
        """
        everything = self._everything
        for parameter in everything:
            if parameter.name == name:
                return parameter
        names = [parameter.name for parameter in everything]
        raise UnknownNameError(
            unknown_name(f"parameter of this fit of {self._fit.what}", name, names)
        )

    def __contains__(self, name: object) -> bool:
        return any(parameter.name == name for parameter in self._everything)

    @property
    def _everything(self) -> "tuple[FittedParameter, ...]":
        fit = self._fit
        return (*fit.parameters, *fit.derived, *fit.nuisance)

    def sample(self, name: str) -> "NDArray[np.float64]":
        """Give the posterior draws (draws,) of one parameter, in its unit.

        Draws of all parameters belong together row by row: ``fit.sample("a") *
        fit.sample("b")`` are draws of the product. Raises UnknownNameError.
        """
        self[name]
        fit = self._fit
        groups = (
            (fit.parameters, fit.draws),
            (fit.derived, fit.derived_draws),
            (fit.nuisance, fit.nuisance_draws),
        )
        for parameters, draws in groups:
            names = [parameter.name for parameter in parameters]
            if name in names and draws is not None:
                return draws[:, names.index(name)]
        raise UnknownNameError(f"This fit keeps no draws of {name}, only its summary.")

    def summary(self, probability: float = 0.9) -> "FitSummary":
        """Sum up the fit: a row for each parameter, and how far the draws may be trusted.

        ``print(fit.summary())`` shows a table, a notebook shows it as HTML; iterate over it for
        rows, or take one by name: ``fit.summary()["kappa"].sd``. ``probability`` is that of the
        narrowest interval (hdi). Mean and sd are None where tails are so heavy that they say
        something else than the quantiles do; the median is always there.
        Raises InputError for a probability outside 0 to 1.
        """
        from scissorcal.calibration import summary_of

        return summary_of(self._fit, probability)

    def predict(
        self,
        opening: ArrayLike,
        rate: ArrayLike,
        acceleration: ArrayLike = 0.0,
        *,
        contact: ArrayLike | None = None,
        probability: float = 0.9,
    ) -> "TorqueBand":
        """Predict torque at openings (rad) and rates (rad/s), with the band of the posterior.

        Of friction: the drive's torque of empty motion, that of the fitted law: inertia times
        ``acceleration`` (rad/s^2), friction of long strokes and offset (m and so on for a linear
        joint). Of a cut: the material's torque, positive where it resists closing, averaged over
        teeth, where the crack stands ``contact`` metres from the pivot (its place in the sheet less
        the advance) and has run on until it rests. Without ``contact`` the blades cut: the crack
        stands where it just rests, and where none can rest there is no torque. With friction the
        blades feel ``cut.predict(opening, rate).torque - friction.predict(opening, rate).torque``
        plus the fitted offset, which is the sensor's; a package's torque() and band() have both.

        All arguments broadcast. The band is that of the mean, without the sensor's noise and
        without what a new recording may differ by: `scissorcal predict` has a band for new
        recordings of empty motion. Raises InputError where an argument is not of this fit.
        """
        from scissorcal.calibration import predict_torque

        return predict_torque(self._fit, (opening, rate, acceleration), probability, contact)

    @property
    def plot(self) -> "FitPlots":
        """Pictures of this fit: ``fit.plot.torque()`` and others; needs matplotlib."""
        from scissorcal.calibration import FitPlots

        return FitPlots(self._fit)

    def to_datatree(self) -> "xarray.DataTree":
        """Give the fit as an xarray.DataTree with ArviZ' groups, as in its file.

        ``posterior``, ``prior``, ``observed_data`` and so on have the unit of each variable among
        its attributes. Raises InputError where xarray is not installed.
        """
        try:
            import xarray
        except ImportError:
            way_out = "use fit.sample(name), a NumPy array"
            raise needs_extra("to_datatree()", "xarray", "analysis", way_out) from None
        import tempfile
        from pathlib import Path

        from scissorcal.calibration import save

        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "fit.nc"
            save(self._fit, path)
            return xarray.open_datatree(path, engine="h5netcdf").load()

    def _repr_html_(self) -> str:
        return self.summary()._repr_html_()


def check_effort(effort: Any) -> None:
    """UnknownNameError, naming the nearest, unless ``effort`` is one that fits have."""
    check_known("effort of a fit", effort, ("draft", "standard", "thorough"))
