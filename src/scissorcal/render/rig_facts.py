"""What is known of a rig before it renders: friction, inertia, delay, and where each comes from."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from scissorcal.errors import InputError
from scissorcal.kernel import Capability, Identity
from scissorcal.package import ModelPackage
from scissorcal.recording.probe import UNKNOWN_REST, ProbeResult, RestFacts
from scissorcal.render.admission_rule import LoopFacts

LATE_TICKS = 2.0
"""Where no probe measured the delay: one tick for line and host, one for the motor."""
SMALL_INERTIA_kg_m2 = 5e-5
"""Where neither fit nor probe has the inertia: of small scissors, which damping disturbs first."""


class Fitted(Protocol):
    """A fitted parameter, of a fit or of a package's record of one."""

    @property
    def name(self) -> str: ...
    @property
    def q05(self) -> float: ...
    @property
    def q50(self) -> float: ...


@dataclass(frozen=True)
class RigFacts:
    """What is known of the rig itself, None where nobody measured it; see LoopFacts.

    ``source`` says where friction and inertia come from, ``late_source`` the delay.
    ``rest`` is what a probe found of blades at rest.
    """

    coulomb_Nm: float | None = None
    damping_Nm_s_per_rad: float | None = None
    inertia_kg_m2: float | None = None
    late_s: float | None = None
    source: str = ""
    late_source: str = ""
    rest: RestFacts = UNKNOWN_REST


def rig_facts(package: ModelPackage) -> RigFacts:
    """Friction and inertia of the rig from the friction fit in a package; empty without one.

    Where the package renders a simpler friction than the fit's, or none, those of the fit count.
    """
    simplification = package.manifest.simplification
    own = simplification.rig_friction if simplification else None
    if own is not None:
        return RigFacts(
            coulomb_Nm=own.least_factor * _weakest(own.levels, "coulomb"),
            damping_Nm_s_per_rad=own.least_factor * _weakest(own.levels, "viscous"),
            inertia_kg_m2=own.inertia_kg_m2 or None,
            source="the package's friction fit",
        )
    record = package.manifest.provenance.friction
    if record is None:
        return RigFacts()
    least = float(package.tables.friction_angle.y.min())
    return fitted_facts(record.parameters, least, "the package's friction fit")


def fitted_facts(parameters: Sequence[Fitted], least: float, source: str) -> RigFacts:
    """Friction and inertia from a friction fit's parameters.

    Levels are the lower ends of the 90 % intervals, of the weaker direction, times ``least``, the
    least factor of friction over the scene's openings.
    """
    lower = {parameter.name: parameter.q05 for parameter in parameters}
    inertia = [parameter.q50 for parameter in parameters if parameter.name == "inertia"]
    return RigFacts(
        coulomb_Nm=least * _weakest(lower, "coulomb"),
        damping_Nm_s_per_rad=least * _weakest(lower, "viscous"),
        inertia_kg_m2=inertia[0] if inertia and inertia[0] > 0.0 else None,
        source=source,
    )


def with_probe(rig: RigFacts, probe: ProbeResult | None) -> RigFacts:
    """Add what a probe measured: its delay (upper end), blades at rest, and what nothing else has.

    Friction and inertia of a probe are rough, so a fit's count where there is one.
    """
    if probe is None:
        return rig
    found, name = replace(rig, rest=probe.rest), f"the probe of {probe.made_at}"
    if probe.delay_s is not None:
        found = replace(found, late_s=max(probe.delay_s.interval[1], 0.0), late_source=name)
    if found.coulomb_Nm is None and probe.coulomb_Nm is not None:
        viscous = probe.viscous_Nm_s_per_rad
        found = replace(
            found,
            coulomb_Nm=max(probe.coulomb_Nm.interval[0], 0.0),
            damping_Nm_s_per_rad=0.0 if viscous is None else max(viscous.interval[0], 0.0),
            source=name,
        )
    if found.inertia_kg_m2 is None and probe.inertia_kg_m2 is not None:
        found = replace(found, inertia_kg_m2=max(probe.inertia_kg_m2.mean, 0.0) or None)
    return found


def loop_facts(identity: Identity, rig: RigFacts) -> tuple[LoopFacts | None, tuple[str, ...]]:
    """Join what the device states and what is known of the rig; None without its friction."""
    if rig.coulomb_Nm is None:
        return None, ()
    tick_s = identity.tick_us * 1e-6
    late_s = LATE_TICKS * tick_s if rig.late_s is None else rig.late_s
    inertia = rig.inertia_kg_m2 or SMALL_INERTIA_kg_m2
    late = rig.late_source or f"assumed, {LATE_TICKS:g} ticks: no probe measured it"
    known = rig.source if rig.inertia_kg_m2 else "assumed, of small scissors"
    sources = (
        f"friction: {rig.coulomb_Nm * 1e3:.3g} mN m dry and "
        f"{(rig.damping_Nm_s_per_rad or 0.0) * 1e3:.3g} mN m s/rad viscous ({rig.source})",
        f"delay: {late_s * 1e3:.3g} ms ({late})",
        f"inertia: {inertia:.2g} kg m^2 ({known})",
        f"encoder step: {identity.opening_resolution:.2g} rad (device)",
    )
    return LoopFacts(
        tick_s=tick_s,
        late_s=late_s,
        inertia_kg_m2=inertia,
        damping_Nm_s_per_rad=rig.damping_Nm_s_per_rad or 0.0,
        coulomb_Nm=rig.coulomb_Nm,
        encoder_step_rad=identity.opening_resolution,
    ), sources


def _weakest(levels: dict[str, float], term: str) -> float:
    found = [value for name, value in levels.items() if name.startswith(term)]
    return max(0.0, min(found, default=0.0))


SAME = 0.01
"""Share by which a stated radius, limit or rate may differ: less is rounding in a device's tables,
and changes forces by less than a hand tells apart (7 %)."""

ALLOW = "--allow-mismatch"


def find_mismatch(
    package: ModelPackage, identity: Identity
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """How a device differs from the rig that a package is of: sentences.

    The first are those for which a rendering is refused: handle radius, name, serial number and
    limits; the second are only said. Raises InputError where the scene and the device have no
    opening in common, or nothing would be felt.
    """
    _refuse_impossible(package, identity)
    return _other_rig(package, identity), _notes(package, identity)


def refuse_other_rig(package: ModelPackage, identity: Identity) -> None:
    """Raise InputError, with each difference by name, where a package is of another rig."""
    differences = find_mismatch(package, identity)[0]
    if differences:
        raise InputError(
            f"The package {package.manifest.name} is of another rig. {' '.join(differences)} "
            "Capture, fit and build a package on this rig, or render this one all the same with "
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
