"""One state: model and kernel against 50 digits, and whether each keeps what it states."""

import math
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Literal

import numpy as np

from scissorcal.bench.extremes.cells import Outcome, refusal
from scissorcal.bench.extremes.exact_blade import (
    Blade,
    Spot,
    Turned,
    kept_target,
    mean_target,
    peak_target,
)
from scissorcal.bench.extremes.exact_laws import OverflowedError, mp
from scissorcal.bench.extremes.states import State
from scissorcal.kernel import Kernel, StepFlag
from scissorcal.package.exact import ExactModel

Subject = Literal["model", "kernel", "tables"]

MODEL_EPS = 2.0**-53
KERNEL_EPS = 2.0**-24
PARALLEL_MODEL = 1e-9
PARALLEL_KERNEL = 1e-6
KERNEL_CAP_N = 1e6
LEAST_RUN = 0.05
"""What model and kernel state: slopes up to which edges count as parallel, the kernel's cap on the
response, and dx/ds from which its edge has a point over a place."""

SHORTEST_RIPPLE_m = 1e-7

PLACE_ROUNDINGS = (0.0, 1.0, 4.0, 16.0)
VALUE_ROUNDINGS = 16.0
"""Stated error. The number is right for a plate or a crack that stands up to this many roundings of
the lengths that are added elsewhere, blades turned by as many roundings of a radian, or a fracture
energy changed by as many; times 1 +- 16 roundings. The displacements are tried from the
least on."""

RIPPLE_BLUR = 16.0
"""The place of a crack after several teeth in one step is known to this many displacements and one
more for each tooth. Every torque is right that the crack has within that; any of the tooth's cycle,
where it is as long as a tooth or the crack stands so close to the tooth's end."""

LARGEST_FLOAT32 = 3.4e38
LARGEST_N = 1e30
"""No force beyond is compared: there is nothing that it could be the force of."""

Numbers = Mapping[str, Any]


@dataclass(frozen=True)
class Compared:
    """A subject at one state.

    ``relative`` and ``absolute`` are the largest errors of each output, ``roundings`` the smallest
    displacement of plate and blades, in roundings, that explains the torque's (0 where its own
    rounding does). ``sentence`` says what was refused or is wrong.
    """

    subject: Subject
    outcome: Outcome
    sentence: str = ""
    relative: Mapping[str, float] = field(default_factory=dict)
    absolute: Mapping[str, float] = field(default_factory=dict)
    roundings: float = 0.0


def compare_model(state: State) -> Compared:
    """The float64 model's torque, crack and energy against the exact law."""
    law = state.exact_law(PARALLEL_MODEL)
    opening, contact, rate = (mp.mpf(v) for v in (state.opening, state.contact_m, state.rate))

    def exact(upper: float, turn: float, toughness: float) -> Numbers:
        turned = law.turned(opening + turn, upper, toughness)
        spot, least = turned.over(contact)
        least = min(least, turned.least_run_of_blade())
        if spot is None:
            return {"stands": 0.0, "least": least}
        return _model_answer(law, turned, spot, rate, least)

    def program() -> Numbers:
        model = ExactModel(state.cutting, None)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            place = model.settled(state.opening, state.contact_m)
            torque = float(model.torque_settled(state.opening, state.rate, place))
            view = _view(model, place, state)
            depth = state.upper_face_m - float(view.height)
            energy = float(state.cutting.response.energy_at(depth)) * state.moving
        reached = float(view.station) < state.values["blade_length"]
        return {"torque": torque, "crack": float(place), "energy": energy if reached else 0.0}

    return _judged("model", state, law, exact, program, MODEL_EPS)


def compare_kernel(state: State) -> tuple[Compared, Compared]:
    """The float32 kernel's step against its own tables, and the tables against the exact law."""
    try:
        deepest = _deepest(state)
        tables, close = state.tables(deepest)
        kernel = Kernel(tables)
    except ValueError as error:
        found = refusal(error)
        refused = Compared("kernel", found.outcome, found.sentence)
        return refused, Compared("tables", found.outcome, found.sentence)
    law = state.exact_tables(tables, KERNEL_CAP_N, PARALLEL_KERNEL)
    opening, contact, rate = (mp.mpf(v) for v in (state.opening, state.contact_m, state.rate))

    def exact(upper: float, turn: float, toughness: float) -> Numbers:
        turned = law.turned(opening + turn, upper, toughness)
        spot, least = turned.over(contact)
        least = min(least, turned.least_run_of_blade())
        if spot is None or least <= LEAST_RUN or turned.cosine <= LEAST_RUN:
            return {"stands": 0.0, "least": min(least, turned.cosine)}
        return _kernel_answer(law, turned, spot, rate, least)

    def program() -> Numbers:
        kernel.reset(crack=state.contact_m)
        out = kernel.step(state.opening, state.rate, 0.0)
        if out.flags & StepFlag.INVALID:
            return {"refused": "INVALID: the state cannot be evaluated"}
        names = {"energy": out.stored_J, "fracture": out.fracture_J, "arrest": out.arrest_J}
        return {"torque": out.torque, "force": out.force, "crack": kernel.crack, **names}

    arithmetic = _judged("kernel", state, law, exact, program, KERNEL_EPS)
    return arithmetic, _table_error(state, law, exact, close)


def _model_answer(law: Blade, turned: Turned, spot: Spot, rate: Any, least: Any) -> dict[str, Any]:
    rests, before_tip, rises = spot, spot.station < law.tip, False
    if before_tip and law.toughness > 0 and turned.released(spot) > mean_target(turned, spot):
        rests, before_tip, rises = turned.rests(spot, mean_target)
    torque = turned.torque(rests, rate) if before_tip else mp.mpf(0)
    answer = {"stands": 1.0, "least": least, "torque": torque, "rises": float(rises)}
    if before_tip:
        answer |= {"crack": rests.x, "energy": rests.stored}
    answer |= _sizes(law, rests, rate)
    blur = answer["reach"] * answer["steep"]
    return answer | {"blurred": partial(_blurred, turned, rate, rests.x, before_tip, (), blur)}


def _sizes(law: Blade, spot: Spot, rate: Any) -> dict[str, Any]:
    """What roundings are shares of: lengths that are added, torque that is, and its stiffness."""
    lever = abs(spot.x) + abs(spot.y * spot.slope)
    lever *= 1 + law.damping * lever * abs(rate) / law.moving
    stiffness = mp.mpf(0)
    if spot.depth > 0:
        more = spot.depth * mp.mpf(10) ** -15
        stiffness = (law.response.at(spot.depth + more)[0] - spot.force) / more
    return {
        "reach": abs(spot.station) + abs(spot.y) + abs(spot.x) + abs(law.upper_face),
        "scale": abs(spot.force) * lever,
        "steep": 1 + abs(spot.slope),
        "stiffness": stiffness * lever,
    }


def _kernel_answer(law: Blade, turned: Turned, spot: Spot, rate: Any, least: Any) -> dict[str, Any]:
    """A step of the kernel as sc_model.h describes it."""
    zero = mp.mpf(0)
    rests, before_tip, rises = spot, spot.station < law.tip, False
    fracture = arrest = zero
    envelope: tuple[Spot, ...] = ()
    reached = before_tip
    if reached and law.toughness > 0 and turned.released(spot) > law.toughness:
        rests, before_tip, rises = turned.rests(spot, peak_target)
        moved = rests.x - spot.x
        if not before_tip:
            fracture, arrest = law.kappa * law.toughness * moved, spot.stored
        elif law.kappa < 1:
            kept = law.kappa * law.toughness
            stop, _, more = turned.rests(rests, kept_target)
            rises = rises or more
            length = stop.x - rests.x
            if length > SHORTEST_RIPPLE_m:
                envelope = (rests, stop)
                runs = mp.ceil(moved / length)
                lost = rests.stored - stop.stored - kept * length
                fracture, arrest = kept * runs * length, runs * max(lost, zero)
                placed, _ = turned.over(spot.x + runs * length)
                rests = placed if placed is not None else rests
            else:
                fracture = law.toughness * moved
        else:
            fracture = law.toughness * moved
    elif reached and not before_tip:
        arrest = spot.stored
    if not reached:
        arrest = spot.stored
    on = 1 if before_tip else 0
    answer = {
        "stands": 1.0, "least": least, "rises": float(rises),
        "torque": on * turned.torque(rests, rate), "force": on * turned.push(rests, rate),
        "crack": rests.x, "energy": on * rests.stored, "fracture": fracture, "arrest": arrest,
    }  # fmt: skip
    answer |= _sizes(law, rests, rate)
    blur = answer["reach"] * answer["steep"]
    if envelope:
        teeth = abs(rests.x - spot.x) / (envelope[1].x - envelope[0].x)
        blur = (RIPPLE_BLUR + teeth) * (blur + abs(spot.x))
    answer["blurred"] = partial(_blurred, turned, rate, rests.x, before_tip, envelope, blur)
    return answer


def _blurred(
    turned: Turned,
    rate: Any,
    place: Any,
    before_tip: bool,
    tooth: tuple[Spot, ...],
    blur: Any,
    eps: float,
) -> list[Any]:
    """Torques of cracks that stand by ``eps`` times ``blur`` (m) elsewhere, in their tooth."""
    away = eps * blur
    if tooth and min(place - tooth[0].x, tooth[1].x - place) <= away:
        return [turned.torque(one, rate) for one in tooth]
    near = (turned.over(place + way * away)[0] for way in (-1, 1)) if before_tip else ()
    return [turned.torque(one, rate) for one in near if one is not None]


def _judged(
    subject: Subject,
    state: State,
    law: Blade,
    exact: Callable[[float, float, float], Numbers],
    program: Callable[[], Numbers],
    eps: float,
) -> Compared:
    """Compare what a program gives with the exact answer and its displaced ones."""
    try:
        truth = exact(0.0, 0.0, 0.0)
    except OverflowedError:
        return Compared(subject, "not compared", "above 1e30 N")
    try:
        given = program()
    except Exception as error:  # noqa: BLE001 - whatever it raises is what is reported
        found = refusal(error)
        return Compared(subject, found.outcome, found.sentence)
    refused = str(given.get("refused", ""))
    if not refused and any(not math.isfinite(float(v)) for v in given.values()):
        nan = math.isnan(float(given["torque"])) and subject == "model"
        refused = "NaN: no edge stands over the contact" if nan else ""
        if not nan:
            return Compared(subject, "wrong", f"not finite: {_short(given)}")
    if refused:
        return _refused(subject, truth, refused)
    if not truth["stands"]:
        close = abs(float(truth["least"]) - (LEAST_RUN if subject == "kernel" else 0.0)) < 1e-4
        word: Outcome = "refused" if close else "wrong"
        return Compared(subject, word, "a number where no edge stands over the contact")
    if max(abs(truth["torque"]), abs(truth.get("energy", 0))) > LARGEST_N:
        return Compared(subject, "not compared", "above 1e30 N m")
    relative, absolute = _errors(given, truth)
    for roundings in PLACE_ROUNDINGS:
        if _explained(given, truth, exact, eps, roundings):
            return Compared(subject, "right", "", relative, absolute, roundings)
    if truth["rises"]:
        return Compared(
            subject, "flagged", "release_falls is false: the release rises again along the blade",
            relative, absolute, math.nan,
        )  # fmt: skip
    words = f"{_short(given)} where it is {_short(truth)}"
    return Compared(subject, "wrong", words, relative, absolute, math.inf)


def _explained(
    given: Numbers,
    truth: Numbers,
    exact: Callable[[float, float, float], Numbers],
    eps: float,
    roundings: float,
) -> bool:
    """Whether plate or blades displaced by so many roundings have the torque."""
    values = [truth]
    if roundings:
        upper = float(truth["reach"] * truth["steep"]) * roundings * eps
        turn = roundings * eps
        for shift in ((upper, 0.0, 0.0), (-upper, 0.0, 0.0), (0.0, turn, 0.0), (0.0, -turn, 0.0),
                      (0.0, 0.0, turn), (0.0, 0.0, -turn)):  # fmt: skip
            try:
                values.append(exact(*shift))
            except OverflowedError:
                return True
    torques = [v["torque"] for v in values if v["stands"]]
    if roundings:
        torques += truth["blurred"](roundings * eps)
    slack = VALUE_ROUNDINGS * eps * float(max(v["scale"] for v in values if v["stands"]))
    low, high = float(min(torques)), float(max(torques))
    slack += float(truth["stiffness"] * truth["reach"] * truth["steep"]) * roundings * eps
    return low - slack <= float(given["torque"]) <= high + slack


def _errors(given: Numbers, truth: Numbers) -> tuple[dict[str, float], dict[str, float]]:
    relative, absolute = {}, {}
    for name, value in given.items():
        if name not in truth:
            continue
        away = abs(mp.mpf(float(value)) - truth[name])
        absolute[name] = float(away)
        if truth[name]:
            relative[name] = float(away / abs(truth[name]))
    return relative, absolute


def _refused(subject: Subject, truth: Numbers, sentence: str) -> Compared:
    """A refusal is right only where the program states that it refuses."""
    huge = any(abs(truth[n]) > LARGEST_FLOAT32 for n in ("torque", "force", "energy") if n in truth)
    edge = LEAST_RUN if subject == "kernel" else 0.0
    if not truth["stands"] or float(truth["least"]) <= edge + 1e-3 or huge:
        return Compared(subject, "refused", sentence)
    return Compared(subject, "wrong", f"refused, although it is {_short(truth)}")


def _table_error(
    state: State, law: Blade, exact: Callable[[float, float, float], Numbers], close: bool
) -> Compared:
    """The exact torque of the tables against the exact torque of the law, without its ripple."""
    pure = state.exact_law(PARALLEL_KERNEL)
    opening, contact, rate = (mp.mpf(v) for v in (state.opening, state.contact_m, state.rate))
    try:
        turned = pure.turned(opening)
        spot, least = turned.over(contact)
        ours = exact(0.0, 0.0, 0.0)
        if spot is None or not ours["stands"] or least <= LEAST_RUN:
            return Compared("tables", "refused", "no edge stands over the contact")
        truth = _kernel_answer(pure, turned, spot, rate, least)
    except OverflowedError:
        return Compared("tables", "not compared", "above 1e30 N")
    relative, absolute = _errors({n: ours[n] for n in ("torque", "crack")}, truth)
    outcome: Outcome = "right" if close else "flagged"
    words = "" if close else "fit_table: not met, too few knots for the law"
    return Compared("tables", outcome, words, relative, absolute)


def _deepest(state: State) -> float:
    """The deepest indentation that a state needs, as `package.compile` would find it."""
    model = ExactModel(state.cutting, None)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        place = model.settled(state.opening, state.contact_m)
        depths = [
            state.upper_face_m - float(_view(model, at, state).height)
            for at in (np.asarray(state.contact_m), place)
        ]
    known = [depth for depth in depths if math.isfinite(depth) and depth > 0.0]
    return max([*known, 1e-9])


def _view(model: ExactModel, place: Any, state: State) -> Any:
    from scissorcal.model import edge_height

    return edge_height(model.cutting.edge, place, model.blade_angle(state.opening))


def _short(numbers: Numbers) -> str:
    shown = [n for n in ("torque", "crack", "energy") if n in numbers]
    return ", ".join(f"{name} {float(numbers[name]):.6g}" for name in shown) or "no answer"
