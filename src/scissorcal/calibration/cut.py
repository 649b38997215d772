"""Fit the material's response and fracture to strokes through it."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.assemble import assemble
from scissorcal.calibration.conditioning import condition
from scissorcal.calibration.cut_data import CutData, cutting_from
from scissorcal.calibration.cut_likelihood import MaterialModel, innovations
from scissorcal.calibration.hashing import fit_inputs_hash
from scissorcal.calibration.ladder import Climbed, Likelihood, Rung, choose, climb
from scissorcal.calibration.layout import Layout, Parameter
from scissorcal.calibration.result import Effort, FitResult
from scissorcal.errors import InputError
from scissorcal.inference import infer
from scissorcal.recipe.schema import Recipe
from scissorcal.recording.recording import Recording

Array = NDArray[np.float64]
Progress = Callable[[float, str], None]

FEWEST_CONTACT_BINS = 60
FELT = 5.0
"""Torque counts as contact from this many standard deviations of the empty sweeps' noise."""

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
    data = CutData(every, recipe, friction)
    _refuse_no_contact(data, recordings)
    climbed: list[Climbed] = []
    ladder = _ladder(data, recipe)
    for index, rung in enumerate(ladder):
        tell(0.5 * index / len(ladder), f"cut: trying {rung.name}")
        neighbour = _nearest(rung, climbed)
        begun = _from_neighbour(rung, neighbour) if neighbour else rung
        climbed.append(climb(begun, data.bins.series, data.strokes))
    chosen = choose(climbed)
    tell(0.5, f"cut: inferring {chosen.rung.name}")
    posterior = infer(
        chosen.rung.problem(data.bins.series),
        "draft" if effort == "draft" else "standard",
        rng,
        optimum=chosen.optimum,
        progress=lambda done, sentence: tell(0.5 + 0.5 * done, f"cut: {sentence}"),
    )
    friction_names = data.friction_layout.names
    u = chosen.optimum.point
    structure = {**chosen.rung.key, **data.geometry}
    return assemble(
        what="cut",
        effort=effort,
        posterior=posterior,
        climbed=climbed,
        chosen=chosen,
        structure=structure,
        bins=data.bins,
        strokes=data.strokes,
        measured=data.material_torque(u),
        contact=data.contact(cutting_from(structure, chosen.rung.layout.natural(u))),
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


def _refuse_no_contact(data: CutData, recordings: tuple[Recording, ...]) -> None:
    names = ", ".join(recording.source or "the recording" for recording in recordings)
    if len(data.bins.opening) == 0:
        raise InputError(
            f"{names}: no stroke through material is marked in it; capture cuts with "
            "'scissorcal capture cut', or mark strokes and sheets when importing."
        )
    felt = int(np.sum(data.material_torque(data.friction_mean) > FELT * data.empty_noise))
    if felt < FEWEST_CONTACT_BINS:
        raise InputError(
            f"{names}: the blades hardly touched the material (torque beyond friction in "
            f"{felt * data.bins.bin_s:.2g} s). Check that the sheet lay between the blades and "
            "that advance was zero at its near edge, then capture again."
        )


def _ladder(data: CutData, recipe: Recipe) -> list[Rung]:
    settings = recipe.fit.cut
    families = ("power", "exponential") if settings.response == "auto" else (settings.response,)
    if not recipe.scene.cut:
        fractures: tuple[str, ...] = ("none",)
    elif settings.fracture == "auto":
        fractures = ("smooth", "rippled")
    else:
        fractures = (settings.fracture,)
    return [_rung(data, recipe, family, fracture) for fracture in fractures for family in families]


def _rung(data: CutData, recipe: Recipe, family: str, fracture: str) -> Rung:
    material = _material_layout(data, recipe, fracture)
    layout = Layout(material.parameters + data.friction_layout.parameters)
    key = {"response": family, "fracture": fracture}
    structure = {**key, **data.geometry}
    own = len(material.parameters)
    material_model = MaterialModel(data, structure, material)

    def residuals(u: Array) -> Array:
        return data.material_torque(u) - material_model(u[:own]).mean

    def standardised(u: Array) -> Array:
        return innovations(residuals(u), material_model(u[:own])).standardised

    def terms(u: Array) -> Array:
        found = innovations(residuals(u), material_model(u[:own]))
        return np.asarray(-0.5 * found.standardised**2 - np.log(found.sd))

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


def _material_layout(data: CutData, recipe: Recipe, fracture: str) -> Layout:
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


def _nearest(rung: Rung, climbed: list[Climbed]) -> Climbed | None:
    """The climbed rung that shares most discrete choices, the latest of equals."""
    shared = [sum(c.rung.key[k] == v for k, v in rung.key.items()) for c in climbed]
    return climbed[max(range(len(shared)), key=lambda i: (shared[i], i))] if climbed else None


def _from_neighbour(rung: Rung, neighbour: Climbed) -> Rung:
    """Start a rung where its neighbour ended, in the parameters that mean the same in both.

    A ripple lowers the mean force for a given fracture energy, so that rungs with one start at
    several strengths of it, each with the energy that keeps the mean.
    """
    names = list(neighbour.rung.layout.names)
    same_family = rung.key["response"] == neighbour.rung.key["response"]
    start = rung.starts[0].copy()
    for index, name in enumerate(rung.layout.names):
        if name in names and (same_family or name != "response_exponent"):
            start[index] = neighbour.optimum.point[names.index(name)]
    if "kappa" not in rung.layout.names or "kappa" in names:
        return replace(rung, starts=start[None, :])
    rows = []
    where, energy = rung.layout.names.index("kappa"), rung.layout.names.index("fracture_energy")
    for kappa in (0.9, 0.6):
        row = start.copy()
        row[where] = np.log(kappa) - np.log1p(-kappa)
        row[energy] -= np.log(0.5 + 0.5 * kappa)
        rows.append(row)
    return replace(rung, starts=np.stack(rows))


def _starts(data: CutData, material: Layout) -> Array:
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
