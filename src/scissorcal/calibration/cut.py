"""Fit the material's response and fracture to strokes through it."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.assemble import assemble
from scissorcal.calibration.conditioning import Bins, condition
from scissorcal.calibration.friction import friction_law
from scissorcal.calibration.hashing import fit_inputs_hash
from scissorcal.calibration.ladder import Climbed, Likelihood, Rung, choose, climb
from scissorcal.calibration.layout import Layout, Parameter
from scissorcal.calibration.result import Effort, FitResult
from scissorcal.errors import InputError
from scissorcal.inference import infer
from scissorcal.model import (
    Cutting,
    Edge,
    Response,
    cut_torque_along,
    friction_torque,
    torque_spread_along,
)
from scissorcal.recipe.schema import Recipe
from scissorcal.recording.recording import Recording

Array = NDArray[np.float64]
Progress = Callable[[float, str], None]

FEWEST_CONTACT_BINS = 60
NUISANCE = ("noise", "variation")
"""Parameters of the noise; those of friction, also nuisances here, are named in the code."""


def fit_cut(
    recordings: tuple[Recording, ...],
    recipe: Recipe,
    friction: FitResult,
    *,
    effort: Effort,
    rng: np.random.Generator,
    progress: Progress | None = None,
) -> FitResult:
    """Identify response, fracture energy and ripple from cuts (or presses).

    measured = inertia * acceleration + F(opening, rate) + offset - drive
    = tau(opening, crack; parameters) + noise, where friction's posterior enters as a prior, so that
    what the empty sweeps left open widens what is said of the material. The crack starts at the
    sheet's edge and runs as the model says. A rippling fracture shows as variance: its bins have
    the variance that a saw-tooth between kappa g_c and g_c keeps after averaging over a bin.

    Raises InputError where the blades hardly touched the material.
    """
    tell = progress or (lambda done, sentence: None)
    every = condition(recordings, recipe.fit.friction.cutoff_Hz)
    data = _Data(every, recipe, friction)
    _refuse_no_contact(data, recordings)
    climbed: list[Climbed] = []
    ladder = _ladder(data, recipe)
    for index, rung in enumerate(ladder):
        tell(0.5 * index / len(ladder), f"cut: trying {rung.name}")
        climbed.append(climb(rung, data.bins.series, data.strokes))
    felt = data.material_torque(ladder[0].starts[0])
    chosen = choose(climbed, float(np.sqrt(np.mean(felt**2))))
    tell(0.5, f"cut: inferring {chosen.rung.name}")
    posterior = infer(
        chosen.rung.problem(data.bins.series),
        "draft" if effort == "draft" else "standard",
        rng,
        optimum=chosen.optimum,
        progress=lambda done, sentence: tell(0.5 + 0.5 * done, f"cut: {sentence}"),
    )
    friction_names = tuple(parameter.name for parameter in data.friction_layout.parameters)
    u = chosen.optimum.point
    return assemble(
        what="cut",
        effort=effort,
        posterior=posterior,
        climbed=climbed,
        chosen=chosen,
        structure={**chosen.rung.key, **_geometry(recipe)},
        bins=data.bins,
        strokes=data.strokes,
        measured=data.material_torque(u),
        contact=data.contact(chosen.rung, u),
        recordings=recordings,
        joint=recordings[0].joint,
        inputs_hash=fit_inputs_hash(
            "cut", recordings, settings_of(recipe), effort, friction.inputs_hash
        ),
        nuisance=(*NUISANCE, *friction_names),
    )


def settings_of(recipe: Recipe) -> str:
    """The parts of a recipe that a cut fit depends on, as canonical JSON text."""
    return recipe.model_dump_json(
        include={
            "rig": {"joint", "moving", "handle_radius_mm", "edge"},
            "material": {"thickness_mm"},
            "scene": {"cut", "closure"},
            "fit": {"cut", "friction"},
        }
    )


def cutting_from(structure: dict[str, Any], values: dict[str, Array]) -> Cutting:
    """The model of a cut from a fit's structure and parameters by name.

    ``values`` may hold scalars or arrays that broadcast with what the model is evaluated on.
    """
    edge = structure["edge"]
    return Cutting(
        edge=Edge(**edge),
        response=Response(
            structure["response"],
            values["response_force"],
            values["response_exponent"],
            structure["reference_indentation_m"],
        ),
        moving_blades=structure["moving_blades"],
        upper_face_m=structure["upper_face_m"],
        fracture_energy=values.get("fracture_energy"),
        kappa=values.get("kappa", 1.0),
        closure=structure["closure"],
    )


def _geometry(recipe: Recipe) -> dict[str, Any]:
    edge = recipe.rig.edge
    return {
        "closure": recipe.scene.closure,
        "reference_indentation_m": recipe.fit.cut.reference_indentation_mm * 1e-3,
        "moving_blades": recipe.rig.moving_blades,
        "upper_face_m": recipe.upper_face_m,
        "edge": {
            "family": edge.family,
            "offset_m": edge.offset_mm * 1e-3,
            "taper_rad": float(np.radians(edge.taper_deg)),
            "length_m": edge.length_mm * 1e-3,
            "curvature_per_m": edge.curvature_per_m,
        },
    }


class _Data:
    """Conditioned cuts with the friction they are to be freed from."""

    def __init__(self, every: Bins, recipe: Recipe, friction: FitResult) -> None:
        loaded = every.sheet >= 0
        self.whole = every.where(loaded)
        self.used = self.whole.moving & (self.whole.stroke >= 0)
        self.bins = self.whole.where(self.used)
        self.strokes = self.bins.stroke
        self.geometry = _geometry(recipe)
        self.center = float(friction.structure["angle_center"])
        self.friction_layout, self.friction_mean, self.friction_precision = _friction_prior(
            friction
        )
        self.sheets = _runs(self.whole.sheet)

    def material_torque(self, u: Array) -> Array:
        """Torque that is left for the material, given a point's friction parameters (last)."""
        own = u[-len(self.friction_layout.parameters) :]
        values = self.friction_layout.natural(own)
        bins = self.bins
        empty = friction_torque(friction_law(values, self.center), bins.opening, bins.rate)
        offset = values.get("offset", np.asarray(0.0))
        return np.asarray(values["inertia"] * bins.acceleration + empty + offset - bins.drive)

    def along(self, cutting: Cutting) -> tuple[Array, Array]:
        """Model torque and crack tip at every used bin, sheet by sheet."""
        torque = np.empty(len(self.whole.opening))
        tip = np.empty_like(torque)
        for run in self.sheets:
            torque[run], tip[run] = cut_torque_along(
                cutting, self.whole.opening[run], self.whole.advance[run], 0.0
            )
        return torque, tip

    def contact(self, rung: Rung, u: Array) -> Array:
        """Contact x_c at every used bin at a point of a rung."""
        cutting = cutting_from({**rung.key, **self.geometry}, _material_values(rung, u))
        return np.asarray((self.along(cutting)[1] - self.whole.advance)[self.used])


def _runs(labels: NDArray[np.int64]) -> list[slice]:
    ends = [0, *(np.flatnonzero(np.diff(labels)) + 1).tolist(), len(labels)]
    return [slice(low, high) for low, high in zip(ends[:-1], ends[1:], strict=True)]


def _friction_prior(friction: FitResult) -> tuple[Layout, Array, Array]:
    """Friction's posterior as a normal prior in unconstrained coordinates."""
    signed = ("offset", "angle_slope", "angle_curvature")
    columns, rows = [], []
    for parameter in friction.parameters:
        draws = friction.column(parameter.name)
        signed_one = parameter.name in signed
        u = draws if signed_one else np.log(draws)
        columns.append(u)
        rows.append(
            Parameter(
                parameter.name,
                parameter.unit,
                "identity" if signed_one else "log",
                float(u.mean()),
                float(u.std(ddof=1)),
                parameter.meaning,
            )
        )
    cloud = np.stack(columns, axis=1)
    covariance = np.cov(cloud, rowvar=False)
    return Layout(tuple(rows)), cloud.mean(axis=0), np.linalg.inv(covariance)


def _refuse_no_contact(data: _Data, recordings: tuple[Recording, ...]) -> None:
    names = ", ".join(recording.source or "the recording" for recording in recordings)
    if len(data.bins.opening) == 0:
        raise InputError(
            f"{names}: no stroke through material is marked in it; capture cuts with "
            "'scissorcal capture cut', or mark strokes and sheets when importing."
        )
    start = np.concatenate([np.zeros(0), data.friction_mean])
    torque = data.material_torque(start)
    noise = float(np.median(np.abs(torque - np.median(torque)))) + 1e-12
    felt = int(np.sum(torque > 6 * noise))
    if felt < FEWEST_CONTACT_BINS and float(torque.max()) < 10 * noise:
        raise InputError(
            f"{names}: the blades hardly touched the material (torque beyond friction in "
            f"{felt * data.bins.bin_s:.2g} s). Check that the sheet lay between the blades and that "
            "advance was zero at its near edge, then capture again."
        )


def _ladder(data: _Data, recipe: Recipe) -> list[Rung]:
    settings = recipe.fit.cut
    families = ("power", "exponential") if settings.response == "auto" else (settings.response,)
    if not recipe.scene.cut:
        fractures: tuple[str, ...] = ("none",)
    elif settings.fracture == "auto":
        fractures = ("smooth", "rippled")
    else:
        fractures = (settings.fracture,)
    return [_rung(data, recipe, family, fracture) for fracture in fractures for family in families]


def _rung(data: _Data, recipe: Recipe, family: str, fracture: str) -> Rung:
    material = _material_layout(data, recipe, fracture)
    layout = Layout(material.parameters + data.friction_layout.parameters)
    key = {"response": family, "fracture": fracture}
    structure = {**key, **data.geometry}
    own = len(material.parameters)
    evaluate = _Evaluator(data, structure, material)

    def residuals(u: Array) -> Array:
        return data.material_torque(u) - evaluate(u[:own]).mean

    def standardised(u: Array) -> Array:
        state = evaluate(u[:own])
        return np.asarray((data.material_torque(u) - state.mean) / state.sd)

    def terms(u: Array) -> Array:
        state = evaluate(u[:own])
        z = (data.material_torque(u) - state.mean) / state.sd
        return np.asarray(-0.5 * z**2 - np.log(state.sd))

    precision = np.zeros((len(layout.names),) * 2)
    precision[:own, :own] = np.diag(1 / material.sd**2)
    precision[own:, own:] = data.friction_precision
    return Rung(
        name=f"{family} response, " + {"none": "no fracture"}.get(fracture, f"{fracture} fracture"),
        key=key,
        layout=layout,
        likelihood=Likelihood(terms, residuals, standardised),
        starts=_starts(data, material),
        prior_mean=np.concatenate([material.mean, data.friction_mean]),
        prior_precision=precision,
    )


@dataclass(frozen=True)
class _State:
    mean: Array
    sd: Array


class _Evaluator:
    """Model mean and standard deviation by bin, remembering the last material it was asked for.

    Differences by friction's parameters leave the material unchanged, and the material is what
    costs time.
    """

    def __init__(self, data: _Data, structure: dict[str, Any], layout: Layout) -> None:
        self.data, self.structure, self.layout = data, structure, layout
        self.last: tuple[bytes, _State] | None = None

    def __call__(self, u: Array) -> _State:
        key = u.tobytes()
        if self.last is not None and self.last[0] == key:
            return self.last[1]
        state = self._evaluate(u)
        self.last = (key, state)
        return state

    def _evaluate(self, u: Array) -> _State:
        data, values = self.data, self.layout.natural(u)
        cutting = cutting_from(self.structure, values)
        torque, tip = data.along(cutting)
        mean = torque[data.used]
        variance = values["noise"] ** 2 + (values["variation"] * mean) ** 2
        if "kappa" in values:
            advancing = np.concatenate([[False], np.diff(tip) > 0])[data.used]
            spread = torque_spread_along(
                cutting,
                data.bins.opening,
                data.bins.rate,
                tip[data.used] - data.bins.advance,
                data.bins.bin_s,
            )
            variance = variance + np.where(advancing, spread, 0.0) ** 2
        return _State(mean, np.sqrt(variance))


def _material_values(rung: Rung, u: Array) -> dict[str, Array]:
    return rung.layout.natural(u)


def _material_layout(data: _Data, recipe: Recipe, fracture: str) -> Layout:
    settings = recipe.fit.cut
    force, exponent = settings.response_force_N, settings.response_exponent
    rows = [
        Parameter(
            "response_force",
            "N",
            "log",
            float(np.log(force.median)),
            force.log_sd,
            f"force at {settings.reference_indentation_mm:g} mm of indentation",
        ),
        Parameter(
            "response_exponent",
            "1",
            "log",
            float(np.log(exponent.median)),
            exponent.log_sd,
            "how the response stiffens",
        ),
    ]
    if fracture != "none":
        toughness = settings.toughness_J_per_m2
        assert toughness is not None
        energy = toughness.median * recipe.material.thickness_mm * 1e-3
        rows.append(
            Parameter(
                "fracture_energy",
                "J/m",
                "log",
                float(np.log(energy)),
                toughness.log_sd,
                "toughness times thickness: energy per length of cut",
            )
        )
    if fracture == "rippled":
        rows.append(
            Parameter(
                "kappa",
                "1",
                "logit",
                0.85,
                1.0,
                "share of the fracture energy at which a running crack stops",
            )
        )
    noise = float(np.std(data.bins.drive)) * 0.1
    rows.append(Parameter("noise", "N m", "log", float(np.log(noise)), 2.8, "noise of the torque"))
    rows.append(
        Parameter(
            "variation", "1", "log", float(np.log(0.03)), 1.0, "relative unevenness of the material"
        )
    )
    return Layout(tuple(rows))


def _starts(data: _Data, material: Layout) -> Array:
    """Starts that differ in stiffness and fracture energy; friction starts at its mean."""
    torque = data.material_torque(data.friction_mean)
    noise = np.log(max(float(np.median(np.abs(torque))) * 0.3, 1e-6))
    rows = []
    for sign_force, sign_energy in ((0.0, 0.0), (0.8, -0.8), (-0.8, 0.8)):
        point = material.mean.copy()
        for index, parameter in enumerate(material.parameters):
            if parameter.name == "response_force":
                point[index] += sign_force * parameter.sd
            elif parameter.name == "fracture_energy":
                point[index] += sign_energy * parameter.sd
            elif parameter.name == "noise":
                point[index] = noise
        rows.append(np.concatenate([point, data.friction_mean]))
    return np.stack(rows)
