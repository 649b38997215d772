"""Gains of a motor-driven capture: from the recipe, from what a probe found, or typical ones."""

import math
from dataclasses import dataclass

from scissorcal.device.control import (
    Axis,
    Gains,
    Margins,
    PHASE_MARGIN_deg,
    greatest_fall,
    loop_margins,
)
from scissorcal.device.control_design import Demand, Design, StribeckFall, design_gains
from scissorcal.device.trajectory import SWING_ACCELERATION, largest_acceleration, sliding_speeds
from scissorcal.device.watching import STILL_RAD
from scissorcal.errors import DeviceError
from scissorcal.kernel import Identity
from scissorcal.recipe.pace import (
    ADVANCE_ACCELERATION,
    ADVANCE_SPEED,
    APPROACH_SPEED,
    TURN_ACCELERATION,
)
from scissorcal.recipe.schema import Recipe
from scissorcal.recording import Kind
from scissorcal.recording.probe import NORMAL_90, ProbeResult
from scissorcal.verdicts import STATED, Check, Verdict

OPENING_ERROR_RAD = 0.3
ADVANCE_ERROR_M = 0.02
"""A capture stops where the rig falls behind by more."""

CUTOFFS_PER_TICK = (1.0, 0.4, 0.2, 0.1)
"""Rate filters that are tried, in shares of the sampling rate: the first passes nearly all."""
COUNT_SHARE = 0.01
"""Share of the motor's limit by which a count of the encoder may change the effort in any case:
blades without dry friction may buzz so little."""
HELD_BACK = 3.0
"""Dry friction over the opening, and static friction, may hold three times what a probe found."""
ADVANCE_MASS_KG, ADVANCE_VISCOUS_N_s_per_m, ADVANCE_COULOMB_N = 0.8, 4.0, 0.8
ADVANCE_FACTOR = 2.0
"""A carriage with a pair of scissors, its guide and belt: no probe moves it, so it may weigh half
or double."""

TYPICAL_INERTIA_kg_m2, TYPICAL_COULOMB_Nm = 2e-4, 0.015
TYPICAL_INERTIA_SD_kg_m2 = TYPICAL_INERTIA_kg_m2 * math.log(2.0) / NORMAL_90
"""Of scissors whose inertia no probe told: it may be double or half of that, at 90 %."""
STRIBECK_FACTS = ("stribeck_Nm", "stribeck_rate_rad_per_s")
"""Facts of a probe that saw how friction falls with speed."""
CONTROL_MARGIN = Check(
    "device control margin",
    "whether the rig follows a capture without swinging: phase margin of its controller, degrees",
    at_least=PHASE_MARGIN_deg,
)
STEADY_SWEEPS = Check(
    "device steady sweeps",
    "friction at the slowest rates: rate in rad/s below which blades stick and slip",
    at_most=STATED,
)


@dataclass(frozen=True)
class Probed:
    """What a probe found of the opening axis, with standard deviations.

    ``delay_s``: from a measurement to the torque that answers it, through line, host and motor;
    None where the probe did not find it. ``missing`` names what it did not find: inertia and dry
    friction are a typical rig's then. ``stribeck`` is how friction falls with speed, None where
    only the bound of `StribeckFall.within` is known.
    """

    inertia_kg_m2: float
    inertia_sd_kg_m2: float
    viscous_Nm_s_per_rad: float
    coulomb_Nm: float
    delay_s: float | None
    missing: tuple[str, ...] = ()
    delay_sd_s: float = 0.0
    stribeck: StribeckFall | None = None

    @classmethod
    def of(cls, probe: ProbeResult | None) -> "Probed | None":
        """Of a probe; None without one."""
        if probe is None:
            return None
        inertia, delay, dry = probe.inertia_kg_m2, probe.delay_s, probe.coulomb_Nm
        found = {"inertia": inertia, "dry friction": dry, "delay": delay}
        missing = tuple(name for name, value in found.items() if value is None)
        viscous = probe.viscous_Nm_s_per_rad
        damping = 0.0 if viscous is None or inertia is None else viscous.mean
        return cls(
            TYPICAL_INERTIA_kg_m2 if inertia is None else inertia.mean,
            TYPICAL_INERTIA_SD_kg_m2 if inertia is None else inertia.sd,
            damping,
            TYPICAL_COULOMB_Nm if dry is None else dry.mean,
            None if delay is None else delay.mean,
            missing,
            0.0 if delay is None else delay.sd,
            _fall_of(probe),
        )

    @property
    def inertia_factor(self) -> float:
        """Factor by which the inertia may be other either way, at 90 %: ln inertia is normal."""
        return math.exp(NORMAL_90 * self.inertia_sd_kg_m2 / self.inertia_kg_m2)

    @property
    def latest_s(self) -> float:
        """Upper end of the delay's interval of 90 %."""
        return max(0.0, (self.delay_s or 0.0) + NORMAL_90 * self.delay_sd_s)

    @property
    def lack(self) -> str:
        """What the probe found and what not, and what to do; empty where it found all."""
        if not self.missing:
            return ""
        names = ("inertia", "dry friction", "delay")
        known = [name for name in names if name not in self.missing]
        found = f"The probe found {' and '.join(known)}" if known else "The probe found nothing"
        return (
            f"{found}, and could not tell {' and '.join(self.missing)}: free the blades or raise "
            "rig.probe.largest_torque_Nm and run 'scissorcal device probe' again, or state gains "
            "in rig.control."
        )


@dataclass(frozen=True)
class CaptureGains:
    """Gains of both axes and the rate filter; ``verdicts`` say how far they are from swinging.

    Blades that stand while the reference moves by ``still_rad`` are stuck, and not in dry friction.
    Sweeps of friction are steady from ``steady_from`` (rad/s) on, and known to stick and slip below
    ``sticks_below``; None and 0 where nothing is known of it.
    """

    opening: Gains
    advance: Gains
    rate_cutoff_Hz: float
    still_rad: float
    verdicts: tuple[Verdict, ...]
    steady_from: float | None = None
    sticks_below: float = 0.0


TYPICAL = CaptureGains(
    opening=Gains(6.0, 0.06, 20.0),
    advance=Gains(3000.0, 40.0, 10000.0),
    rate_cutoff_Hz=120.0,
    still_rad=STILL_RAD,
    verdicts=(
        CONTROL_MARGIN.not_evaluated(
            "The gains are those of a typical rig, which is answered within 1 ms: nothing was "
            "measured. Run 'scissorcal device probe', and they follow from the rig."
        ),
    ),
)
"""Where no probe tells inertia, friction and delay: for 2e-4 kg m^2, 0.8 kg and up to 1 ms, which
leaves 21 degrees of phase margin."""


def capture_gains(
    recipe: Recipe, identity: Identity, kind: Kind, probed: Probed | None
) -> CaptureGains:
    """Gains of a capture: numbers of the recipe first, then by design, else the typical ones.

    With ``probed``, gains keep 45 degrees and a factor of 2 at any inertia within the probe's
    interval of 90 % and the upper end of the delay's (``design_gains``); numbers of the recipe are
    judged by the same margins. Those of sweeps of friction slide steadily where friction falls with
    speed, as far as these margins allow. Raises DeviceError where gains of the recipe would make
    the loop swing, or where no gains can follow the plan because of the delay.
    """
    stated = _stated(recipe)
    if probed is None or probed.delay_s is None:
        opening, advance = (
            _merged(own, typical)
            for own, typical in zip(stated, (TYPICAL.opening, TYPICAL.advance), strict=True)
        )
        verdicts = TYPICAL.verdicts if probed is None else (_undelayed(probed),)
        return CaptureGains(opening, advance, TYPICAL.rate_cutoff_Hz, STILL_RAD, verdicts)
    axes = _axes(recipe, identity, probed)
    demands = _demands(recipe, kind, identity)
    cutoffs = tuple(share * 1e6 / identity.tick_us for share in CUTOFFS_PER_TICK)
    found: list[Gains] = []
    margins: list[Margins] = []
    stribeck = probed.stribeck or StribeckFall.within(probed.coulomb_Nm)
    fall = stribeck.steepest if kind == "friction" else 0.0
    for name, axis, demand, own in zip(("opening", "advance"), axes, demands, stated, strict=True):
        if all(value is not None for value in own):
            gains, at = Gains(*(float(value or 0.0) for value in own)), cutoffs[:1]
        else:
            design = _designed(
                axis, demand, cutoffs, name, probed.lack, fall if name == "opening" else 0.0
            )
            gains, at = _merged(own, design.gains), (design.axis.rate_cutoff_Hz,)
        cutoffs = at if name == "opening" else cutoffs
        filtered = axis.filtered(at[0])
        assumed = name == "opening" and "inertia" in probed.missing
        margins.append(
            loop_margins(filtered, gains) if assumed else _checked(filtered, gains, name)
        )
        found.append(gains)
    still = max(STILL_RAD, HELD_BACK * probed.coulomb_Nm / found[0].kp)
    margin = _verdict(margins, axes[0].delay_s, probed.lack)
    if kind != "friction":
        return CaptureGains(found[0], found[1], cutoffs[0], still, (margin,))
    stood = greatest_fall(axes[0].filtered(cutoffs[0]), found[0])
    steady = stribeck.steady_from(stood)
    slowest = min(recipe.capture.friction.speeds_rad_per_s)
    verdicts = (margin, _sliding(stribeck, stood, slowest))
    sticks = 0.0 if stribeck.rate is None else steady
    return CaptureGains(found[0], found[1], cutoffs[0], still, verdicts, steady, sticks)


def _stated(recipe: Recipe) -> tuple[tuple[float | None, ...], tuple[float | None, ...]]:
    """Numbers of the recipe for kp, kd and ki of opening and advance; None where it says "auto"."""
    control = recipe.rig.control
    rows = (
        (
            control.opening_kp_Nm_per_rad,
            control.opening_kd_Nm_s_per_rad,
            control.opening_ki_Nm_per_rad_s,
        ),
        (control.advance_kp_N_per_m, control.advance_kd_N_s_per_m, control.advance_ki_N_per_m_s),
    )
    opening, advance = (
        tuple(None if value == "auto" else float(value) for value in row) for row in rows
    )
    return opening, advance


def _merged(own: tuple[float | None, ...], other: Gains) -> Gains:
    kp, kd, ki = (
        there if value is None else value
        for value, there in zip(own, (other.kp, other.kd, other.ki), strict=True)
    )
    return Gains(kp, kd, ki)


def _fall_of(probe: ProbeResult) -> StribeckFall | None:
    """How the probe saw friction fall with speed; None where it did not."""
    level, rate = (probe.facts.get(name) for name in STRIBECK_FACTS)
    if level is None or rate is None or rate <= 0.0:
        return None
    return StribeckFall(max(0.0, level), rate)


def _axes(recipe: Recipe, identity: Identity, probed: Probed) -> tuple[Axis, Axis]:
    """Opening and advance as the controller meets them; the filter of the rate is still open."""
    torque = COUNT_SHARE * min(recipe.limits.torque_Nm, identity.torque_limit)
    force = COUNT_SHARE * min(recipe.limits.force_N, identity.force_limit)
    tick, delay = identity.tick_us * 1e-6, probed.latest_s
    opening = Axis(
        inertia=probed.inertia_kg_m2,
        viscous=max(0.0, probed.viscous_Nm_s_per_rad),
        coulomb=probed.coulomb_Nm,
        delay_s=delay,
        tick_s=tick,
        step=identity.opening_resolution,
        rate_cutoff_Hz=0.0,
        most_per_count=max(probed.coulomb_Nm, torque),
        inertia_factor=probed.inertia_factor,
    )
    advance = Axis(
        inertia=ADVANCE_MASS_KG,
        viscous=ADVANCE_VISCOUS_N_s_per_m,
        coulomb=ADVANCE_COULOMB_N,
        delay_s=delay,
        tick_s=tick,
        step=identity.advance_resolution,
        rate_cutoff_Hz=0.0,
        most_per_count=max(ADVANCE_COULOMB_N, force),
        inertia_factor=ADVANCE_FACTOR,
    )
    return opening, advance


def _demands(recipe: Recipe, kind: Kind, identity: Identity) -> tuple[Demand, Demand]:
    """What the plan asks of opening and advance."""
    if kind == "friction-advance":
        opening = Demand(APPROACH_SPEED, TURN_ACCELERATION, 0.0, OPENING_ERROR_RAD)
        most = largest_acceleration(recipe, identity)
        return opening, Demand(max(sliding_speeds(recipe)), most, 0.0, ADVANCE_ERROR_M)
    advance = Demand(ADVANCE_SPEED, ADVANCE_ACCELERATION, 0.0, ADVANCE_ERROR_M)
    if kind == "friction":
        fastest = max(recipe.capture.friction.speeds_rad_per_s)
        return Demand(fastest, SWING_ACCELERATION, 0.0, OPENING_ERROR_RAD), advance
    fastest = max(recipe.capture.cut.speeds_rad_per_s)
    return Demand(fastest, TURN_ACCELERATION, _load(recipe), OPENING_ERROR_RAD), advance


def _load(recipe: Recipe) -> float:
    """Torque that the material may take: by the medians of the recipe's priors.

    A straight edge through the pivot cuts at J_c h (x + phi tan(psi)) / (m tan(psi)), with psi the
    blade's angle (docs/model.md); a sheet that is only pressed takes force times lever.
    """
    settings = recipe.fit.cut
    contact = 1e-3 * max(recipe.scene.contact_mm)
    toughness = settings.toughness_J_per_m2
    if not recipe.scene.cut or toughness is None:
        return settings.response_force_N.median * contact
    energy = toughness.median * recipe.material.thickness_mm * 1e-3
    blade = min(recipe.scene.opening_rad) / recipe.rig.moving_blades
    slope = math.tan(max(blade, math.radians(1.0)))
    return energy * contact * (1.0 + slope**2) / (recipe.rig.moving_blades * slope)


def _checked(axis: Axis, gains: Gains, name: str) -> Margins:
    margins = loop_margins(axis, gains)
    if margins.stable:
        return margins
    raise DeviceError(
        f"The gains of the {name} in the recipe's rig.control would make the rig swing: an effort "
        f"acts {1e3 * axis.delay_s:.2g} ms after the measurement that it answers. Lower them, or "
        'set them to "auto", so that they follow from the probe.'
    )


def _designed(
    axis: Axis, demand: Demand, cutoffs: tuple[float, ...], name: str, lack: str, fall: float
) -> Design:
    try:
        return design_gains(axis, demand, cutoffs, name, fall)
    except DeviceError as error:
        raise DeviceError(f"{error} {lack}".rstrip()) from None


def _undelayed(probed: Probed) -> Verdict:
    why = f"The gains are those of a typical rig, which is answered within 1 ms. {probed.lack}"
    return CONTROL_MARGIN.not_evaluated(why)


def _sliding(stribeck: StribeckFall, stood: float, slowest: float) -> Verdict:
    """Whether the slowest planned sweep slides steadily, as far as it is known before."""
    steady = stribeck.steady_from(stood)
    limit = f"The loop stands friction that falls by up to {stood:.2g} N m s/rad"
    if stribeck.rate is None and steady > slowest:
        return STEADY_SWEEPS.not_evaluated(
            f"{limit}: sweeps are steady from {steady:.2g} rad/s on, whatever the friction. The "
            "probe did not see how friction falls with speed, so slower ones are tried, and the "
            "fit tells whether the blades stuck."
        )
    good = f"{limit}, and sweeps at {slowest:.2g} rad/s are steady."
    bad = (
        f"{limit}, and this rig's falls by {stribeck.steepest:.2g}: blades stick and slip below "
        f"{steady:.2g} rad/s. Slower sweeps need a shorter delay: shorten the adapter's latency "
        "timer, raise the baud rate, or take a faster tick."
    )
    return STEADY_SWEEPS.judge(steady, good, bad, threshold=slowest)


def _verdict(margins: list[Margins], delay_s: float, lack: str) -> Verdict:
    worst = min(margins, key=lambda one: one.phase_deg)
    said = (
        f"The capture's gains have {worst.phase_deg:.0f} degrees of phase margin and a gain margin "
        f"of {worst.gain:.1f} at a delay of {1e3 * delay_s:.2g} ms. {lack}"
    ).rstrip()
    remedy = """ Lower the gains in rig.control, or set them to "auto"."""
    return CONTROL_MARGIN.judge(worst.phase_deg, said, said + remedy)
