"""One state: model, kernel and package against 50 digits, and whether each keeps what it states."""

import math
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
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

Numbers = Mapping[str, Any]


@dataclass(frozen=True)
class Judgement:
    """What a subject (model, kernel, package, a long run) gave at one state, and how it is judged.

    ``relative`` and ``absolute`` are the largest errors of each output, ``roundings`` the smallest
    displacement of plate and blades, in roundings, that explains the torque's (0 where its own
    rounding does). ``sentence`` says what was refused or is wrong.
    """

    subject: str
    outcome: Outcome
    sentence: str = ""
    relative: Mapping[str, float] = field(default_factory=dict)
    absolute: Mapping[str, float] = field(default_factory=dict)
    roundings: float = 0.0


def compare_model(state: State) -> Judgement:
    """The float64 model's torque and crack, without friction, against the exact law."""

    def program() -> Numbers:
        model = ExactModel(state.cutting, None)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            place = model.settled(state.opening, state.contact)
            torque = float(model.torque_settled(state.opening, state.rate, place))
        return {"torque": torque, "crack": float(place)}

    def exact() -> Reference:
        return Reference(blade_of_law(state.cutting, PARALLEL_MODEL), state)

    return _judged("model", exact, program, MODEL_EPS)


def compare_kernel(state: State, tables: ModelTables) -> Judgement:
    """A float32 step of the kernel against its own tables in 50 digits, friction included."""

    def program() -> Numbers:
        kernel = Kernel(tables)
        kernel.reset(crack=state.contact)
        out = kernel.step(state.opening, state.rate, 0.0)
        if out.flags & StepFlag.INVALID:
            return {"refused": "INVALID: the state cannot be evaluated"}
        return {"torque": out.torque, "crack": kernel.crack}

    def exact() -> Reference:
        return Reference(blade_of_tables(tables, PARALLEL_KERNEL), state, tables)

    return _judged("kernel", exact, program, KERNEL_EPS)


def compare_package(state: State, package: ModelPackage) -> Judgement:
    """The average torque that a package renders, without friction, against the exact law.

    Right within the package's stated bound, where it covers the state; flagged elsewhere, where it
    states no error. Both torques are held to the package's limit.
    """
    manifest = package.manifest
    bare = manifest.mechanics.model_copy(update={"friction": None})
    place = [np.array([value]) for value in (state.opening, state.rate, state.contact)]
    torque = float(AverageTorque(bare, manifest.ranges, package.arrays).torque(*place)[0])
    try:
        truth = Reference(blade_of_law(state.cutting, PARALLEL_KERNEL), state).at()
    except NotComparedError as error:
        return Judgement("package", "not compared", str(error))
    if math.isnan(torque):
        return _refused("package", truth, NO_EDGE, LEAST_RUN)
    if not truth["stands"]:
        return _refused("package", truth, "", LEAST_RUN)
    limit, bound = manifest.limits.torque_Nm, manifest.bound.stated_Nm
    held = {"torque": max(-limit, min(limit, torque))}
    exact = {"torque": max(-mp.mpf(limit), min(mp.mpf(limit), truth["torque"]))}
    relative, absolute = errors_of(held, exact)
    if not package.covers(*place)[0]:
        words = "OutsideCoverageWarning: outside what the package covers"
        return Judgement("package", "flagged", words, relative, absolute)
    outcome: Outcome = "right" if absolute["torque"] <= bound else "wrong"
    words = (
        "" if outcome == "right" else f"{_short(held)} where it is {_short(exact)}, of {bound:g}"
    )
    return Judgement("package", outcome, words, relative, absolute)


@dataclass(frozen=True)
class Reference:
    """The exact answer at a state: of the law on average, or, with ``tables``, of their step."""

    law: Blade
    state: State
    tables: ModelTables | None = None

    @property
    def least_run(self) -> float:
        """dx/ds above which the program states that it finds an edge over a place."""
        return 0.0 if self.tables is None else LEAST_RUN

    def at(self, upper: float = 0.0, turn: float = 0.0, toughness: float = 0.0) -> Numbers:
        """The answer for a plate and blades displaced (m, rad), a fracture energy by a share."""
        turned = self.law.turned(mp.mpf(self.state.opening) + turn, upper, toughness)
        spot, least = turned.over(mp.mpf(self.state.contact))
        least = min(least, turned.least_run_of_blade())
        if self.tables is not None:
            least = min(least, turned.cosine)
        if spot is None or (self.tables is not None and least <= LEAST_RUN):
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
        answer = {"rises": float(rises), "torque": torque}
        if steps or before_tip:
            answer["crack"] = rests.x
        answer |= _sizes(law, rests, rate, friction)
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


def _judged(
    subject: str, make: Callable[[], Reference], program: Callable[[], Numbers], eps: float
) -> Judgement:
    """Compare what a program gives with the exact answer and its displaced ones."""
    try:
        exact = make()
        truth = exact.at()
    except NotComparedError as error:
        return Judgement(subject, "not compared", str(error))
    try:
        given = program()
    except ScissorcalError as error:
        return Judgement(subject, "refused", str(error))
    except Exception as error:  # noqa: BLE001 - whatever it raises is what is reported
        return Judgement(subject, "wrong", f"{type(error).__name__}: {error}")
    refused = str(given.get("refused", ""))
    if not refused and any(not math.isfinite(float(v)) for v in given.values()):
        if not math.isnan(float(given["torque"])) or subject != "model":
            return Judgement(subject, "wrong", f"not finite: {_short(given)}")
        refused = NO_EDGE
    if refused:
        return _refused(subject, truth, refused, exact.least_run)
    if not truth["stands"]:
        return _refused(subject, truth, "", exact.least_run)
    if abs(truth["torque"]) > LARGEST_N:
        return Judgement(subject, "not compared", "above 1e30 N m")
    relative, absolute = errors_of(given, truth)
    for roundings in PLACE_ROUNDINGS:
        if _explained(given, truth, exact, eps, roundings):
            return Judgement(subject, "right", "", relative, absolute, roundings)
    if truth["rises"]:
        words = "release_falls is false: the release rises again along the blade"
        return Judgement(subject, "flagged", words, relative, absolute, math.nan)
    words = f"{_short(given)} where it is {_short(truth)}"
    return Judgement(subject, "wrong", words, relative, absolute, math.inf)


def _explained(
    given: Numbers, truth: Numbers, exact: Reference, eps: float, roundings: float
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
    return low - slack <= float(given["torque"]) <= high + slack


def errors_of(given: Numbers, truth: Numbers) -> tuple[dict[str, float], dict[str, float]]:
    relative, absolute = {}, {}
    for name, value in given.items():
        if name in truth:
            away = abs(mp.mpf(float(value)) - truth[name])
            absolute[name] = float(away)
            if truth[name]:
                relative[name] = float(away / abs(truth[name]))
    return relative, absolute


def _refused(subject: str, truth: Numbers, sentence: str, least_run: float) -> Judgement:
    """A refusal is right only where the program states that it refuses.

    A number where no edge stands (no ``sentence``) is right only on the border to where one does.
    """
    least = float(truth["least"])
    if not sentence:
        words = "a number where no edge stands over the contact"
        return Judgement(subject, "refused" if abs(least - least_run) < 1e-4 else "wrong", words)
    huge = abs(truth.get("torque", 0)) > LARGEST_FLOAT32
    if not truth["stands"] or least <= least_run + 1e-3 or huge:
        return Judgement(subject, "refused", sentence)
    return Judgement(subject, "wrong", f"refused, although it is {_short(truth)}")


def _short(numbers: Numbers) -> str:
    shown = [n for n in ("torque", "crack") if n in numbers]
    return ", ".join(f"{name} {float(numbers[name]):.6g}" for name in shown) or "no answer"
