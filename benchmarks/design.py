"""Designed against listed captures on virtual days: minutes until the tolerance, predicted bands.

    python -m benchmarks.design --first 9400 --count 20 [--second-rig 10] [--json rows.json]

Each day has another rig and another material, drawn around the recipe's own (the first rig's
specimen by 15 %, the second rig's material and friction by 30 %). On each day two captures are
taken, fitted at draft effort and judged by the band of the scene's torque:

- *listed*: the speeds and numbers that the recipe lists;
- *designed*: what `choose_captures` lists before any data, from the recipe's priors.

Where 95 % of the felt places are not within the tolerance, capture goes on: the list again, or the
list designed from the posterior, at most two captures in all; a day that does not get there is
counted as such. Minutes count motion, idle seconds and a person's part, as
`scissorcal.workday.stock.seconds_at_rig` does. Bands are compared where both are known:

- *from prior*: what the prior expects of the designed list, against what its fit states;
- *from posterior*: what the fit of the designed capture expects of the listed capture alone,
  against what the fit of that states. The two are of independent recordings.

Ratios are found over predicted: of the medians over places of the band's half-width as a share of
the torque there.
"""

import json
import sys
import tempfile
from collections.abc import Callable
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Literal, Protocol

import numpy as np
from benchmarks.days import day_options

from scissorcal.calibration import FitResult
from scissorcal.calibration.cut.fit import fit_cut
from scissorcal.calibration.design import (
    CaptureList,
    Knowledge,
    choose_captures,
    expected_band,
)
from scissorcal.calibration.design.band import REACHED_SHARE, Band
from scissorcal.calibration.design.state import (
    CutState,
    FrictionState,
    expected_cut,
    expected_friction,
    fitted_cut,
    fitted_friction,
)
from scissorcal.calibration.friction.fit import fit_friction
from scissorcal.device import capture as rig_capture
from scissorcal.device.cut_trajectory import cut_plan
from scissorcal.device.lockstep import LockstepLink
from scissorcal.device.probe.probe import probe
from scissorcal.device.session import RigSession
from scissorcal.device.sim.specimen import load_specimen
from scissorcal.device.sim.truth import varied
from scissorcal.device.trajectory import friction_plan
from scissorcal.kernel import Identity
from scissorcal.package.scene_slopes import torque_knowledge
from scissorcal.package.scene_torque import SceneTorque, scene_torque
from scissorcal.recipe.library import builtin_recipe, recipe_path
from scissorcal.recipe.schema import Recipe
from scissorcal.recording import Recording, read_recording
from scissorcal.workday.stock import (
    capture_stock,
    designed_recipe,
    listed_captures,
    nominal_identity,
    seconds_at_rig,
)

sys.path.insert(0, str(Path(__file__).parents[1]))

Kind = Literal["friction", "cut"]
ROUNDS = 2
"""Captures of one day at most."""
MATERIALS = ("paper", "cotton")


class Day(Protocol):
    """A virtual day: a rig with its material, to be captured as a recipe says."""

    recipe: Recipe
    identity: Identity

    def capture(self, kind: Kind, recipe: Recipe) -> Recording: ...


class FirstRig:
    """The simulator of the product, by its own link and probed, specimen drawn by a seed."""

    def __init__(self, name: str, seed: int) -> None:
        self.name = name
        self.recipe = builtin_recipe(name)
        rng = np.random.default_rng(seed)
        specimen = varied(load_specimen(self.recipe.specimen or ""), rng)
        self._link = LockstepLink(specimen, rng.spawn(1)[0])
        self._session = RigSession(self._link, self.recipe)
        self._session = replace(self._session, probe=probe(self._session))
        self.identity = self._link.identity

    def capture(self, kind: Kind, recipe: Recipe) -> Recording:
        """Drive the rig as a capture does."""
        text = recipe_path(self.name).read_text(encoding="utf-8")
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / f"{kind}.mcap"
            session = replace(self._session, recipe=recipe, recipe_toml=text)
            with rig_capture.open_writer(session, kind, path) as writer:
                rig_capture.capture(session, kind, writer)
            return read_recording(path)


class SecondRig:
    """The rig of another construction, which shares no code with the product."""

    def __init__(self, material: str, seed: int, preset: Any = None) -> None:
        from tests.second_rig import capture, presets

        self._capture = capture
        rng = np.random.default_rng(seed)
        drawn = {"paper": presets.paper, "cotton": presets.cotton}[material]()
        sheet = replace(
            drawn,
            force_N=drawn.force_N * _within(rng),
            exponent=drawn.exponent * _within(rng, 0.15),
            fracture_energy_N=drawn.fracture_energy_N * _within(rng),
        )
        rig = (preset or presets.fine)(sheet)
        friction = rig.mechanism.friction
        friction = replace(
            friction,
            coulomb_opening_Nm=friction.coulomb_opening_Nm * _within(rng),
            coulomb_closing_Nm=friction.coulomb_closing_Nm * _within(rng),
            stribeck_Nm=friction.stribeck_Nm * _within(rng),
        )
        self.rig = replace(rig, mechanism=replace(rig.mechanism, friction=friction))
        self.recipe = presets.recipe_for(self.rig)
        self.identity = capture.identity_of(self.rig)
        self._rng = rng.spawn(1)[0]

    def capture(self, kind: Kind, recipe: Recipe) -> Recording:
        """Drive the rig along the product's plan."""
        take = self._capture.capture_friction if kind == "friction" else self._capture.capture_cut
        recording, _ = take(self.rig, recipe, self._rng)
        return recording


def _within(rng: np.random.Generator, spread: float = 0.3) -> float:
    return float(rng.uniform(1.0 - spread, 1.0 + spread))


@dataclass
class Taken:
    """What was captured on a day so far, and the last fits of it."""

    friction: list[Recording] = field(default_factory=list)
    cut: list[Recording] = field(default_factory=list)
    minutes: float = 0.0
    rounds: int = 0
    within: list[float] = field(default_factory=list)
    fits: tuple[FitResult, FitResult] | None = None
    scene: SceneTorque | None = None

    @property
    def reached(self) -> bool:
        """Whether the last fits state the tolerance."""
        return bool(self.within) and self.within[-1] >= REACHED_SHARE


@dataclass(frozen=True)
class Row:
    """One day: minutes and share of places within the tolerance, by list; ratios of bands."""

    seed: int
    rig: str
    material: str
    listed_min: float
    listed_within: list[float]
    listed_reached: bool
    designed_min: float
    designed_within: list[float]
    designed_reached: bool
    designed_strokes: str
    from_prior: float
    from_posterior: float
    expected_within: float


def one_day(seed: int, second_rig: bool, tell: Callable[[str], None] = print) -> Row:
    """Run one virtual day with both lists."""
    material = MATERIALS[seed % len(MATERIALS)]
    name = {"paper": "paper-80gsm", "cotton": "cotton-cloth"}[material]

    def day() -> Day:
        return SecondRig(material, seed) if second_rig else FirstRig(name, seed)

    recipe = day().recipe
    listed, listed_first = _by_list(day(), seed)
    designed, first, expected, words = _by_design(day(), seed)
    from_prior = _ratio(first.scene, expected)
    predicted = _expected_of_list(recipe, day().identity, first)
    from_posterior = _ratio(listed_first.scene, predicted)
    row = Row(
        seed,
        "second" if second_rig else "first",
        material,
        listed.minutes,
        listed.within,
        listed.reached,
        designed.minutes,
        designed.within,
        designed.reached,
        words,
        from_prior,
        from_posterior,
        expected.within,
    )
    tell(json.dumps(asdict(row)))
    return row


def _by_list(day: Day, seed: int) -> tuple[Taken, Taken]:
    """Capture the recipe's list until the tolerance is reached; with the state after one."""
    taken = Taken()
    _capture(day, taken, day.recipe, ("friction", "cut"), seed)
    first = replace(taken, friction=list(taken.friction), cut=list(taken.cut))
    while not taken.reached and taken.rounds < ROUNDS:
        _capture(day, taken, day.recipe, ("friction", "cut"), seed)
    return taken, first


def _by_design(day: Day, seed: int) -> tuple[Taken, Taken, Band, str]:
    """Capture what is designed, from the priors and then from posteriors."""
    recipe, taken = day.recipe, Taken()
    friction = expected_friction(recipe)
    states = (friction, expected_cut(recipe, friction))
    known = torque_knowledge(recipe, *states)
    stock = capture_stock(recipe, nominal_identity(recipe), *states)
    chosen = choose_captures(known, stock)
    _capture(day, taken, designed_recipe(recipe, chosen.captures), _kinds(chosen.captures), seed)
    expected = chosen.expected
    words = [_words(chosen.captures)]
    first = replace(taken, friction=list(taken.friction), cut=list(taken.cut))
    while not taken.reached and taken.rounds < ROUNDS:
        states = _states(recipe, taken)
        stock = capture_stock(recipe, day.identity, *states)
        chosen = choose_captures(torque_knowledge(recipe, *states), stock)
        if not _kinds(chosen.captures):
            break
        more = designed_recipe(recipe, chosen.captures)
        _capture(day, taken, more, _kinds(chosen.captures), seed)
        words.append(_words(chosen.captures))
    return taken, first, expected, "; ".join(words)


def _capture(day: Day, taken: Taken, recipe: Recipe, kinds: tuple[Kind, ...], seed: int) -> None:
    """Capture once more and fit everything again."""
    plans = {"friction": friction_plan, "cut": cut_plan}
    for kind in kinds:
        getattr(taken, kind).append(day.capture(kind, recipe))
        taken.minutes += seconds_at_rig(recipe, plans[kind](recipe, day.identity)) / 60.0
    taken.rounds += 1
    rng = np.random.default_rng((seed, taken.rounds))
    friction = fit_friction(tuple(taken.friction), day.recipe.fit.friction, effort="draft", rng=rng)
    cut = fit_cut(tuple(taken.cut), day.recipe, friction, effort="draft", rng=rng)
    taken.fits = friction, cut
    taken.scene = scene_torque(day.recipe, cut, friction)
    taken.within.append(float(taken.scene.within_tolerance or 0.0))


def _states(recipe: Recipe, taken: Taken) -> tuple[FrictionState, CutState]:
    assert taken.fits is not None
    friction, cut = taken.fits
    return (
        fitted_friction(tuple(taken.friction), recipe, friction),
        fitted_cut(tuple(taken.cut), recipe, friction, cut),
    )


def _expected_of_list(recipe: Recipe, identity: Identity, taken: Taken) -> Band:
    """The band that the recipe's list alone would give, at the parameters of another capture."""
    friction, cut = _states(recipe, taken)
    known = torque_knowledge(recipe, friction, cut)
    information, _ = listed_captures(recipe, identity, friction, cut)
    alone = replace(known, friction=_emptied(known.friction), cut=_emptied(known.cut))
    return expected_band(alone.plus(*information))


def _emptied(known: Knowledge) -> Knowledge:
    return replace(known, recordings=())


def _ratio(scene: SceneTorque | None, expected: Band) -> float:
    """Median found half-width over the expected, both as shares of the torque."""
    assert scene is not None
    found = scene.share[np.isfinite(scene.share)]
    return float(np.median(found[found > 0]) / np.median(expected.share[expected.share > 0]))


def _kinds(captures: CaptureList) -> tuple[Kind, ...]:
    wanted: list[Kind] = []
    if captures.speeds:
        wanted.append("friction")
    if captures.pieces:
        wanted.append("cut")
    return tuple(wanted)


def _words(captures: CaptureList) -> str:
    speeds = " ".join(f"{speed:g}" for speed in captures.speeds)
    pieces = len(captures.pieces)
    count = len(captures.pieces[0]) if pieces else 0
    return f"sweeps {speeds or 'none'}, {pieces} x {count} strokes"


def summary(rows: list[Row]) -> dict[str, Any]:
    """What the days show together: minutes where both lists reach, their ratio, bands."""
    both = [row for row in rows if row.listed_reached and row.designed_reached]
    ratios = [row.designed_min / row.listed_min for row in both]
    bands = {
        name: np.quantile([getattr(row, name) for row in rows], [0.1, 0.5, 0.9]).round(3).tolist()
        for name in ("from_prior", "from_posterior")
    }
    return {
        "days": len(rows),
        "listed reached": sum(row.listed_reached for row in rows),
        "designed reached": sum(row.designed_reached for row in rows),
        "at the first capture": [
            sum(row.listed_within[0] >= REACHED_SHARE for row in rows),
            sum(row.designed_within[0] >= REACHED_SHARE for row in rows),
        ],
        "minutes, listed": float(np.mean([row.listed_min for row in both])) if both else None,
        "minutes, designed": float(np.mean([row.designed_min for row in both])) if both else None,
        "ratio of minutes (10, 50, 90 %)": (
            np.quantile(ratios, [0.1, 0.5, 0.9]).round(3).tolist() if ratios else None
        ),
        "found over predicted band (10, 50, 90 %)": bands,
        "within 20 %": {
            name: float(np.mean([abs(np.log(getattr(row, name))) < np.log(1.2) for row in rows]))
            for name in ("from_prior", "from_posterior")
        },
    }


def main() -> None:
    """Run the days and print one line each, then the summary."""
    parser = day_options(__doc__, first=9400, count=20)
    parser.add_argument("--second-rig", type=int, default=10, help="days on the second rig")
    arguments = parser.parse_args()
    last = arguments.first + arguments.count
    rows = [
        one_day(seed, seed >= last - arguments.second_rig, lambda line: print(line, flush=True))
        for seed in range(arguments.first, last)
    ]
    found = summary(rows)
    print(json.dumps(found, indent=1))
    if arguments.json:
        text = json.dumps({"rows": [asdict(row) for row in rows], "summary": found}, indent=1)
        arguments.json.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
