"""Candidate laws: what a simpler or a richer one costs, and how far its torque is from the fitted.

Each kind of law is a knob: response, rate damping, fracture, friction, closure, edge. One candidate
is fitted at a time, all other choices as the present fits made them.
"""

import math
import time
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import ClassVar

import numpy as np

from scissorcal.bench.trade.candidate_fit import (
    as_fitted,
    holdout_rms,
    needed_minutes,
    refit,
    with_cut,
    with_friction,
    with_scene,
)
from scissorcal.bench.trade.case import Case
from scissorcal.bench.trade.fits import MINUTES, PROCESSOR, expected_fits_s
from scissorcal.bench.trade.models import (
    BYTES,
    central_law,
    compiled,
    model_of_law,
    nothing_rendered,
    package_costs,
    present_law,
)
from scissorcal.bench.trade.point import Error, Quantity, Sample, Setting
from scissorcal.bench.trade.torque import (
    WORST,
    model_torque,
    scene_places,
    torque_errors,
)
from scissorcal.calibration.result import FitResult
from scissorcal.errors import ScissorcalError
from scissorcal.package.simplest.difference import Scene, felt
from scissorcal.package.simplest.law import (
    FAMILIES,
    NONE,
    Aspect,
    Candidate,
    Law,
    fitted_candidate,
    simpler_candidates,
)
from scissorcal.package.simplest.project import Reference, project
from scissorcal.recipe.schema import Recipe

DAMPED = "damped"
"""As `package.simplest.law` calls it."""
HOLDOUT = "hold-out strokes, rms"
RIPPLE_AVERAGE, RIPPLE_WORST = "ripple, average", "ripple, worst"
NO_MINUTES = "Minutes of capture are not known: the recordings do not state their rig."


class CandidateKnob(ABC):
    """One kind of law; the settings are its candidates, the one that data support the reference.

    A richer one that the data do not ask for differs from it by what they leave open.
    """

    name: Aspect
    title: str
    cost = PROCESSOR
    error = WORST
    against = "the candidate that the data support"
    of_torque, stand_in, combined = True, False, True
    fits = "cut"
    slow: ClassVar[Mapping[str, float]] = {}
    """How many times as long as others some candidates take: a first guess for the schedule."""

    @abstractmethod
    def candidates(self, case: Case) -> Sequence[str]:
        """Names of the candidates, simplest first."""

    @abstractmethod
    def fitted(self, case: Case) -> str:
        """Name of the candidate that the present fits have."""

    def supported(self, case: Case) -> str:
        """Name of the candidate that errors are counted against: that of the present fits."""
        return self.fitted(case)

    def present(self, case: Case) -> str:
        """Name of the candidate that a package of the present fits holds.

        The fits', or a simpler one that is enough for the scene.
        """
        return fitted_candidate(present_law(case), self.name).name

    @abstractmethod
    def recipe(self, recipe: Recipe, candidate: str) -> Recipe:
        """The recipe that fits this candidate."""

    def missing(self, case: Case) -> str:
        """Where nothing is rendered, or where there is one candidate only."""
        return nothing_rendered(case) or self.single(case)

    def single(self, case: Case) -> str:
        """Say why a scene has no choice; empty where it has one."""
        return ""

    def settings(self, case: Case) -> tuple[Setting, ...]:
        """The candidates, simplest first."""
        own, names = self.present(case), list(self.candidates(case))
        best = names.index(self.supported(case)) + 1
        return tuple(
            Setting(name, place, name, self.name, name == own, place if place <= best else 0)
            for place, name in enumerate(names, start=1)
        )

    def applied(self, case: Case, setting: Setting) -> Case:
        """The case whose recipe asks for this candidate, other choices as they are."""
        return replace(case, recipe=self.recipe(case.recipe, setting.value))

    def expected_s(self, case: Case, setting: Setting) -> float:
        """By the number of samples."""
        return expected_fits_s(case) * self.slow.get(setting.value, 1.0)

    def repeats(self, case: Case, setting: Setting) -> int:
        """Three times, once where a fit takes long."""
        return 1 if setting.value in self.slow else 3

    def measure(self, case: Case, setting: Setting, repeat: int) -> Sample:
        """Fit the candidate, compile it, and evaluate its torque over the scene."""
        recipe = self.recipe(as_fitted(case), setting.value)
        again = self.fits == "friction"
        friction, cut, seconds = refit(case, recipe, repeat, friction_too=again)
        assert cut is not None
        changed = replace(case, recipe=recipe, cut_fit=cut, friction_fit=friction)
        anew = (friction, cut) if again and friction is not None else (cut,)
        law = central_law(changed, cut, friction)
        sample = candidate_sample(changed, law, seconds, fits=anew)
        minutes = needed_minutes(case, _friction_speeds(changed), _cut_speeds(changed))
        if minutes is None:
            return replace(sample, notes=(*sample.notes, NO_MINUTES))
        return replace(sample, costs={**sample.costs, MINUTES: Quantity(minutes, "min")})

    def errors(self, case: Case, sample: Sample, reference: Sample | None) -> Mapping[str, Error]:
        """Of torque and ripple over the scene, and of hold-out strokes."""
        if reference is None:
            return {}
        own, other = sample.outcome, reference.outcome
        torque = np.asarray(other["torque"], dtype=float)
        largest = float(np.nanmax(np.abs(torque)))
        away = np.abs(np.subtract(own["ripple"], other["ripple"]))
        errors = {
            **torque_errors(case, own["torque"], torque),
            RIPPLE_AVERAGE: Error(float(away.mean()), "N m", float(away.mean()) / largest),
            RIPPLE_WORST: Error(float(away.max()), "N m", float(away.max()) / largest),
        }
        if own["holdout"] is not None:
            errors[HOLDOUT] = Error(own["holdout"], "N m", own["holdout"] / largest)
        return errors


class Response(CandidateKnob):
    """Force at the edge against indentation."""

    name, title = "response", "Candidate: response"
    slow: ClassVar[Mapping[str, float]] = {"spline": 10.0}

    def candidates(self, case: Case) -> Sequence[str]:
        """Power law, exponential, spline."""
        return FAMILIES["response"]

    def fitted(self, case: Case) -> str:
        """The fit's own."""
        return str(_cut(case).structure["response"])

    def recipe(self, recipe: Recipe, candidate: str) -> Recipe:
        """With this response."""
        return with_cut(recipe, response=candidate)


class Damping(CandidateKnob):
    """Whether the force at the edge grows with the rate at which the edge sinks in."""

    name, title = "damping", "Candidate: rate damping"

    def candidates(self, case: Case) -> Sequence[str]:
        """Without and with."""
        return (NONE, DAMPED)

    def fitted(self, case: Case) -> str:
        """The fit's own."""
        return DAMPED if _cut(case).structure.get("rate_damping") else NONE

    def recipe(self, recipe: Recipe, candidate: str) -> Recipe:
        """With or without damping."""
        return with_cut(recipe, rate_damping="fit" if candidate == DAMPED else "none")


class Fracture(CandidateKnob):
    """Whether the crack advances smoothly or in starts and stops, which are felt as a ripple."""

    name, title = "fracture", "Candidate: fracture"
    error = RIPPLE_WORST

    def candidates(self, case: Case) -> Sequence[str]:
        """Smooth and rippled."""
        return FAMILIES["fracture"]

    def fitted(self, case: Case) -> str:
        """The fit's own."""
        return str(_cut(case).structure["fracture"])

    def recipe(self, recipe: Recipe, candidate: str) -> Recipe:
        """With this fracture."""
        return with_cut(recipe, fracture=candidate)

    def single(self, case: Case) -> str:
        """A scene that only presses has no crack."""
        if case.recipe.scene.cut:
            return ""
        return "Nothing is cut in this scene (scene.cut = false), so there is no fracture."


class Friction(CandidateKnob):
    """Which terms the rendered friction has; "none" fits the simplest and renders none of it."""

    name, title = "friction", "Candidate: friction"
    cost = BYTES
    fits = "friction"
    laws = ("coulomb", "coulomb+viscous", "stribeck", "stribeck+angle")

    def candidates(self, case: Case) -> Sequence[str]:
        """No friction, Coulomb, viscous, Stribeck, angle, and the package's and the fit's law."""
        return tuple(dict.fromkeys((NONE, *self.laws, self.present(case), self.fitted(case))))

    def present(self, case: Case) -> str:
        """The package's, without terms that the recipe adds to every law."""
        return super().present(case).removesuffix("+adopted")

    def fitted(self, case: Case) -> str:
        """The fit's own."""
        assert case.friction_fit is not None
        return str(case.friction_fit.structure["law"])

    def recipe(self, recipe: Recipe, candidate: str) -> Recipe:
        """With this law; without friction the simplest is fitted, since a cut contains it."""
        if candidate == NONE:
            return with_scene(with_friction(recipe, law=self.laws[0]), render_friction=False)
        return with_friction(recipe, law=candidate)

    def single(self, case: Case) -> str:
        """A scene that renders no friction ships none of its laws."""
        if case.recipe.scene.render_friction:
            return ""
        return "The scene renders no friction (scene.render_friction = false)."


class Closure(CandidateKnob):
    """How torque follows from the force at the edge: the published equation 4, or the work."""

    name, title = "closure", "Candidate: closure"
    against = "the work of the forces"

    def supported(self, case: Case) -> str:
        """The work, which follows from the forces alone."""
        return "work"

    def candidates(self, case: Case) -> Sequence[str]:
        """Equation 4, which neglects the contact's height, and the gradient of the energy."""
        return FAMILIES["closure"]

    def fitted(self, case: Case) -> str:
        """The scene's own."""
        return case.recipe.scene.closure

    def recipe(self, recipe: Recipe, candidate: str) -> Recipe:
        """With this closure."""
        return with_scene(recipe, closure=candidate)


def candidate_sample(
    case: Case, law: Law, seconds: float, *, fits: Sequence[FitResult] = ()
) -> Sample:
    """What a law with a candidate costs, and its torque and ripple over the scene.

    ``seconds`` of processor time were spent on it; ``fits`` are those that were made anew, the
    first of them the one whose hold-out error counts.
    """
    model, points = model_of_law(law), scene_places(case)
    rng = np.random.default_rng(case.seed)
    costs = {
        PROCESSOR: Quantity(seconds, "s"),
        **package_costs(case, model, compiled(case, model), rng),
    }
    holdout = holdout_rms(fits[0]) if fits else math.nan
    torque = model_torque(case, model, points)
    ripple = felt(law, Scene(points, case.recipe.limits.torque_Nm)).ripple
    outcome = {
        "torque": [None if np.isnan(value) else float(value) for value in torque],
        "ripple": np.broadcast_to(ripple, (1, len(torque)))[0].tolist(),
        "holdout": holdout if math.isfinite(holdout) else None,
    }
    rejected = dict.fromkeys(verdict.check for fit in fits for verdict in fit.rejected)
    return Sample(costs, outcome, (), tuple(rejected))


def _cut(case: Case) -> FitResult:
    assert case.cut_fit is not None
    return case.cut_fit


def _friction_speeds(case: Case) -> int:
    """Parameters over the rate of a friction law: one for Coulomb, each other term its own."""
    assert case.friction_fit is not None
    names = {parameter.name for parameter in case.friction_fit.parameters}
    over_rate = ("viscous", "stribeck", "stribeck_rate")
    return 1 + sum(any(name.startswith(stem) for name in names) for stem in over_rate)


def _cut_speeds(case: Case) -> int:
    """Damping takes two speeds, and so do teeth: what moves with the speed is no tooth."""
    structure = _cut(case).structure
    return 2 if structure.get("rate_damping") or structure["fracture"] == "rippled" else 1


class Edge(CandidateKnob):
    """The blade's edge: a line, an arc or a cubic in the place of what photographs gave.

    Simpler edges are not fitted to the photographs again but to what the present law predicts
    (`package.simplest.project`); the time counted is that of the projection.
    """

    name, title = "edge", "Candidate: edge"
    cost = BYTES
    against = "the edge of the present fit"
    combined = False  # a fit has the edge that photographs gave it

    def candidates(self, case: Case) -> Sequence[str]:
        """Those below the fitted edge, and that one itself."""
        law = _law(case)
        simpler = [one.name for one in simpler_candidates(law, "edge")]
        return (*simpler, self.fitted(case))

    def fitted(self, case: Case) -> str:
        """The family of the fit's edge."""
        return fitted_candidate(_law(case), "edge").name

    def recipe(self, recipe: Recipe, candidate: str) -> Recipe:
        """Unchanged: photographs decide which edge a fit has."""
        return recipe

    def single(self, case: Case) -> str:
        """A line has nothing simpler below it."""
        if self.fitted(case) != "line":
            return ""
        return "The edge is a line, the simplest candidate."

    def expected_s(self, case: Case, setting: Setting) -> float:
        """A projection at the MAP point."""
        return 2.0

    def measure(self, case: Case, setting: Setting, repeat: int) -> Sample:
        """Project the law at the MAP point onto the candidate, and compile it."""
        began = time.process_time()
        law = projected(case, setting.value)
        return candidate_sample(case, law, time.process_time() - began)


def projected(case: Case, family: str) -> Law:
    """The fitted law with the nearest edge of another family, at the MAP point.

    The law itself for its own family. Raises ScissorcalError where no such edge exists.
    """
    law, candidate = _law(case), Candidate("edge", family)
    if candidate == fitted_candidate(law, "edge"):
        return law
    try:
        return project(Reference.of(law, case.recipe), candidate).law
    except ValueError as error:
        raise ScissorcalError(f"The edge cannot be a {family}: {error}.") from error


def _law(case: Case) -> Law:
    assert case.cut_fit is not None
    return central_law(case, case.cut_fit, case.friction_fit)
