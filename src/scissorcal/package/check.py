"""Check a package by itself: open it, and test what it states."""

from pathlib import Path

import numpy as np

from scissorcal.package.bound import deviation
from scissorcal.package.grid import spread_points
from scissorcal.package.model_package import ModelPackage, open_package
from scissorcal.verdicts import Status, Verdict

SCOPE = "package"
REVIEW_CHECK = "review"
FITS_CHECK = "failed fits"
GRID_POINTS = 13_337
"""Differs from the count of the bound's points, so that the points differ."""

CENTRE_POINTS = 300
IN_BAND = 0.9
EXTREME_STEPS = 4_000


def check_package(path: Path | str) -> tuple[Verdict, ...]:
    """Open a package and judge it: error bound, extremes, centre, fits, review.

    Raises MissingError or InputError where the file cannot even be opened as a package.
    """
    return package_verdicts(open_package(path, warn=False))


def package_verdicts(package: ModelPackage) -> tuple[Verdict, ...]:
    """Judge a package in memory; each verdict gives the check and the reason."""
    return (
        *_bound(package),
        _extremes(package),
        _centre(package),
        _fits(package),
        _review(package),
    )


def _bound(package: ModelPackage) -> tuple[Verdict, Verdict]:
    manifest, stated = package.manifest, package.manifest.bound
    found = deviation(
        package.exact,
        package.average,
        manifest.ranges,
        manifest.limits.torque_Nm,
        GRID_POINTS,
        stated.from_rate_rad_per_s,
    )
    holds = found.largest <= stated.stated_Nm
    opening, rate, contact = found.where
    why = (
        f"At {found.points} independent test points the kernel is within {found.largest:.2g} N m "
        f"of the model (limit {stated.stated_Nm:.2g} N m; worst at opening "
        f"{np.degrees(opening):.1f} deg, rate {rate:.2g} rad/s, contact {contact * 1e3:.1f} mm)."
    )
    kept = Verdict(
        SCOPE, "bound", "pass" if holds else "fail", found.largest, stated.stated_Nm, why
    )
    small = stated.share <= stated.allowed_share
    why = (
        f"The stated bound is {stated.share:.3%} of the scene's largest torque "
        f"({stated.scene_torque_Nm:.3g} N m); the tables may use {stated.allowed_share:.2%}."
    )
    if not small:
        why += " Narrow the scene's ranges in the recipe, or raise its tolerance."
    share = Verdict(
        SCOPE, "bound share", "pass" if small else "fail", stated.share, stated.allowed_share, why
    )
    return kept, share


def _extremes(package: ModelPackage) -> Verdict:
    """Step the kernel with inputs as of a broken rig; count outputs that are not finite."""
    kernel = package.kernel()
    rng = np.random.default_rng(1)
    size = rng.choice([0.0, 1e-30, 1e-6, 1e-3, 0.03, 0.5, 3.0, 1e3, 1e30], (3, EXTREME_STEPS))
    inputs = size * rng.choice([-1.0, 1.0], size.shape)
    inputs[rng.integers(0, 3, 60), rng.integers(0, EXTREME_STEPS, 60)] = np.nan
    inputs[rng.integers(0, 3, 60), rng.integers(0, EXTREME_STEPS, 60)] = np.inf
    out = kernel.step_many(*inputs)
    bad = int(np.sum(~np.isfinite(out["torque"]) | ~np.isfinite(out["force"])))
    status: Status = "pass" if bad == 0 else "fail"
    why = f"{bad} of {EXTREME_STEPS} steps with extreme inputs gave an output that is not finite."
    return Verdict(SCOPE, "extremes", status, float(bad), 0.0, why)


def _centre(package: ModelPackage) -> Verdict:
    """Whether the rendered torque lies within the posterior's band."""
    manifest = package.manifest
    points = spread_points(
        manifest.ranges, CENTRE_POINTS, slowest=manifest.bound.from_rate_rad_per_s
    )
    where = (points.opening, points.opening_rate, points.contact)
    limit = manifest.limits.torque_Nm
    torque = np.clip(package.exact.torque(*where), -limit, limit)
    low, high = package.band(*where, probability=0.98)
    slack = manifest.bound.stated_Nm
    inside = float(np.mean((torque >= low - slack) & (torque <= high + slack)))
    status: Status = "pass" if inside >= IN_BAND else "fail"
    why = (
        f"The rendered torque lies within the posterior's 98 % band at {inside:.0%} of the scene's "
        f"points ({package.draws} draws)."
    )
    if status == "fail":
        why += (
            " The fit's best point is not typical of its posterior: run 'scissorcal fit --effort "
            "thorough'."
        )
    return Verdict(SCOPE, "centre", status, inside, IN_BAND, why)


def _fits(package: ModelPackage) -> Verdict:
    count = len(package.manifest.failed_checks)
    if not count:
        why = "Every fit in the package passed its checks."
        return Verdict(SCOPE, FITS_CHECK, "pass", 0.0, 0.0, why)
    return Verdict(SCOPE, FITS_CHECK, "fail", float(count), 0.0, " ".join(package.fit_warnings))


def _review(package: ModelPackage) -> Verdict:
    review = package.manifest.review
    against = " ".join(package.review_warnings)
    if review is None:
        return Verdict(SCOPE, REVIEW_CHECK, "not_evaluated", None, None, against)
    if against:
        return Verdict(SCOPE, REVIEW_CHECK, "fail", 0.0, 1.0, against)
    why = f"The report of its fits was {review.words}."
    return Verdict(SCOPE, REVIEW_CHECK, "pass", 1.0, 1.0, why)
