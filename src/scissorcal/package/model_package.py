"""A package in memory: torque, its band, and the kernel that the loop steps."""

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scissorcal.aliases import Array
from scissorcal.errors import InputError
from scissorcal.kernel import Kernel, ModelTables, Piece, PiecesModel
from scissorcal.package.archive import REMEDY, read_archive
from scissorcal.package.average import AverageTorque
from scissorcal.package.compile import kernel_tables
from scissorcal.package.exact import (
    ExactModel,
    FitDraws,
    central_model,
    exact_model,
    torque_quantiles,
)
from scissorcal.package.layer_pieces import kernel_pieces
from scissorcal.package.manifest import Manifest
from scissorcal.package.reach import reach_sentences
from scissorcal.package.records import CutRecord, FrictionRecord
from scissorcal.package.signature import against, signature_refusal
from scissorcal.recipe.schema import Recipe

ROUNDING = 1e-9
"""Share of a range's end by which a place may lie beyond it and still count as inside."""


class OutsideCoverageWarning(UserWarning):
    """A torque was asked for outside the ranges for which the package was built and checked."""


class FailedFitsWarning(UserWarning):
    """A package that was built from fits that failed checks is in use."""


@dataclass(frozen=True)
class ModelPackage:
    """A checked package: ``manifest`` says what it is, the methods evaluate it.

    ``arrays`` holds tables (3, knots) and draws (draws, parameters) by file name; ``source`` is
    the file it was read from.
    """

    manifest: Manifest
    arrays: Mapping[str, NDArray[Any]]
    source: str

    def __repr__(self) -> str:
        """One line: name, what it covers, error bound and source."""
        ranges, degrees = self.manifest.ranges, np.degrees(self.manifest.ranges.opening_rad)
        return (
            f"<package {self.manifest.name}: opening {degrees[0]:.3g} to {degrees[1]:.3g} deg, "
            f"rate {ranges.opening_rate_rad_per_s[0]:.3g} to "
            f"{ranges.opening_rate_rad_per_s[1]:.3g} rad/s, "
            f"contact {1e3 * ranges.contact_m[0]:.3g} to {1e3 * ranges.contact_m[1]:.3g} mm, "
            f"error bound {self.manifest.bound.stated_Nm:.2g} N m, {self.source}>"
        )

    def torque(self, opening: ArrayLike, opening_rate: ArrayLike, contact: ArrayLike) -> Array:
        """Torque in N m as felt on average, positive where it opens the blades.

        Evaluated by the kernel from the tables and held to the package's torque limit, so it is
        what the loop renders, ripple averaged out; ``manifest.bound`` says how far it may be from
        the exact model. Arguments (rad, rad/s, m) broadcast, and so does the result's shape. The
        crack settles first: at a contact where the material would not hold, the torque is that of
        the place where it does. Outside what the package `covers` the result has no stated error,
        and an OutsideCoverageWarning says by how much. Raises ValueError for arguments that are
        not finite.
        """
        opening, rate, contact = _broadcast(opening, opening_rate, contact)
        torque = self._limited(self.average.torque(opening, rate, contact))
        self._warn_outside(opening, rate, contact)
        return torque

    def band(
        self,
        opening: ArrayLike,
        opening_rate: ArrayLike,
        contact: ArrayLike,
        probability: float = 0.9,
    ) -> tuple[Array, Array]:
        """Equal-tailed interval that holds the torque with ``probability``: (low, high) in N m.

        Each posterior draw in the package is evaluated with the exact model, without tables, and
        held to the torque limit as in `torque`. Arguments broadcast. Warns as `torque` does.
        Raises ValueError unless 0 < probability < 1.
        """
        if not 0.0 < probability < 1.0:
            raise ValueError(f"probability must lie between 0 and 1, not {probability:g}")
        tail = 0.5 * (1.0 - probability)
        low, high = torque_quantiles(
            self._drawn, opening, opening_rate, contact, (tail, 1.0 - tail)
        )
        self._warn_outside(*_broadcast(opening, opening_rate, contact))
        return self._limited(low), self._limited(high)

    def kernel(self) -> Kernel:
        """A new kernel with the step that the loop runs, ripple included, its crack at 0."""
        return Kernel(self.tables)

    def simulate(
        self, opening: ArrayLike, opening_rate: ArrayLike, advance: ArrayLike
    ) -> NDArray[np.void]:
        """What the loop renders along a motion, tick by tick, on a fresh sheet or drawn plate.

        Arguments (rad, rad/s, m) broadcast to (n,); they are the places of successive ticks. Gives
        (n,) of the kernel's step (STEP_DTYPE): torque in N m and force along the cut in N before
        any limit, contact, energies. Of a drawn plate (``manifest.pieces``) it is the sum over
        its pieces, where `torque` and `band` are those of the calibrated sheet.

        >>> step = package.simulate(opening, rate, -0.02)  # doctest: +SKIP
        >>> step["torque"].max()  # doctest: +SKIP
        0.0612
        """
        model = PiecesModel(self.tables, self.pieces) if self.pieces else self.kernel()
        return model.step_many(opening, opening_rate, advance)

    def covers(
        self, opening: ArrayLike, opening_rate: ArrayLike, contact: ArrayLike
    ) -> NDArray[np.bool_]:
        """Whether places lie within the ranges for which the package was made and checked."""
        opening, rate, contact = _broadcast(opening, opening_rate, contact)
        inside = np.ones(opening.shape, dtype=np.bool_)
        for _, values, (low, high), _, _ in self._coordinates(opening, rate, contact):
            inside &= (low * (1.0 - ROUNDING) <= values) & (values <= high * (1.0 + ROUNDING))
        return inside

    def _coordinates(
        self, opening: Array, rate: Array, contact: Array
    ) -> tuple[tuple[str, Array, tuple[float, float], float, str], ...]:
        """Name, values, range, and what turns both into the unit that people read."""
        ranges = self.manifest.ranges
        return (
            ("opening", opening, ranges.opening_rad, float(np.degrees(1.0)), "deg"),
            ("rate", np.abs(rate), ranges.opening_rate_rad_per_s, 1.0, "rad/s"),
            ("contact", contact, ranges.contact_m, 1e3, "mm"),
        )

    def _warn_outside(self, opening: Array, rate: Array, contact: Array) -> None:
        inside = self.covers(opening, rate, contact)
        if inside.all():
            return
        parts = []
        for name, values, (low, high), scale, unit in self._coordinates(opening, rate, contact):
            beyond = np.maximum(low - values, values - high)
            worst = np.unravel_index(int(np.argmax(beyond)), beyond.shape)
            if beyond[worst] > ROUNDING * high:
                parts.append(
                    f"{name} {scale * values[worst]:.3g} {unit} is {scale * beyond[worst]:.2g} "
                    f"{unit} outside {scale * low:.3g} to {scale * high:.3g} {unit}"
                )
        warnings.warn(
            f"{int(np.sum(~inside))} of {inside.size} places lie outside what the package "
            f"{self.manifest.name} covers ({'; '.join(parts)}). The torque there has no stated "
            "error: widen the scene in the recipe and build the package again.",
            OutsideCoverageWarning,
            stacklevel=3,
        )

    @cached_property
    def tables(self) -> ModelTables:
        """What the loop's kernel evaluates."""
        return kernel_tables(self.manifest.mechanics, self.manifest.ranges, self.arrays)

    @cached_property
    def pieces(self) -> tuple[Piece, ...]:
        """The drawn plate along the cut, as the loop steps it; none of a uniform sheet."""
        return kernel_pieces(self.manifest.pieces) if self.manifest.pieces else ()

    @cached_property
    def recipe(self) -> Recipe:
        """The recipe that it was built from; InputError where the manifest's text is none."""
        from scissorcal.package.stated_recipe import stated_recipe

        return stated_recipe(self.manifest.provenance)

    @cached_property
    def exact(self) -> ExactModel:
        """The exact model, in float64, that the tables were compiled from."""
        record = self.manifest.provenance
        return central_model(
            _centre(record.cut), _centre(record.friction) if record.friction else None
        )

    @property
    def fit_warnings(self) -> tuple[str, ...]:
        """One sentence where the package was built from fits that failed checks, else none."""
        reasons = self.manifest.failed_checks
        if not reasons:
            return ()
        checks = "1 check" if len(reasons) == 1 else f"{len(reasons)} checks"
        return (
            f"The package {self.manifest.name} was built from fits that failed {checks}, so its "
            f"torque and its band may be wrong. {' '.join(reasons)}",
        )

    @property
    def warnings(self) -> tuple[str, ...]:
        """What to know before rendering this package, as sentences."""
        record = self.manifest.provenance
        left_out = record.cut.left_out + (record.friction.left_out if record.friction else ())
        beyond = reach_sentences(self.manifest.reach, record.cut.structure.response)
        fits = self.stated_warnings + self.fit_warnings
        return self.review_warnings + fits + left_out + beyond + self._step_warnings

    @property
    def stated_warnings(self) -> tuple[str, ...]:
        """A sentence where numbers were stated and not measured, else none."""
        record = self.manifest.provenance
        fits = {"cut": record.cut, "friction": record.friction}
        names = [name for name, fit in fits.items() if fit is not None and fit.stated]
        if not names:
            return ()
        return (
            f"The numbers of {' and '.join(names)} in the package {self.manifest.name} were "
            "stated, not measured: its band holds the stated standard deviations and nothing else.",
        )

    @property
    def _step_warnings(self) -> tuple[str, ...]:
        """A sentence where a step of the kernel takes longer than on other blades, else none."""
        if self.tables.release_falls:
            return ()
        knots = len(self.tables.edge.x)
        return (
            f"Along the blade of the package {self.manifest.name} the energy that a crack releases "
            "rises again at some opening of the scene, as behind a nick in the edge. To stop at "
            f"the first place, a step of the loop may look at all {knots} knots of the edge: up to "
            "5 us on a desktop, 32,000 instructions on a Cortex-M4F. If your processor has no time "
            "for that, photograph the edge again or fit a smoother family.",
        )

    @property
    def review_warnings(self) -> tuple[str, ...]:
        """Why its signature or review is not valid: missing, of something else, a rejection."""
        return self.against_review()

    def against_review(self, trusted: Sequence[str] | None = None) -> tuple[str, ...]:
        """The same where ``trusted`` public keys (OpenSSH) must have signed package and review."""
        manifest = self.manifest
        wrong = (
            signature_refusal(manifest, trusted),
            against(manifest.review, manifest.fit_hashes, trusted),
        )
        return tuple(f"The package {manifest.name} {why}." for why in wrong if why)

    @property
    def draws(self) -> int:
        """Number of posterior draws in the band."""
        return len(self.arrays["draws/cut.npy"])

    @cached_property
    def average(self) -> AverageTorque:
        """The average torque from the tables: what `torque` evaluates."""
        return AverageTorque(self.manifest.mechanics, self.manifest.ranges, self.arrays)

    def _limited(self, torque: Array) -> Array:
        limit = self.manifest.limits.torque_Nm
        return np.clip(torque, -limit, limit)

    @cached_property
    def _drawn(self) -> ExactModel:
        record = self.manifest.provenance
        return exact_model(
            record_draws(record.cut, self.arrays["draws/cut.npy"]),
            None
            if record.friction is None
            else record_draws(record.friction, self.arrays["draws/friction.npy"]),
        )


def open_package(path: Path | str, *, warn: bool = True) -> ModelPackage:
    """Open a package file, checking everything in it before anything is used.

    A package that was built from fits that failed checks gives a FailedFitsWarning with the
    checks' names; ``warn=False`` is for callers who show ``warnings`` themselves. Raises
    MissingError where there is no file, InputError where it is no package, was changed, or states
    what cannot be. Nothing in a package is executed or unpacked to disk.

    >>> package = open_package("package/paper-80gsm.zip")  # doctest: +SKIP
    >>> package.torque(opening=0.5, opening_rate=-0.2, contact=0.03)  # doctest: +SKIP
    array(0.0307)
    """
    from scissorcal.package.stated_recipe import refuse_contradictions

    path = Path(path)
    manifest, arrays = read_archive(path)
    package = ModelPackage(manifest, arrays, str(path))
    records = {"cut": manifest.provenance.cut, "friction": manifest.provenance.friction}
    for what, record in records.items():
        if record and arrays[f"draws/{what}.npy"].shape[1] != len(record.parameters):
            raise InputError(
                f"{path}, member 'draws/{what}.npy' has another number of columns than the {what} "
                f"fit has parameters. {REMEDY}"
            )
    try:
        _ = package.tables, package.exact, package.average, package.kernel(), package.pieces
        _ = package._drawn
    except Exception as error:
        raise InputError(
            f"{path}: its tables and parameters do not form a model ({error}). {REMEDY}"
        ) from error
    try:
        refuse_contradictions(manifest, package.recipe, package.exact)
    except InputError as error:
        raise InputError(f"{path}: {error}. {REMEDY}") from None
    for sentence in package.fit_warnings if warn else ():
        warnings.warn(sentence, FailedFitsWarning, stacklevel=2)
    return package


def _broadcast(*values: ArrayLike) -> tuple[Array, ...]:
    return tuple(np.broadcast_arrays(*(np.asarray(value, dtype=np.float64) for value in values)))


def _centre(record: CutRecord | FrictionRecord) -> FitDraws:
    values = [[parameter.value for parameter in record.parameters]]
    return record_draws(record, np.array(values))


def record_draws(record: CutRecord | FrictionRecord, draws: Array) -> FitDraws:
    """The law of a package's fit at draws (draws, parameters) of its parameters."""
    names = tuple(parameter.name for parameter in record.parameters)
    return FitDraws(record.structure.model_dump(), names, draws)
