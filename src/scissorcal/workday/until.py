"""Capture until the scene's tolerance: fits brought up to date after each stroke choose the next.

Here the room of devices, which knows no fits, meets the room of fits, which knows no devices.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration import FitResult
from scissorcal.calibration.design import Stock, expected_band
from scissorcal.calibration.design.band import REACHED_SHARE, Band, TorqueKnowledge
from scissorcal.calibration.design.choice import first_captures
from scissorcal.calibration.design.next_stroke import (
    Outlook,
    Taken,
    begun,
    bounds,
    friction_alone,
    outlook,
)
from scissorcal.calibration.design.state import (
    CutState,
    FrictionState,
    expected_cut,
    expected_friction,
    fitted_friction,
    latest_cut,
)
from scissorcal.calibration.friction.fit import fit_friction
from scissorcal.device.capture import CHOOSING_S
from scissorcal.device.parts import ChosenStroke, Part, part_seconds, stroke_part, sweep_part
from scissorcal.errors import InputError
from scissorcal.kernel import Identity
from scissorcal.model import EdgeDistribution
from scissorcal.package.scene_slopes import torque_knowledge
from scissorcal.recipe.requirements import DesignedKind
from scissorcal.recipe.schema import Recipe
from scissorcal.recording import Recording
from scissorcal.recording.header import UntilMark
from scissorcal.workday.stock import EXCITATION_S, MOST_PLACES, capture_stock

MOVED_SDS = 1.0
"""What strokes would tell is computed anew where a parameter has moved by so many of its standard
deviations."""


class Limits(NamedTuple):
    """At least so many strokes (pairs of sweeps), at most so many planned minutes.

    The first part runs in any case. Empty sweeps are at ``slowest_sweep`` (rad/s) and faster
    (`capture_stock`).
    """

    max_minutes: float
    at_least: int = 0
    slowest_sweep: float = 0.0


@dataclass(frozen=True)
class Earlier:
    """What a capture builds on: recordings that are there, fits of them, the edge by photographs.

    ``friction`` is the fit that a capture of cuts needs. ``cut`` is the state of a finished fit,
    None where the material was not captured yet.
    """

    friction_recordings: tuple[Recording, ...] = ()
    cut_recordings: tuple[Recording, ...] = ()
    friction: FitResult | None = None
    cut: CutState | None = None
    edge: EdgeDistribution | None = None
    last_law: str | None = None


class UntilTolerance:
    """Chooses the parts of one capture; called with what was recorded so far, it gives the next.

    The fit is brought up to date by what was recorded, the band of the torque over the scene is
    judged by the scene's tolerance and confidence, and the stroke comes next that lowers what is
    beyond the tolerance the most per minute. ``marks`` has the state after each update.
    """

    def __init__(
        self,
        kind: DesignedKind,
        recipe: Recipe,
        identity: Identity,
        earlier: Earlier,
        limits: Limits,
        *,
        seed: int = 0,
    ) -> None:
        self._kind, self._recipe, self._identity = kind, recipe, identity
        self._earlier, self._limits = earlier, limits
        self._seed = seed
        self._taken = Taken()
        self._seconds = 0.0
        self._why_no_fit = ""
        self._used: dict[float, float] = {}
        self.marks: list[UntilMark] = []
        self._friction, self._cut = self._at_first()
        self._renew_stock()
        self._seconds += self._stock.begin_s

    @property
    def recipe(self) -> Recipe:
        """The recipe with the speeds on offer, for coverage and gains."""
        capture = self._recipe.capture
        sweeps = {"speeds_rad_per_s": tuple(self._stock.sweeps)}
        strokes = {"speeds_rad_per_s": self._stock.cut_speeds}
        offered = capture.model_copy(
            update={
                "friction": capture.friction.model_copy(update=sweeps),
                "cut": capture.cut.model_copy(update=strokes),
            }
        )
        return self._recipe.model_copy(update={"capture": offered})

    def __call__(self, recorded: Recording, advance: float) -> Part | None:
        """The next part, where the carriage stands at ``advance`` (m); None at the end."""
        if self._taken.strokes:
            self._bring_up_to_date(recorded)
        if self._kind == "friction" and not self._taken.strokes:
            return self._first_sweeps(recorded, advance)
        known = torque_knowledge(self._recipe, self._friction, self._cut)
        taken = len(self._taken.strokes)
        least = max(self._limits.at_least - taken, 0)
        stock = self._offers
        view = outlook(known, stock, self._kind, self._taken, self._judge, least)
        mark = self._mark(known, view, least)
        self.marks.append(mark)
        if mark.ended or view.following is None:
            return None
        following = view.following
        fresh = self._kind == "cut" and following.place == 0
        if self._stock.rotates:
            fresh = not self._taken.strokes
        self._taken = self._taken.plus(following.speed, following.place)
        first = len(recorded.strokes)
        if self._kind == "friction":
            part = sweep_part(
                self._recipe, self._identity, (following.speed,), first=first, advance=advance
            )
        else:
            sheet = 0 if self._stock.rotates else self._taken.pieces - 1
            stroke = ChosenStroke(following.speed, following.place, sheet, first, fresh)
            part = stroke_part(self._recipe, self._identity, stroke, MOST_PLACES)
        return self._counted(part, view.seconds - following.seconds)

    @property
    def _offers(self) -> Stock:
        """The stock, its sweeps worth what the fit uses of those that were recorded.

        Blades that stick and slip at a slow speed tell less there than a planned motion says.
        """
        sweeps = {
            speed: replace(offer, information=offer.information.times(self._used.get(speed, 1.0)))
            for speed, offer in self._stock.sweeps.items()
        }
        return replace(self._stock, sweeps=sweeps)

    def _first_sweeps(self, recorded: Recording, advance: float) -> Part:
        """What identifies a law of friction at all, in one part."""
        self.marks.append(self._state("", None))
        speeds = first_captures(self._stock).speeds
        for speed in speeds:
            self._taken = self._taken.plus(speed, 0)
        part = sweep_part(
            self._recipe,
            self._identity,
            speeds,
            first=len(recorded.strokes),
            advance=advance,
            excitation_s=EXCITATION_S,
        )
        return self._counted(part, 0.0)

    def _counted(self, part: Part, then_s: float) -> Part:
        self._seconds += part_seconds(part, self._identity) + CHOOSING_S
        if part.fresh:
            self._seconds += self._stock.piece_s
        return replace(part, then_s=then_s)

    def _at_first(self) -> tuple[FrictionState, CutState]:
        """What is known before the capture."""
        earlier, recipe = self._earlier, self._recipe
        friction = (
            fitted_friction(earlier.friction_recordings, recipe, earlier.friction)
            if earlier.friction
            else expected_friction(recipe)
        )
        return friction, earlier.cut or expected_cut(recipe, friction, earlier.edge)

    def _bring_up_to_date(self, recorded: Recording) -> None:
        """Fit everything recorded; where the strokes are too few for a fit, the state stays."""
        recipe, earlier = self._recipe, self._earlier
        try:
            if self._kind == "friction":
                recordings = (*earlier.friction_recordings, recorded)
                rng = np.random.default_rng((self._seed, len(self._taken.strokes)))
                settings = recipe.fit.friction
                fit = fit_friction(recordings, settings, effort="draft", rng=rng)
                self._friction = fitted_friction(recordings, recipe, fit)
                self._used = shares_used(recorded, fit.used[-1])
            else:
                recordings = (*earlier.cut_recordings, recorded)
                assert earlier.friction is not None
                self._cut = latest_cut(
                    recordings, recipe, earlier.friction, earlier.edge, earlier.last_law
                )
        except InputError as error:
            self._why_no_fit = str(error)
            return
        self._why_no_fit = ""
        if self._moved():
            self._renew_stock()

    def _renew_stock(self) -> None:
        """Judge the offers by the fits as they are."""
        self._stock = capture_stock(
            self._recipe, self._identity, self._friction, self._cut, self._limits.slowest_sweep
        )
        self._stock_of = (self._friction, self._cut)

    def _moved(self) -> bool:
        """Whether the fits are no longer near those by which the offers were judged."""
        friction, cut = self._stock_of
        return _differ(self._friction, friction) or _differ(self._cut, cut)

    def _judge(self, known: TorqueKnowledge) -> Band:
        """The band that decides: friction alone where the material was not captured yet."""
        if self._friction_alone:
            return friction_alone(known)
        return expected_band(known)

    def _mark(self, known: TorqueKnowledge, view: Outlook, least: int) -> UntilMark:
        """The state after an update: how far it is, whether it ends, and why."""
        band = self._judge(known)
        minutes = self._seconds / 60.0
        ended = self._ended(band, view, least, minutes)
        mark = self._state(ended, 0.0 if ended else view.seconds / 60.0)
        if self._fitted:
            mark = replace(mark, within=band.within, typical=band.typical)
        if ended == "time":
            return replace(mark, why=self._why_time(known, view, minutes))
        if ended == "no fit":
            return replace(mark, why=f"{NO_FIT} {self._why_no_fit}")
        return replace(mark, why=self._largest(known)) if ended == "out of reach" else mark

    def _state(self, ended: str, minutes_left: float | None) -> UntilMark:
        scene = self._recipe.scene
        return UntilMark(
            ended=ended,
            strokes=len(self._taken.strokes),
            pieces=self._taken.pieces if self._kind == "cut" else 0,
            minutes=self._seconds / 60.0,
            minutes_left=minutes_left,
            within=None,
            typical=None,
            tolerance=0.01 * scene.tolerance_percent,
            confidence=0.01 * scene.confidence_percent,
            needed=REACHED_SHARE,
            friction_alone=self._friction_alone,
        )

    @property
    def _friction_alone(self) -> bool:
        """Whether friction is judged without the material, which was not captured yet."""
        return self._kind == "friction" and self._earlier.cut is None

    @property
    def _fitted(self) -> bool:
        state = self._friction if self._kind == "friction" else self._cut
        return bool(state.knowledge.recordings)

    def _why_time(self, known: TorqueKnowledge, view: Outlook, minutes: float) -> str:
        """Why the minutes were too few, and what would help."""
        used = f"The {self._limits.max_minutes:.1f} planned min allowed are used up"
        if self._why_no_fit:
            return f"{used}, and the strokes so far cannot be fitted: {self._why_no_fit}"
        if not view.reaches:
            return f"{used}. {self._largest(known)}"
        more = minutes + view.seconds / 60.0
        return (
            f"{used}; {more:.1f} min are expected to be enough (--max-minutes {np.ceil(more):.0f})."
        )

    def _largest(self, known: TorqueKnowledge) -> str:
        return FRICTION_BOUNDS if self._friction_alone else largest_cause(known)

    def _ended(self, band: Band, view: Outlook, least: int, minutes: float) -> str:
        enough = not least and begun(self._stock, self._kind, self._taken)
        if enough and self._fitted and not self._why_no_fit:
            if band.reached:
                return "tolerance"
            if not view.reaches:
                return "out of reach"
        if self._why_no_fit and view.following is None:
            return "no fit"
        next_s = view.following.seconds if view.following else 0.0
        if self._taken.strokes and minutes + next_s / 60.0 > self._limits.max_minutes:
            return "time"
        return ""


def shares_used(recorded: Recording, spans: NDArray[np.int64]) -> dict[float, float]:
    """Share of the samples of a recording's sweeps that a fit uses, by speed (rad/s).

    ``spans`` (k, 2) are the first and one past the last sample of each part that it uses.
    """
    label = recorded.samples["stroke"]
    edges = np.zeros(len(label) + 1, dtype=np.int64)
    np.add.at(edges, spans[:, 0], 1)
    np.add.at(edges, spans[:, 1], -1)
    used = np.cumsum(edges)[:-1] > 0
    shares = {}
    for speed in {s.speed for s in recorded.strokes if np.isfinite(s.speed)}:
        of_speed = np.isin(label, [s.index for s in recorded.strokes if s.speed == speed])
        shares[speed] = float(np.mean(used[of_speed])) if of_speed.any() else 1.0
    return shares


def _differ(now: FrictionState | CutState, then: FrictionState | CutState) -> bool:
    if now.structure != then.structure:
        return True
    sd = np.sqrt(np.diag(now.knowledge.covariance))
    away = np.abs(now.knowledge.point - then.knowledge.point)
    return bool(np.any(away > MOVED_SDS * sd))


NOTABLE = 0.2
"""Share by which the excess over the tolerance falls where a cause is named as the largest."""
NO_FIT = (
    "The strokes so far cannot be fitted, and no further stroke is expected to help. Remove the "
    "cause that the fit gives, then capture again:"
)
FRICTION_BOUNDS = (
    "What differs between strokes of friction bounds it: clean and oil the pivot, let the rig run "
    "for some minutes and capture friction again, or raise scene.tolerance_percent."
)
REMEDIES = {
    "friction": "the uncertainty of friction: run 'scissorcal capture friction --until-tolerance' "
    "once more, then 'scissorcal fit friction'",
    "edge": "the uncertainty of the blade's edge: photograph the blade more often or closer, with "
    "'scissorcal capture blade', then 'scissorcal fit blade'; or measure it and lower rig.edge's "
    "offset_sd_mm and taper_sd_deg",
    "law": "the error that the recipe allows the law (fit.cut.lack_of_fit_percent), which repeats "
    "in every stroke: no capture lowers it; lower it in the recipe where you know better, or "
    "raise scene.tolerance_percent",
}


def largest_cause(known: TorqueKnowledge) -> str:
    """What bounds the band in the end, as a sentence with the command that would lower it."""
    now = expected_band(known).excess
    without = {name: band.excess for name, band in bounds(known).items()}
    name = min(without, key=lambda cause: without[cause])
    if now <= 0.0 or without[name] > (1.0 - NOTABLE) * now:
        return (
            "No single cause stands out: what differs between strokes, pieces and recordings is "
            "largest. Capture again on fresh pieces, with 'scissorcal capture cut "
            "--until-tolerance --max-minutes 10', or raise scene.tolerance_percent."
        )
    return f"What bounds the band most is {REMEDIES[name]}."
