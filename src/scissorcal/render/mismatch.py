"""Whether a package is of this rig: what is refused, and what is only said."""

from dataclasses import dataclass

import numpy as np

from scissorcal.errors import InputError
from scissorcal.kernel import Capability, Identity
from scissorcal.package import ModelPackage

SAME = 0.01
"""Share by which a stated radius, limit or rate may differ: less is rounding in a device's tables,
and changes forces by less than a hand tells apart (7 %)."""

ALLOW = "--allow-mismatch"


@dataclass(frozen=True)
class Mismatch:
    """How a device differs from the rig that a package is of.

    ``other_rig`` are sentences for which a rendering is refused: handle radius, name, serial number
    and limits. ``notes`` are only said.
    """

    other_rig: tuple[str, ...]
    notes: tuple[str, ...]


def find_mismatch(package: ModelPackage, identity: Identity) -> Mismatch:
    """Compare a package with what a device states.

    Raises InputError where the scene and the device have no opening in common, or nothing would be
    felt.
    """
    _refuse_impossible(package, identity)
    return Mismatch(_other_rig(package, identity), _notes(package, identity))


def refuse_other_rig(package: ModelPackage, identity: Identity) -> None:
    """Raise InputError, with each difference by name, where a package is of another rig."""
    found = find_mismatch(package, identity).other_rig
    if found:
        raise InputError(
            f"The package {package.manifest.name} is of another rig. {' '.join(found)} Capture, "
            "fit and build a package on this rig, or render this one all the same with "
            f"{ALLOW}."
        )


def _refuse_impossible(package: ModelPackage, identity: Identity) -> None:
    manifest = package.manifest
    if manifest.mechanics.render == ("translation_force",) and not _has_advance(identity):
        raise InputError(
            f"The package {manifest.name} renders the translation force alone, and this device has "
            'no advance motor: nothing would be felt. Add "torque" to scene.render, or use a rig '
            "with an advance motor."
        )
    low, high = manifest.ranges.opening_rad
    if identity.opening_max <= low or identity.opening_min >= high:
        raise InputError(
            f"The package {manifest.name} is for openings of {np.degrees(low):.0f} to "
            f"{np.degrees(high):.0f} degrees, and this device moves between "
            f"{np.degrees(identity.opening_min):.0f} and {np.degrees(identity.opening_max):.0f}: "
            "build a package for this rig."
        )


def _other_rig(package: ModelPackage, identity: Identity) -> tuple[str, ...]:
    found = []
    radius = package.manifest.mechanics.handle_radius_m
    if not _is_same(identity.handle_radius, radius):
        found.append(
            f"The device states a handle radius of {identity.handle_radius * 1e3:.1f} mm and the "
            f"package was built for {radius * 1e3:.1f} mm: forces at the handles differ by this "
            "ratio."
        )
    rig = package.manifest.rig
    if rig is None:
        return tuple(found)
    if (rig.name, rig.serial) != (identity.name, identity.serial):
        found.append(
            f"Its recordings are of the rig {rig.name} {rig.serial}, and this is {identity.name} "
            f"{identity.serial}: friction and zeros are that rig's."
        )
    limits = (
        ("torque", "N m", rig.torque_limit_Nm, identity.torque_limit),
        ("force", "N", rig.force_limit_N, identity.force_limit),
    )
    found += [
        f"That rig's {what} limit was {was:g} {unit}, this one's is {now:g} {unit}."
        for what, unit, was, now in limits
        if not _is_same(was, now)
    ]
    return tuple(found)


def _notes(package: ModelPackage, identity: Identity) -> tuple[str, ...]:
    mechanics, found = package.manifest.mechanics, []
    if "translation_force" in mechanics.render and not _has_advance(identity):
        found.append(
            "The package renders a translation force, and this device has no advance motor "
            "(capability ADVANCE_MOTOR, force limit above 0): that force is not rendered."
        )
    rate = 1e6 / identity.tick_us
    if not _is_same(rate, mechanics.loop_rate_Hz):
        found.append(
            f"The device runs at {rate:.0f} Hz and the package was built for "
            f"{mechanics.loop_rate_Hz:.0f} Hz."
        )
    return tuple(found)


def _has_advance(identity: Identity) -> bool:
    return bool(identity.capabilities & Capability.ADVANCE_MOTOR) and identity.force_limit > 0


def _is_same(one: float, other: float) -> bool:
    return abs(one - other) <= SAME * max(abs(one), abs(other))
