"""The torque that fits would render, over the whole scene: its band, and where data support it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from scissorcal.aliases import Array, Mask
from scissorcal.calibration.cut.structure import has_numbers
from scissorcal.calibration.result import FitResult
from scissorcal.errors import MissingError
from scissorcal.model import edge_height
from scissorcal.model.cutting import within_thickness
from scissorcal.package.exact import (
    ExactModel,
    FitDraws,
    central_model,
    exact_model,
    pick_draws,
    torque_quantiles,
)
from scissorcal.package.friction_tables import rendered_fits
from scissorcal.package.grid import FELT_SHARE
from scissorcal.package.reach import data_reach, reach_sentences
from scissorcal.recipe.schema import Recipe

Along = Literal["opening", "opening_rate", "contact"]
AXES: tuple[Along, ...] = ("opening", "opening_rate", "contact")

OPENINGS, SPEEDS, CONTACTS = 9, 4, 7
SLICE_POINTS = 61
SLICE_SPEEDS = 20
NEAR_SHARE = 0.1
"""A place is supported by data within this share of the scene's range of opening and contact."""
NEAR_SPEED = 2.0
"""And within this factor of its rate, in the same direction."""


@dataclass(frozen=True)
class Places:
    """Torque at places of the scene, all (n,): rad, rad/s, m, N m.

    ``low`` and ``high`` bound the torque with the scene's confidence. ``reached`` says that the
    contact lies on the blade, and that what is only pressed is as thick as that; ``touching`` that
    the edge presses on the material (elsewhere only friction is felt), ``supported`` that data lie
    nearby. Torque is NaN where not reached.
    """

    opening: Array
    opening_rate: Array
    contact: Array
    torque: Array
    low: Array
    high: Array
    reached: Mask
    touching: Mask
    supported: Mask


@dataclass(frozen=True)
class SceneTorque:
    """The rendered torque over a grid of the scene, and along its axes.

    ``confidence`` and ``tolerance`` are the scene's, as shares. ``share`` (n,) is half of the band
    over the torque at each place of ``grid`` that can be felt, NaN elsewhere. ``not_in_band`` has
    what was not measured and may move the mean torque by more than the tolerance: check and share.
    ``slices`` are along one axis, the two others held, in curves without an end.
    ``beyond_data`` says in sentences what of the scene no data reach (`reach`).
    """

    confidence: float
    tolerance: float
    with_friction: bool
    grid: Places
    share: Array
    slices: Mapping[Along, tuple[Places, ...]]
    not_in_band: tuple[tuple[str, float | None], ...]
    beyond_data: tuple[str, ...]

    @property
    def largest(self) -> float:
        """The largest torque on the grid, N m."""
        return float(np.nanmax(np.abs(self.grid.torque), initial=0.0))

    @property
    def within_tolerance(self) -> float | None:
        """Share of the places that can be felt whose band is within the tolerance."""
        felt = self.share[np.isfinite(self.share)]
        return float(np.mean(felt <= self.tolerance)) if len(felt) else None

    @property
    def supported(self) -> float | None:
        """Share of the places that can be felt with data nearby."""
        felt = np.isfinite(self.share)
        return float(np.mean(self.grid.supported[felt])) if felt.any() else None

    @property
    def worst(self) -> int | None:
        """Index of the place whose band is widest for its torque; None where nothing is felt."""
        return int(np.nanargmax(self.share)) if np.any(np.isfinite(self.share)) else None


def scene_torque(recipe: Recipe, cut: FitResult | None, friction: FitResult | None) -> SceneTorque:
    """Evaluate the fitted model over the scene, with every posterior draw.

    Raises MissingError with what to run where there is no model yet.
    """
    rendered = friction if recipe.scene.render_friction else None
    probe = _Probe(recipe, _wanted(recipe, cut, friction), rendered)
    scene = recipe.scene
    grid = probe.at(*scene_grid(recipe))
    size = np.abs(grid.torque)
    felt = _felt(grid.reached, size)
    share = np.where(felt, 0.5 * (grid.high - grid.low) / np.where(felt, size, 1.0), np.nan)
    return SceneTorque(
        scene.confidence_percent / 100.0,
        scene.tolerance_percent / 100.0,
        rendered is not None,
        grid,
        share,
        _slices(recipe, probe),
        _not_in_band(probe.cut),
        reach_sentences(data_reach(recipe, probe.cut), str(probe.cut.structure["response"])),
    )


def scene_grid(recipe: Recipe) -> tuple[Array, Array, Array]:
    """Places over the scene: opening (n,) in rad, its rate in rad/s, contact in m."""
    scene = recipe.scene
    openings = np.linspace(*scene.opening_rad, OPENINGS)
    speeds = np.geomspace(_slowest(recipe), scene.opening_rate_rad_per_s[1], SPEEDS)
    rates = np.concatenate([-speeds[::-1], speeds])
    contacts = np.linspace(*scene.contact_m, CONTACTS)
    opening, rate, contact = np.meshgrid(openings, rates, contacts, indexing="ij")
    return opening.ravel(), rate.ravel(), contact.ravel()


def felt_places(model: ExactModel, grid: tuple[Array, Array, Array], torque: Array) -> Mask:
    """Which places (n,) of a grid the blade reaches with a torque (n,) that can be felt."""
    opening, _, contact = grid
    place = np.ravel(model.settled(opening, contact))
    view = edge_height(model.cutting.edge, place, model.blade_angle(opening))
    reached = np.asarray(view.station < model.cutting.edge.length_m)
    reached &= within_thickness(model.cutting, model.cutting.upper_face_m - view.height)
    return _felt(reached, np.where(reached, np.abs(torque), np.nan))


def _felt(reached: Mask, size: Array) -> Mask:
    largest = float(np.nanmax(size, initial=0.0))
    return np.asarray(reached & (size >= FELT_SHARE * largest) & (largest > 0))


def _wanted(recipe: Recipe, cut: FitResult | None, friction: FitResult | None) -> FitResult:
    """The cut to evaluate; MissingError where the scene has no model of its torque yet."""
    if recipe.rig.joint == "linear":
        raise MissingError("A linear joint carries no blades, so no torque is rendered.")
    if cut is None:
        raise MissingError(
            "There is no fit of the material yet, so there is no torque to show: run `scissorcal "
            "capture cut`, then `scissorcal fit`."
        )
    if friction is None and recipe.scene.render_friction:
        raise MissingError("There is no fit of friction yet: run `scissorcal fit friction`.")
    return cut


def _not_in_band(cut: FitResult) -> tuple[tuple[str, float | None], ...]:
    """Checks of what was not measured whose bound on the torque is above their limit."""
    names = {row["name"] for row in cut.diagnostics.get("not_measured", ())}
    open_checks = [v for v in cut.verdicts if v.status == "not_evaluated" and v.check in names]
    return tuple((verdict.check, verdict.value) for verdict in open_checks)


class _Probe:
    """Evaluates torque, its band and its support at places of the scene.

    Data support a place where strokes through material lie nearby, and empty strokes for friction.
    A contact at which the material would not hold counts as the one where it does. Where the edge
    does not touch the material, only friction needs data.
    """

    def __init__(self, recipe: Recipe, cut: FitResult, friction: FitResult | None) -> None:
        fits = [fit for fit in (cut, friction) if fit is not None]
        keys = ({"response", "edge"}, {"angle_center"})
        if not all(has_numbers(fit, own) for fit, own in zip(fits, keys, strict=False)):
            raise MissingError("The fits hold no usable numbers: fit again, then report again.")
        cut, friction = rendered_fits(cut, friction)
        fits = [fit for fit in (cut, friction) if fit is not None]
        picked = pick_draws(cut, friction, np.random.default_rng(0))
        drawn = [FitDraws.of(fit, picked[f"draws/{fit.what}.npy"]) for fit in fits]
        best = [FitDraws.centre(fit) for fit in fits]
        self.cut, self._friction = cut, friction
        self._drawn = exact_model(drawn[0], drawn[1] if friction else None)
        self._central: ExactModel = central_model(best[0], best[1] if friction else None)
        tail = 0.5 * (1.0 - recipe.scene.confidence_percent / 100.0)
        self._probabilities = (tail, 1.0 - tail)
        self._limit = recipe.limits.torque_Nm
        low, high = recipe.scene.opening_rad
        self._near_opening = NEAR_SHARE * (high - low)
        low, high = recipe.scene.contact_m
        self._near_contact = NEAR_SHARE * (high - low)

    def at(self, opening: Array, rate: Array, contact: Array) -> Places:
        """Torque with its band and support (n,), held to the recipe's limit as the loop does."""
        central = self._central
        place = np.ravel(central.settled(opening, contact))
        view = edge_height(central.cutting.edge, place, central.blade_angle(opening))
        reached = np.asarray(view.station < central.cutting.edge.length_m)
        reached &= within_thickness(central.cutting, central.cutting.upper_face_m - view.height)
        touching = np.asarray(view.height < central.cutting.upper_face_m)
        torque = np.ravel(central.torque(opening, rate, contact))
        low, high = torque_quantiles(self._drawn, opening, rate, contact, self._probabilities)
        torque, low, high = (
            np.where(reached, np.clip(values, -self._limit, self._limit), np.nan)
            for values in (torque, low, high)
        )
        supported = reached & self._supported(opening, rate, place, touching)
        return Places(
            opening, rate, contact, torque, low, high, reached, reached & touching, supported
        )

    def _supported(self, opening: Array, rate: Array, place: Array, touching: Mask) -> Mask:
        series = self.cut.series
        known = np.ravel(self._central.settled(series.opening, series.contact))
        near = _near(opening, series.opening, self._near_opening)
        near &= _near(place, known, self._near_contact)
        near &= _alike(rate, series.opening_rate)
        found = near.any(axis=1) | ~touching
        if self._friction is not None:
            empty = _near(opening, self._friction.series.opening, self._near_opening)
            empty &= _alike(rate, self._friction.series.opening_rate)
            found &= empty.any(axis=1)
        return np.asarray(found)


def _slices(recipe: Recipe, probe: _Probe) -> dict[Along, tuple[Places, ...]]:
    """Three slices along each axis, at three places of the others."""
    scene = recipe.scene
    fastest = scene.opening_rate_rad_per_s[1]
    pace = -float(np.sqrt(_slowest(recipe) * fastest))
    openings, contacts = (
        [low + share * (high - low) for share in (0.2, 0.5, 0.8)]
        for low, high in (scene.opening_rad, scene.contact_m)
    )
    speeds = np.geomspace(_slowest(recipe), fastest, SLICE_SPEEDS)
    rates = np.concatenate([-speeds[::-1], speeds])
    over_opening = np.linspace(*scene.opening_rad, SLICE_POINTS)
    over_contact = np.linspace(*scene.contact_m, SLICE_POINTS)
    wanted: dict[Along, list[tuple[float | Array, ...]]] = {
        "opening": [(over_opening, pace, contact) for contact in contacts],
        "opening_rate": [(opening, rates, contacts[0]) for opening in openings],
        "contact": [(opening, pace, over_contact) for opening in openings],
    }
    return {
        along: tuple(
            probe.at(*(np.array(a) for a in np.broadcast_arrays(*places))) for places in several
        )
        for along, several in wanted.items()
    }


def _slowest(recipe: Recipe) -> float:
    return max(recipe.scene.opening_rate_rad_per_s[0], 1e-3)


def _near(wanted: Array, known: Array, reach: float) -> Mask:
    return np.asarray(np.abs(wanted.reshape(-1, 1) - known.reshape(1, -1)) <= reach)


def _alike(wanted: Array, known: Array) -> Mask:
    a, b = wanted.reshape(-1, 1), known.reshape(1, -1)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.abs(a) / np.abs(b)
    same = np.sign(a) == np.sign(b)
    return np.asarray(same & (ratio <= NEAR_SPEED) & (ratio >= 1 / NEAR_SPEED))
