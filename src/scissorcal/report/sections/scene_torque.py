"""The torque that would be rendered, over the whole scene: its band, and where data support it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.result import FitResult
from scissorcal.model import edge_height
from scissorcal.package.exact import torque_quantiles
from scissorcal.recipe.schema import Recipe
from scissorcal.report.numbers import Number, finite, finite_each, percent, short, with_unit
from scissorcal.report.reduce import Array
from scissorcal.report.sections.law import Law, law_of, named
from scissorcal.verdicts import Verdict

OPENINGS, SPEEDS, CONTACTS = 9, 4, 7
SLICE_POINTS = 61
NEAR_SHARE = 0.1
"""A place is supported by data within this share of the scene's range of opening and contact."""
NEAR_SPEED = 2.0
"""And within this factor of its rate, in the same direction."""
FELT_SHARE = 0.05
"""Torques below this share of the scene's largest are not held to the tolerance."""

Along = Literal["opening", "opening_rate", "contact"]
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class TorquePlace:
    """One place of the scene: rad, rad/s, m, N m; ``share`` is the band's half over the torque."""

    opening: Number
    opening_rate: Number
    contact: Number
    torque: Number
    half_width: Number
    share: Number


@dataclass(frozen=True)
class TorqueSlice:
    """Rendered torque along one axis of the scene with the two others held; arrays over ``x``.

    ``supported`` says where there are data nearby.
    """

    along: Along
    label: str
    opening: Number
    opening_rate: Number
    contact: Number
    x: tuple[Number, ...]
    torque: tuple[Number, ...]
    band_low: tuple[Number, ...]
    band_high: tuple[Number, ...]
    supported: tuple[bool, ...]


@dataclass(frozen=True)
class TorqueGrid:
    """Torque on a grid over the scene: flat arrays, opening slowest, contact fastest.

    Rates are signed, closing first. None where the contact lies beyond the blade's tip.
    ``touching`` says where the edge presses on the material: elsewhere only friction is felt.
    """

    opening: tuple[Number, ...]
    opening_rate: tuple[Number, ...]
    contact: tuple[Number, ...]
    torque: tuple[Number, ...]
    band_low: tuple[Number, ...]
    band_high: tuple[Number, ...]
    supported: tuple[bool, ...]
    touching: tuple[bool, ...]


@dataclass(frozen=True)
class SceneTorque:
    """The band of rendered torque with probability ``confidence``, over the scene's ranges.

    ``within_tolerance`` and ``supported`` are shares of the grid's places that can be felt.
    ``worst`` is where the band is widest for its torque. ``not_in_band`` has what was not measured
    and may move the mean torque by more than the tolerance: check and share. Where there is no
    model, ``missing`` says how to have one, and all else is empty.
    """

    missing: str
    confidence: Number
    tolerance: Number
    with_friction: bool
    largest: Number
    within_tolerance: Number
    supported: Number
    worst: TorquePlace | None
    slices: tuple[TorqueSlice, ...]
    grid: TorqueGrid | None
    not_in_band: tuple[tuple[str, Number], ...] = ()


def scene_torque(recipe: Recipe, fits: Sequence[FitResult]) -> SceneTorque:
    """Evaluate the fitted model over the scene, with every posterior draw."""
    cut, friction = named(fits, "cut"), named(fits, "friction")
    rendered = friction if recipe.scene.render_friction else None
    missing = _missing(recipe, cut, friction)
    law = law_of(cut, rendered) if cut and not missing else None
    if law is None or cut is None:
        why = missing or "The fits hold no usable numbers: fit again, then report again."
        return SceneTorque(why, None, None, False, None, None, None, None, (), None)
    scene = recipe.scene
    probe = _Probe(law, recipe, Support(law, cut, rendered, recipe))
    openings = np.linspace(*scene.opening_rad, OPENINGS)
    speeds = np.geomspace(max(scene.opening_rate_rad_per_s[0], 1e-3), _fastest(recipe), SPEEDS)
    rates = np.concatenate([-speeds[::-1], speeds])
    contacts = np.linspace(*scene.contact_m, CONTACTS)
    places = [g.ravel() for g in np.meshgrid(openings, rates, contacts, indexing="ij")]
    torque, low, high, reached, supported = probe.at(*places)
    largest = float(np.max(np.abs(torque[reached]), initial=0.0))
    felt = reached & (np.abs(torque) >= FELT_SHARE * largest) & (largest > 0)
    share = np.where(felt, 0.5 * (high - low) / np.where(felt, np.abs(torque), 1.0), np.nan)
    return SceneTorque(
        "",
        scene.confidence_percent / 100.0,
        scene.tolerance_percent / 100.0,
        rendered is not None,
        finite(largest),
        _mean(share[felt] <= scene.tolerance_percent / 100.0),
        _mean(supported[felt]),
        _worst(places, torque, high - low, share),
        tuple(_slices(recipe, probe)),
        TorqueGrid(
            finite_each(openings),
            finite_each(rates),
            finite_each(contacts),
            _where(reached, torque),
            _where(reached, low),
            _where(reached, high),
            tuple(bool(value) for value in supported & reached),
            tuple(bool(value) for value in reached & probe.touches(places[0], places[2])),
        ),
        tuple((v.check, finite(v.value)) for v in cut.verdicts if _open_bound(v, cut)),
    )


def findings(section: SceneTorque) -> str:
    """What the band and the data's reach mean, in words."""
    if section.missing:
        return section.missing
    tolerance = percent(section.tolerance)
    words = [
        f"Over the scene the torque is known to within its tolerance of {tolerance} (with "
        f"{percent(section.confidence)} probability) at {percent(section.within_tolerance)} of the "
        f"places that can be felt; {percent(section.supported)} of them have data nearby."
    ]
    worst = section.worst
    if worst is not None:
        words.append(
            f"It is least certain at {_degrees(worst.opening)}, {short(worst.opening_rate)} rad/s "
            f"and a contact of {_millimetres(worst.contact)}: {with_unit(worst.torque, 'N m')} "
            f"± {percent(worst.share)}."
        )
    if section.not_in_band:
        named = ", ".join(f"{name} up to {percent(share)}" for name, share in section.not_in_band)
        words.append(
            f"The band does not hold what nobody measured, as shares of the mean torque: {named}. "
            "The verdicts say what to measure."
        )
    return " ".join(words)


def _open_bound(verdict: Verdict, cut: FitResult) -> bool:
    """Whether a verdict is on what nobody measured, and bounds torque by more than its limit."""
    names = {row["name"] for row in cut.diagnostics.get("not_measured", ())}
    return verdict.status == "not_evaluated" and verdict.check in names


class Support:
    """Where in the scene there are data: strokes through material, and empty ones for friction.

    A contact at which the material would not hold counts as the one where it does. Where the edge
    does not touch the material, only friction needs data.
    """

    def __init__(
        self, law: Law, cut: FitResult, friction: FitResult | None, recipe: Recipe
    ) -> None:
        self._law = law
        low, high = recipe.scene.opening_rad
        self._opening = NEAR_SHARE * (high - low)
        low, high = recipe.scene.contact_m
        self._contact = NEAR_SHARE * (high - low)
        self._cut, self._friction = cut.series, friction.series if friction else None

    def at(self, opening: Array, rate: Array, contact: Array) -> Mask:
        """Whether data are near each place (n,)."""
        series = self._cut
        central = self._law.central
        place = np.ravel(central.settled(opening, contact))
        known = np.ravel(central.settled(series.opening, series.contact))
        near = _near(opening, series.opening, self._opening)
        near &= _near(place, known, self._contact)
        near &= _alike(rate, series.opening_rate)
        found = near.any(axis=1) | ~touching(self._law, opening, contact)
        if self._friction is not None:
            empty = _near(opening, self._friction.opening, self._opening)
            found &= (empty & _alike(rate, self._friction.opening_rate)).any(axis=1)
        return np.asarray(found)


def touching(law: Law, opening: Array, contact: Array) -> Mask:
    """Whether the edge presses on the material at each place (n,)."""
    central = law.central
    place = np.ravel(central.settled(opening, contact))
    view = edge_height(central.cutting.edge, place, central.blade_angle(opening))
    return np.asarray(view.height < central.cutting.upper_face_m)


class _Probe:
    """Evaluates torque, its band and its support at places of the scene."""

    def __init__(self, law: Law, recipe: Recipe, support: Support) -> None:
        self._law, self._support = law, support
        tail = 0.5 * (1.0 - recipe.scene.confidence_percent / 100.0)
        self._probabilities = (tail, 1.0 - tail)
        self._limit = recipe.limits.torque_Nm

    def at(
        self, opening: Array, rate: Array, contact: Array
    ) -> tuple[Array, Array, Array, Mask, Mask]:
        """Torque, its band's ends, whether the blade reaches there, and whether data do; all (n,).

        Held to the recipe's torque limit, as the loop would.
        """
        central = self._law.central
        torque = np.ravel(central.torque(opening, rate, contact))
        low, high = torque_quantiles(self._law.drawn, opening, rate, contact, self._probabilities)
        place = np.ravel(central.settled(opening, contact))
        view = edge_height(central.cutting.edge, place, central.blade_angle(opening))
        reached = np.asarray(view.station < central.cutting.edge.length_m)
        clipped = [np.clip(v, -self._limit, self._limit) for v in (torque, low, high)]
        return clipped[0], clipped[1], clipped[2], reached, self._support.at(opening, rate, contact)

    def touches(self, opening: Array, contact: Array) -> Mask:
        """Whether the edge presses on the material at each place (n,)."""
        return touching(self._law, opening, contact)


def _slices(recipe: Recipe, probe: _Probe) -> list[TorqueSlice]:
    scene = recipe.scene
    pace = -float(np.sqrt(max(scene.opening_rate_rad_per_s[0], 1e-3) * _fastest(recipe)))
    thirds = (0.2, 0.5, 0.8)
    openings = [_within(scene.opening_rad, share) for share in thirds]
    contacts = [_within(scene.contact_m, share) for share in thirds]
    speeds = np.geomspace(max(scene.opening_rate_rad_per_s[0], 1e-3), _fastest(recipe), 20)
    rates = np.concatenate([-speeds[::-1], speeds])
    x = np.linspace(*scene.opening_rad, SLICE_POINTS)
    over_opening = [
        _slice(probe, "opening", _millimetres(contact), x, pace, contact) for contact in contacts
    ]
    over_rate = [
        _slice(probe, "opening_rate", _degrees(opening), opening, rates, contacts[0])
        for opening in openings
    ]
    x = np.linspace(*scene.contact_m, SLICE_POINTS)
    over_contact = [
        _slice(probe, "contact", _degrees(opening), opening, pace, x) for opening in openings
    ]
    return over_opening + over_rate + over_contact


def _slice(
    probe: _Probe,
    along: Along,
    label: str,
    opening: float | Array,
    rate: float | Array,
    contact: float | Array,
) -> TorqueSlice:
    places = [np.array(a) for a in np.broadcast_arrays(opening, rate, contact)]
    held = {
        name: None if name == along else finite(values[0])
        for name, values in zip(("opening", "opening_rate", "contact"), places, strict=True)
    }
    x = places[("opening", "opening_rate", "contact").index(along)]
    torque, low, high, reached, supported = probe.at(*places)
    return TorqueSlice(
        along,
        label,
        held["opening"],
        held["opening_rate"],
        held["contact"],
        finite_each(x, 5),
        _where(reached, torque),
        _where(reached, low),
        _where(reached, high),
        tuple(bool(value) for value in supported & reached),
    )


def _missing(recipe: Recipe, cut: FitResult | None, friction: FitResult | None) -> str:
    if recipe.rig.joint == "linear":
        return "A linear joint carries no blades, so no torque is rendered."
    if cut is None:
        return (
            "There is no fit of the material yet, so there is no torque to show: run `scissorcal "
            "capture cut`, then `scissorcal fit`."
        )
    if friction is None and recipe.scene.render_friction:
        return "There is no fit of friction yet: run `scissorcal fit friction`."
    return ""


def _worst(
    places: Sequence[Array], torque: Array, width: Array, share: Array
) -> TorquePlace | None:
    if not np.any(np.isfinite(share)):
        return None
    at = int(np.nanargmax(share))
    opening, rate, contact = (finite(values[at]) for values in places)
    return TorquePlace(
        opening, rate, contact, finite(torque[at]), finite(0.5 * width[at]), finite(share[at])
    )


def _where(known: Mask, values: Array) -> tuple[Number, ...]:
    return finite_each(np.where(known, values, np.nan), 5)


def _near(wanted: Array, known: Array, reach: float) -> Mask:
    return np.asarray(np.abs(wanted.reshape(-1, 1) - known.reshape(1, -1)) <= reach)


def _alike(wanted: Array, known: Array) -> Mask:
    a, b = wanted.reshape(-1, 1), known.reshape(1, -1)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.abs(a) / np.abs(b)
    return np.asarray(
        (np.sign(a) == np.sign(b)) & (ratio <= NEAR_SPEED) & (ratio >= 1 / NEAR_SPEED)
    )


def _fastest(recipe: Recipe) -> float:
    return recipe.scene.opening_rate_rad_per_s[1]


def _within(span: tuple[float, float], share: float) -> float:
    return span[0] + share * (span[1] - span[0])


def _mean(flags: Mask) -> Number:
    return float(np.mean(flags)) if len(flags) else None


def _degrees(opening: Number) -> str:
    return f"{short(None if opening is None else float(np.rad2deg(opening)))}°"


def _millimetres(contact: Number) -> str:
    return f"{short(None if contact is None else 1e3 * contact)} mm"
