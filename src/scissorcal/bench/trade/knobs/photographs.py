"""Photographs: how many and how wide, against the edge and the plate's pose from all of them."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from scissorcal.bench.trade.case import Case, Photographed
from scissorcal.bench.trade.fits import PROCESSOR
from scissorcal.bench.trade.models import fitted_model, nothing_rendered
from scissorcal.bench.trade.pictures import (
    count_of,
    factors_of,
    fit_edge,
    locate_plate,
    size_of,
)
from scissorcal.bench.trade.point import Error, Quantity, Sample, Setting
from scissorcal.bench.trade.torque import (
    WORST,
    model_torque,
    scene_places,
    torque_errors,
)
from scissorcal.package.exact import ExactModel
from scissorcal.recipe.requirements import requirements
from scissorcal.verdicts import failed
from scissorcal.vision.geometry.pose import Pose, difference

COUNT, WIDTH = "photographs", "width"
EDGE, TAPER = "edge, rms", "taper, rms"
PLACE, TURN = "place", "turn"
NUMBER, WIDTHS = "all pixels, fewer photographs", "all photographs, fewer pixels"
STATIONS = 31
HELD = (
    "Torque is that of the present fits with this edge in them: a fit of the cut with it may adapt "
    "its parameters and come closer."
)


class Photographs:
    """How many photographs of the blade are measured, and at which width."""

    name = "photographs"
    title = "Photographs of the blade"
    cost = PROCESSOR
    error = WORST
    against = "the edge from all photographs at their full width"
    of_torque, stand_in, combined = True, False, True

    def missing(self, case: Case) -> str:
        """Where the recipe states the edge, or nothing was photographed."""
        if not requirements(case.recipe).needs_geometry("blade"):
            return (
                'The recipe states the edge (rig.edge.source = "recipe"): no photograph gives it.'
            )
        if not case.photographs:
            return "There are no photographs of the blade."
        return nothing_rendered(case)

    def settings(self, case: Case) -> tuple[Setting, ...]:
        """Fewer photographs, then coarser ones; all at full width are the reference."""
        return _photo_settings(case.photographs)

    def applied(self, case: Case, setting: Setting) -> Case:
        """The case with the first so many photographs; the width is that of the files."""
        kept, left = [], int(setting.value["count"])
        for one in case.photographs:
            kept.append(replace(one, paths=one.paths[:left]))
            left = max(0, left - len(one.paths))
        return replace(case, photographs=tuple(one for one in kept if one.paths))

    def expected_s(self, case: Case, setting: Setting) -> float:
        """Each photograph, and comparing edges over all points."""
        return 25.0 * float(setting.value["count"]) / max(1.0, 0.5 * float(setting.value["factor"]))

    def repeats(self, case: Case, setting: Setting) -> int:
        """Each repeat picks other photographs; all of them are fitted once, as that takes long."""
        return 1 if setting.value["count"] == count_of(case.photographs) else 2

    def measure(self, case: Case, setting: Setting, repeat: int) -> Sample:
        """Fit the edge, and put it into the model of the present fits."""
        chosen = setting.value["count"], setting.value["factor"]
        fit, seconds = fit_edge(case, chosen, np.random.default_rng([case.seed, repeat]))
        model, edge = fitted_model(case), fit.edge_posterior.edge
        length = case.recipe.rig.edge.length_m
        station = np.linspace(0.1, 0.95, STATIONS) * length
        changed = ExactModel(replace(model.cutting, edge=edge), model.friction)
        torque = model_torque(case, changed, scene_places(case))
        outcome = {
            "offset_m": edge.offset_at(station).tolist(),
            "taper_rad": np.arctan(edge.slope_at(station)).tolist(),
            "torque": [None if np.isnan(value) else float(value) for value in torque],
        }
        costs = _costs(seconds, setting)
        rejected = dict.fromkeys(verdict.check for verdict in failed(fit.verdicts))
        return Sample(costs, outcome, (HELD,), tuple(rejected))

    def errors(self, case: Case, sample: Sample, reference: Sample | None) -> Mapping[str, Error]:
        """Of edge and taper along the blade, and of the torque with this edge."""
        if reference is None:
            return {}
        own, other = sample.outcome, reference.outcome
        return {
            **torque_errors(case, own["torque"], other["torque"]),
            EDGE: Error(1e6 * _rms(own["offset_m"], other["offset_m"]), "um"),
            TAPER: Error(1e3 * _rms(own["taper_rad"], other["taper_rad"]), "mrad"),
        }


class Plate:
    """How many photographs of the plate are measured, and at which width."""

    name = "plate"
    title = "Photographs of the plate"
    cost = PROCESSOR
    error = PLACE
    against = "the plate's pose from all photographs at their full width"
    of_torque, stand_in, combined = False, False, False

    def missing(self, case: Case) -> str:
        """Where the recipe states the pose, or nothing was photographed."""
        if not requirements(case.recipe).needs_geometry("plate"):
            return "The scene takes the plate's pose as known (scene.plate_pose)."
        if case.plate is None or not case.plate.paths or case.camera is None:
            return "There are no photographs of the plate, or there is no fit of the camera."
        return ""

    def settings(self, case: Case) -> tuple[Setting, ...]:
        """Fewer photographs, then coarser ones; all at full width are the reference."""
        return _photo_settings((case.plate,)) if case.plate else ()

    def applied(self, case: Case, setting: Setting) -> Case:
        """The case with the first so many photographs; the width is that of the files."""
        if case.plate is None:
            return case
        kept = replace(case.plate, paths=case.plate.paths[: int(setting.value["count"])])
        return replace(case, plate=kept)

    def expected_s(self, case: Case, setting: Setting) -> float:
        """Each photograph, and the poses of all."""
        return 1.0 + 0.5 * float(setting.value["count"]) / float(setting.value["factor"])

    def repeats(self, case: Case, setting: Setting) -> int:
        """Each repeat picks other photographs."""
        return 3

    def measure(self, case: Case, setting: Setting, repeat: int) -> Sample:
        """Detect the target in the photographs picked, and fit one pose to them."""
        chosen = setting.value["count"], setting.value["factor"]
        fit, seconds = locate_plate(case, chosen, np.random.default_rng([case.seed, repeat]))
        pose = fit.camera_plate
        outcome = {
            "quaternion": [float(value) for value in pose.quaternion],
            "translation_m": [float(value) for value in pose.translation_m],
        }
        rejected = dict.fromkeys(verdict.check for verdict in fit.rejected)
        return Sample(_costs(seconds, setting), outcome, (), tuple(rejected))

    def errors(self, case: Case, sample: Sample, reference: Sample | None) -> Mapping[str, Error]:
        """How far the pose is shifted (mm) and turned (deg)."""
        if reference is None:
            return {}
        away = difference(_pose(sample), _pose(reference))
        return {
            PLACE: Error(1e3 * float(np.linalg.norm(away[3:])), "mm"),
            TURN: Error(float(np.degrees(np.linalg.norm(away[:3]))), "deg"),
        }


def _photo_settings(photographed: Sequence[Photographed]) -> tuple[Setting, ...]:
    """Numbers of photographs at full width, and widths of all of them; cheapest first."""
    count, (width, height) = count_of(photographed), size_of(photographed)
    coarser = [factor for factor in factors_of(width, height) if factor > 1]
    fewer = [
        Setting(_words(number, width), number, _value(number, 1, width), NUMBER)
        for number in range(1, count)
    ]
    narrower = [
        Setting(_words(count, width // factor), count, _value(count, factor, width), WIDTHS)
        for factor in sorted(coarser, reverse=True)
    ]
    whole = Setting(
        _words(count, width), count, _value(count, 1, width), NUMBER, present=True, accuracy=1
    )
    return (*fewer, *narrower, whole)


def _value(count: int, factor: int, width: int) -> dict[str, int]:
    return {"count": count, "factor": factor, "width_px": width // factor}


def _words(count: int, width: int) -> str:
    return f"{count} photograph{'s' if count > 1 else ''}, {width} px wide"


def _costs(seconds: float, setting: Setting) -> dict[str, Quantity]:
    return {
        PROCESSOR: Quantity(seconds, "s"),
        COUNT: Quantity(float(setting.value["count"]), ""),
        WIDTH: Quantity(float(setting.value["width_px"]), "px"),
    }


def _rms(one: Sequence[float], other: Sequence[float]) -> float:
    return float(np.sqrt(np.mean(np.subtract(one, other) ** 2)))


def _pose(sample: Sample) -> Pose:
    return Pose(tuple(sample.outcome["quaternion"]), tuple(sample.outcome["translation_m"]))
