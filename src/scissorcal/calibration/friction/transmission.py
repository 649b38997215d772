"""Two-ended tools: the load at the jaws from torque and angle at the drive, by a friction law.

The recordings' ``motor_torque`` T is that of the driven end, ``handle_radius`` times
``handle_force`` the load L. The law says

    T - L = inertia * acceleration + offset + F0 + (load_gain + z A load_share sgn(L)) L

with F0 the friction of the unloaded joint, z its direction and A its factor of place (see
:class:`scissorcal.model.FrictionLaw`), so that L follows from T in closed form. At rest friction
keeps the direction in which it was built up; where a recording begins, that is not known, and the
first way of ``presliding_length`` is a guess.
"""

from dataclasses import replace

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.friction.columns import FrictionBasis
from scissorcal.calibration.result import FitResult
from scissorcal.calibration.signals.weak_form import Windows, weigh
from scissorcal.errors import InputError
from scissorcal.model.friction_terms import needs_load, terms_of
from scissorcal.recording.recording import Recording

CREEP = 1e-9
"""Rate (rad/s) that stands for rest: the direction of friction stays, and no more than that."""


def two_ended(fit: FitResult, recordings: tuple[Recording, ...], cutoff_Hz: float) -> Windows:
    """Weigh recordings of both ends, at rest with friction as it was built up.

    Raises InputError for a law without load, or recordings without both ends.
    """
    if not needs_load(str(fit.structure["law"])):
        raise InputError(
            f'The law "{fit.candidate}" has no load: fit one that does (fit.friction.law with '
            '"+load") to recordings of both ends.'
        )
    every = weigh(recordings, cutoff_Hz)
    if every.load is None:
        sources = ", ".join(recording.source or "the recording" for recording in recordings)
        raise InputError(f"{sources}: there is no second end (handle_force and handle_radius).")
    return _resting_as_built_up(every)


class LoadSolver:
    """Solves a law for the load (n,): it is linear in the load on either side of zero."""

    def __init__(self, fit: FitResult, windows: Windows) -> None:
        terms = terms_of(str(fit.structure["law"]), tuple(fit.structure.get("adopt", ())))
        center = float(fit.structure["angle_center"])
        assert windows.load is not None
        self.bins = windows.bins
        self.driven = windows.bins.drive + windows.average(windows.load)
        self.bases = [
            FrictionBasis(replace(windows, load=np.full_like(windows.rate, load)), center, terms)
            for load in (-1.0, 0.0, 1.0)
        ]

    def __call__(self, values: dict[str, Array]) -> Array:
        """Load (n,) that goes with the driven end's torque."""
        pulled, empty, pushed = (basis(values) for basis in self.bases)
        inert = values["inertia"] * self.bins.acceleration + values.get("offset", np.asarray(0.0))
        left = self.driven - inert - empty
        return np.asarray(
            np.where(left >= 0, left / (1.0 + pushed - empty), left / (1.0 + empty - pulled))
        )


def _resting_as_built_up(windows: Windows) -> Windows:
    """Let the rate creep in the last certain direction where its own sign is not certain."""
    certain = np.abs(windows.rate) > windows.bins.rate_floor
    index = np.maximum.accumulate(np.where(certain, np.arange(len(certain)), 0))
    direction = np.sign(windows.rate[index])
    rate = np.where(np.sign(windows.rate) == direction, windows.rate, CREEP * direction)
    return replace(windows, rate=rate)
