"""What all knobs have in common that change the data or the settings of both fits."""

from abc import ABC, abstractmethod
from collections.abc import Mapping

from scissorcal.bench.trade.case import Case
from scissorcal.bench.trade.fits import expected_fits_s, fits_errors, measure_fits
from scissorcal.bench.trade.point import Error, Sample, Setting
from scissorcal.bench.trade.torque import BAND_WORST


class FitKnob(ABC):
    """Both fits are made anew with a setting; errors are those of parameters and of torque."""

    error = BAND_WORST
    of_torque, stand_in, combined = True, True, True

    @abstractmethod
    def applied(self, case: Case, setting: Setting) -> Case:
        """The case with this setting."""

    def expected_s(self, case: Case, setting: Setting) -> float:
        """By the number of samples that the setting leaves, and by its effort."""
        return expected_fits_s(self.applied(case, setting))

    def repeats(self, case: Case, setting: Setting) -> int:
        """Once: equal data and equal random numbers give equal fits."""
        return 1

    def measure(self, case: Case, setting: Setting, repeat: int) -> Sample:
        """Both fits with this setting."""
        return measure_fits(self.applied(case, setting), repeat)

    def errors(self, case: Case, sample: Sample, reference: Sample | None) -> Mapping[str, Error]:
        """Of parameters and of torque, against the reference."""
        return fits_errors(case, sample, reference) if reference else {}
