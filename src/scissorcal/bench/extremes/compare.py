"""Whether model, kernel and package keep what they state: at one state, and over a long run."""

import dataclasses
import itertools
import math
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Literal

import numpy as np

from scissorcal.bench.extremes.exact_blade import Blade, Spot, Turned
from scissorcal.bench.extremes.exact_laws import NotComparedError, TableCurve, mp
from scissorcal.bench.extremes.states import State, blade_of_law, blade_of_tables
from scissorcal.errors import ScissorcalError
from scissorcal.kernel import Kernel, ModelTables, StepFlag
from scissorcal.package.average import AverageTorque
from scissorcal.package.exact import ExactModel
from scissorcal.package.model_package import ModelPackage

Outcome = Literal["right", "refused", "flagged", "not compared", "wrong"]
"""``right``: within the stated error of the truth. ``refused``: an error with a sentence, or an
output that is marked as refused. ``flagged``: a number whose own status says not to use it.
``not compared``: there is no truth, or it is larger than what is compared. ``wrong``: a number that
is none of these, or an error without a sentence."""
OUTCOMES: tuple[Outcome, ...] = ("right", "refused", "flagged", "not compared", "wrong")

MODEL_EPS = 2.0**-53
KERNEL_EPS = 2.0**-24
PARALLEL_MODEL = 1e-9
PARALLEL_KERNEL = 1e-6
LEAST_RUN = 0.05
"""What model and kernel state: slopes up to which edges count as parallel, and dx/ds from which a
kernel's edge has a point over a place."""

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

NO_EDGE = "NaN: no edge stands over the contact"
INVALID = "INVALID: the state cannot be evaluated"

Numbers = Mapping[str, Any]


@dataclass(frozen=True)
class Judgement:
    """What a subject (model, kernel, package, a long run) gave at one state, and how it is judged.

    ``error`` is the relative error of the torque (of a long run, of the energy), ``error_Nm`` the
    torque's absolute one, both NaN where there is none. ``roundings`` is the smallest displacement
    of plate and blades, in roundings, that explains it (0 where its own rounding does).
    ``sentence`` says what was refused or is wrong.
    """

    subject: str
    outcome: Outcome
    sentence: str = ""
    error: float = math.nan
    error_Nm: float = math.nan
    roundings: float = 0.0


def compare_model(state: State) -> Judgement:
    """The float64 model's torque, without friction, against the exact law."""

    def program() -> float:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            model = ExactModel(state.cutting, None)
            return float(model.torque(state.opening, state.rate, state.contact))

    def exact() -> Reference:
        return Reference(blade_of_law(state.cutting, PARALLEL_MODEL), state)

    return _judged("model", exact, program, NO_EDGE, partial(_by_roundings, eps=MODEL_EPS))


def compare_kernel(state: State, tables: ModelTables) -> Judgement:
    """A float32 step of the kernel against its own tables in 50 digits, friction included."""

    def program() -> float:
        kernel = Kernel(tables)
        kernel.reset(crack=state.contact)
        out = kernel.step(state.opening, state.rate, 0.0)
        if out.flags & StepFlag.INVALID:
            return math.nan
        return math.inf if math.isnan(out.torque) else out.torque

    def exact() -> Reference:
        return Reference(blade_of_tables(tables, PARALLEL_KERNEL), state, LEAST_RUN, tables)

    return _judged("kernel", exact, program, INVALID, partial(_by_roundings, eps=KERNEL_EPS))


def compare_package(state: State, package: ModelPackage) -> Judgement:
    """The average torque that a package renders, without friction, against the exact law.

    Right within the package's stated bound, where it covers the state; flagged elsewhere, where it
    states no error. Both torques are held to the package's limit.
    """
    manifest = package.manifest
    limit, bound = manifest.limits.torque_Nm, manifest.bound.stated_Nm
    place = [np.array([value]) for value in (state.opening, state.rate, state.contact)]

    def program() -> float:
        bare = manifest.mechanics.model_copy(update={"friction": None})
        return float(AverageTorque(bare, manifest.ranges, package.arrays).torque(*place)[0])

    def exact() -> Reference:
        return Reference(blade_of_law(state.cutting, PARALLEL_KERNEL), state, LEAST_RUN)

    def by_bound(torque: float, truth: Numbers, exact: Reference) -> Judgement:
        felt, true = (max(-limit, min(limit, float(value))) for value in (torque, truth["torque"]))
        errors = errors_of(felt, true)
        if not package.covers(*place)[0]:
            words = "OutsideCoverageWarning: outside what the package covers"
            return Judgement("package", "flagged", words, *errors)
        if abs(felt - true) <= bound:
            return Judgement("package", "right", "", *errors)
        words = f"{felt:.6g} N m where it is {true:.6g} N m, stated {bound:.2g}"
        return Judgement("package", "wrong", words, *errors)

    return _judged("package", exact, program, NO_EDGE, by_bound)


@dataclass(frozen=True)
class Reference:
    """The exact answer at a state: of the law on average, or, with ``tables``, of their step.

    ``least_run`` is dx/ds above which the program states that it finds an edge over a place.
    """

    law: Blade
    state: State
    least_run: float = 0.0
    tables: ModelTables | None = None

    def at(self, upper: float = 0.0, turn: float = 0.0, toughness: float = 0.0) -> Numbers:
        """The answer for a plate and blades displaced (m, rad), a fracture energy by a share."""
        turned = self.law.turned(mp.mpf(self.state.opening) + turn, upper, toughness)
        spot, least = turned.over(mp.mpf(self.state.contact))
        least = min(least, turned.least_run_of_blade())
        if self.least_run:
            least = min(least, turned.cosine)
        if spot is None or least <= self.least_run:
            return {"stands": 0.0, "least": least}
        return {"stands": 1.0, "least": least} | self._standing(turned, spot, turn)

    def _standing(self, turned: Turned, spot: Spot, turn: float) -> dict[str, Any]:
        """Where an edge stands over the contact; a step of tables as sc_model.h describes it."""
        law, rate, steps = self.law, mp.mpf(self.state.rate), self.tables is not None
        share = 1 if steps else None
        rests, before_tip, rises = spot, spot.station < law.tip, False
        ran = before_tip and law.toughness > 0 and turned.excess(spot.station, share) > 0
        tooth: tuple[Spot, ...] = ()
        if ran:
            rests, before_tip, rises = turned.rests(spot, share)
        if ran and steps and before_tip and law.kappa < 1:
            stop, _, again = turned.rests(rests, law.kappa)
            rises, length = rises or again, stop.x - rests.x
            if length > SHORTEST_RIPPLE_m:
                tooth = (rests, stop)
                runs = mp.ceil((rests.x - spot.x) / length)
                rests = turned.over(spot.x + runs * length)[0] or rests
        on = 1 if before_tip else 0
        friction = table_friction(self.tables, self.state.opening + turn, rate)
        torque = on * turned.torque(rests, rate) + friction
        answer = {"rises": rises, "torque": torque} | _sizes(law, rests, rate, friction)
        blur = answer["reach"] * answer["steep"]
        if tooth:
            teeth = abs(rests.x - spot.x) / (tooth[1].x - tooth[0].x)
            blur = (RIPPLE_BLUR + teeth) * (blur + abs(spot.x))

        def blurred(eps: float) -> list[Any]:
            """Torques of cracks that stand by ``eps`` times the blur (m) elsewhere."""
            away, places = eps * blur, list(tooth)
            if not tooth or min(rests.x - tooth[0].x, tooth[1].x - rests.x) > away:
                near = (turned.over(rests.x + way * away)[0] for way in (-1, 1) if before_tip)
                places = [place for place in near if place is not None]
            return [turned.torque(place, rate) + friction for place in places]

        return answer | {"blurred": blurred}


def table_friction(tables: ModelTables | None, opening: float, rate: Any) -> Any:
    """The torque that the tables' friction adds, exactly."""
    if tables is None or not tables.render_friction:
        return mp.mpf(0)
    least = mp.mpf(float(np.float32(tables.friction_rate_eps)))
    level = tables.friction_opening if rate > 0 else tables.friction_closing
    friction = TableCurve.of(level).held(max(abs(rate), least)) * min(abs(rate) / least, 1)
    friction *= TableCurve.of(tables.friction_angle).held(mp.mpf(opening))
    return -friction if rate > 0 else friction


def _sizes(law: Blade, spot: Spot, rate: Any, friction: Any) -> dict[str, Any]:
    """What roundings are shares of: lengths that are added, torque that is, and its stiffness."""
    lever = abs(spot.x) + abs(spot.y * spot.slope)
    lever *= 1 + law.damping * lever * abs(rate) / law.moving
    stiffness = mp.mpf(0)
    if spot.depth > 0:
        deeper = spot.depth * mp.mpf(10) ** -15
        stiffness = (law.response.at(spot.depth + deeper) - spot.force) / deeper
    return {
        "reach": abs(spot.station) + abs(spot.y) + abs(spot.x) + abs(law.upper_face),
        "scale": abs(spot.force) * lever + abs(friction),
        "steep": 1 + abs(spot.slope),
        "stiffness": stiffness * lever,
    }


def errors_of(torque: Any, truth: Any) -> tuple[float, float]:
    """Relative and absolute error of a torque; the first is NaN where the truth is 0."""
    away = abs(mp.mpf(torque) - truth)
    return float(away / abs(truth)) if truth else math.nan, float(away)


def _judged(
    subject: str,
    make: Callable[[], Reference],
    program: Callable[[], float],
    refused: str,
    judge: Callable[[float, Numbers, Reference], Judgement],
) -> Judgement:
    """Compare the torque that a program gives, NaN where it refused, with the exact answer."""
    try:
        exact = make()
        truth = exact.at()
    except NotComparedError as error:
        return Judgement(subject, "not compared", str(error))
    try:
        torque = program()
    except ScissorcalError as error:
        return Judgement(subject, "refused", str(error))
    except Exception as error:  # noqa: BLE001 - whatever it raises is what is reported
        return Judgement(subject, "wrong", f"{type(error).__name__}: {error}")
    least, stands = float(truth["least"]), truth["stands"]
    if math.isnan(torque):  # right only where the program states that it refuses
        if not stands or least <= exact.least_run + 1e-3 or abs(truth["torque"]) > LARGEST_FLOAT32:
            return Judgement(subject, "refused", refused)
        return Judgement(subject, "wrong", f"refused, although it is {_short(truth)}")
    if not stands:  # right only on the border to where an edge stands
        words = "a number where no edge stands over the contact"
        near = abs(least - exact.least_run) < 1e-4
        return Judgement(subject, "refused" if near else "wrong", words)
    if math.isinf(torque):
        return Judgement(subject, "wrong", f"not finite where it is {_short(truth)}")
    if abs(truth["torque"]) > LARGEST_N:
        return Judgement(subject, "not compared", "above 1e30 N m")
    return replace(judge(torque, truth, exact), subject=subject)


def _by_roundings(torque: float, truth: Numbers, exact: Reference, eps: float) -> Judgement:
    """Right for the truth or for one that is displaced by up to 16 roundings."""
    errors = errors_of(torque, truth["torque"])
    for roundings in PLACE_ROUNDINGS:
        if _explained(torque, truth, exact, eps, roundings):
            return Judgement("", "right", "", *errors, roundings)
    if truth["rises"]:
        words = "release_falls is false: the release rises again along the blade"
        return Judgement("", "flagged", words, *errors)
    return Judgement("", "wrong", f"{torque:.6g} N m where it is {_short(truth)}", *errors)


def _explained(
    torque: float, truth: Numbers, exact: Reference, eps: float, roundings: float
) -> bool:
    """Whether plate or blades displaced by so many roundings have the torque."""
    values = [truth]
    if roundings:
        upper = float(truth["reach"] * truth["steep"]) * roundings * eps
        turn = roundings * eps
        for shift in ((upper, 0.0, 0.0), (-upper, 0.0, 0.0), (0.0, turn, 0.0), (0.0, -turn, 0.0),
                      (0.0, 0.0, turn), (0.0, 0.0, -turn)):  # fmt: skip
            try:
                values.append(exact.at(*shift))
            except NotComparedError:
                return True
    torques = [v["torque"] for v in values if v["stands"]]
    if roundings:
        torques += truth["blurred"](roundings * eps)
    slack = VALUE_ROUNDINGS * eps * float(max(v["scale"] for v in values if v["stands"]))
    low, high = float(min(torques)), float(max(torques))
    slack += float(truth["stiffness"] * truth["reach"] * truth["steep"]) * roundings * eps
    return low - slack <= torque <= high + slack


def _short(truth: Numbers) -> str:
    return f"{float(truth['torque']):.6g} N m"


STEP_rad = 1e-5
STROKES = 3
WITHDRAWN = 0.36
"""Share of the whole stroke by which the blades withdraw after each part of it."""
ROUNDING_m = 1e-7
"""Some ten float32 roundings of a place on the blade: a contact that falls by less stands still."""

Ends = tuple[float, float]
"""The openings (rad) between which the blades move."""


def strokes(tables: ModelTables, ends: Ends, contact: float) -> Judgement:
    """Close, withdraw and close farther; compare the blades' work with the kernel's books.

    Friction and rate damping lose energy that a step does not report, so that the blades are
    without. The balance is stated to 16 roundings of the work and what the trapezoid over steps
    leaves: half a step times the change of torque in it, and where a crack with a ripple ran also
    a tooth's drop and a rounding of its place.
    """
    bare = dataclasses.replace(tables, render_friction=False, rate_damping=0.0)
    judged = partial(Judgement, "strokes")
    last, first = ends
    turns = [first]
    for stroke in range(STROKES):
        lowest = first - (first - last) * (stroke + 1) / STROKES
        turns += [lowest, min(lowest + WITHDRAWN * (first - last), first)]
    path = [
        np.linspace(a, b, int(abs(b - a) / STEP_rad), endpoint=False)
        for a, b in itertools.pairwise(turns)
    ]
    opening = np.concatenate(path).astype(np.float32).astype(np.float64)
    kernel = Kernel(bare)
    kernel.reset(crack=0.0)
    out = kernel.step_many(opening, -1.0, -contact)
    if not all(np.isfinite(out[name]).all() for name in out.dtype.names or ()):
        return judged("wrong", "an output is not finite")
    if np.any(out["flags"] & StepFlag.INVALID):
        return judged("refused", "INVALID: the edge leans back")
    crack, torque = (out[name].astype(np.float64) for name in ("contact", "torque"))
    reached = out["flags"] & StepFlag.BEYOND_TIP == 0
    if np.any(np.diff(crack[reached]) < -ROUNDING_m) or np.any(out["fracture_J"] < 0):
        return judged("wrong", "the crack recedes")
    turn, mean = np.diff(opening), 0.5 * (torque[1:] + torque[:-1])
    gross = float(np.sum(np.abs(mean * turn)))
    if gross == 0.0:
        return judged("wrong", "nothing was touched, so that nothing is compared")
    spent = np.sum(out["fracture_J"][1:].astype(np.float64) + out["arrest_J"][1:])
    kept = float(out["stored_J"][-1]) - float(out["stored_J"][0])
    away = abs(float(-np.sum(mean * turn) - spent) - kept)
    change = np.abs(np.diff(torque))
    ran = (out["flags"][1:] & StepFlag.ADVANCED != 0) & (tables.kappa < 1.0)
    drop = np.where(ran, np.abs(torque[1:]) * (1.0 / max(tables.kappa, KERNEL_EPS) - 1.0), 0.0)
    rounded = np.sum(ran) * KERNEL_EPS * float(np.max(np.abs(crack))) * tables.fracture_energy
    rounded += VALUE_ROUNDINGS * KERNEL_EPS * gross
    allowed = float(np.sum((0.5 * change + drop) * np.abs(turn)) + rounded)
    words = f"energy balance: error {away / gross:.2g}, stated {allowed / gross:.2g}"
    return judged("right" if away <= allowed else "wrong", words, away / gross)
