"""Check a package by itself: open it, and test what it states."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from scissorcal.package.bound import SearchGrid, deviation
from scissorcal.package.grid import spread_points
from scissorcal.package.model_package import ModelPackage, open_package
from scissorcal.package.signature import against as review_refusal
from scissorcal.package.signature import signature_refusal, signer_words, unasked_words
from scissorcal.verdicts import STATED, TORQUE, Check, Verdict

GRID_POINTS = 13_337
"""Differs from the count of the bound's points, so that the points differ."""

CENTRE_POINTS = 300
EXTREME_STEPS = 4_000
BOUND = Check("package bound", f"{TORQUE}error of the tables over the scene, N m", at_most=STATED)
BOUND_SHARE = Check(
    "package bound share", f"{TORQUE}error of the tables over the largest torque", at_most=STATED
)
EXTREMES = Check("package extremes", "the motors: steps that gave no number", at_most=0.0)
CENTRE = Check(
    "package centre", f"{TORQUE}share of the scene that lies in the posterior's band", at_least=0.9
)
FAILED_FITS = Check(
    "package failed fits", "what the package is made from: checks that its fits failed", at_most=0.0
)
REVIEW = Check("package review", "whether the report was accepted: 1 if so", at_least=1.0)
SIGNATURE = Check(
    "package signature", "whether a trusted key signed what is rendered: 1 if so", at_least=1.0
)


def check_package(
    package: ModelPackage | Path | str, trusted: Sequence[str] | None = None
) -> tuple[Verdict, ...]:
    """Judge a package, open or in a file: `check_built`, and whose signature it has.

    ``trusted`` are public keys (OpenSSH) of which one must have signed the package and one its
    review; None asks for none. Raises MissingError or InputError where the file cannot even be
    opened as a package.
    """
    if not isinstance(package, ModelPackage):
        package = open_package(package, warn=False)
    return (*check_built(package, trusted), _signature(package, trusted))


def check_built(package: ModelPackage, trusted: Sequence[str] | None = None) -> tuple[Verdict, ...]:
    """Judge what its builder cannot know beforehand: bound, extremes, centre, fits, review."""
    return (
        *_bound(package),
        _extremes(package),
        _centre(package),
        _fits(package),
        _review(package, trusted),
    )


def _bound(package: ModelPackage) -> tuple[Verdict, Verdict]:
    manifest, stated = package.manifest, package.manifest.bound
    found = deviation(
        package.exact,
        package.average,
        SearchGrid(manifest.ranges, GRID_POINTS, stated.from_rate_rad_per_s),
        manifest.limits.torque_Nm,
    )
    opening, rate, contact = found.where
    why = (
        f"At {found.points} independent test points the kernel is within {found.largest:.2g} N m "
        f"of the model (limit {stated.stated_Nm:.2g} N m; worst at opening "
        f"{np.degrees(opening):.1f} deg, rate {rate:.2g} rad/s, contact {contact * 1e3:.1f} mm)."
    )
    kept = BOUND.judge(found.largest, why, threshold=stated.stated_Nm)
    why = (
        f"The stated bound is {stated.share:.3%} of the scene's largest torque "
        f"({stated.scene_torque_Nm:.3g} N m); the tables may use {stated.allowed_share:.2%}."
    )
    remedy = f"{why} Narrow the scene's ranges in the recipe, or raise its tolerance."
    return kept, BOUND_SHARE.judge(stated.share, why, remedy, threshold=stated.allowed_share)


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
    why = f"{bad} of {EXTREME_STEPS} steps with extreme inputs gave an output that is not finite."
    return EXTREMES.judge(bad, why)


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
    why = (
        f"The rendered torque lies within the posterior's 98 % band at {inside:.0%} of the scene's "
        f"points ({package.draws} draws)."
    )
    remedy = (
        f"{why} The fit's best point is not typical of its posterior: run 'scissorcal fit --effort "
        "thorough'."
    )
    return CENTRE.judge(inside, why, remedy)


def _fits(package: ModelPackage) -> Verdict:
    passed, failed = "Every fit in the package passed its checks.", " ".join(package.fit_warnings)
    return FAILED_FITS.judge(len(package.manifest.failed_checks), passed, failed)


def _review(package: ModelPackage, trusted: Sequence[str] | None) -> Verdict:
    manifest = package.manifest
    review, against = manifest.review, review_refusal(manifest.review, manifest.fit_hashes, trusted)
    sentence = f"The package {manifest.name} {against}." if against else ""
    if review is None and trusted is None:
        return REVIEW.not_evaluated(sentence)
    why = ""
    if review is not None:
        whose = ", which you trust" if trusted is not None else ""
        why = f"The report of its fits was {review.words}; {review.identity_words}{whose}."
    return REVIEW.judge(0.0 if against else 1.0, why, sentence)


def _signature(package: ModelPackage, trusted: Sequence[str] | None) -> Verdict:
    """Whether a key signed what is here; without trusted keys, what nobody can tell from it."""
    manifest = package.manifest
    against = signature_refusal(manifest, trusted)
    if trusted is None and not against:
        return SIGNATURE.not_evaluated(unasked_words(manifest))
    whose = f"Its content is {signer_words(manifest)}, which you trust."
    sentence = f"The package {manifest.name} {against}."
    return SIGNATURE.judge(0.0 if against else 1.0, whose, sentence)
