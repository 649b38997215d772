"""Fit the material's response and fracture to strokes through it."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.assemble import assemble
from scissorcal.calibration.conditioning import condition
from scissorcal.calibration.cut_data import CutData, cutting_from
from scissorcal.calibration.cut_ladder import NUISANCE, climb_cut_ladder
from scissorcal.calibration.hashing import fit_inputs_hash
from scissorcal.calibration.ladder import choose
from scissorcal.calibration.result import Effort, FitResult
from scissorcal.errors import InputError
from scissorcal.inference import infer
from scissorcal.recipe.schema import Recipe
from scissorcal.recording.recording import Recording

Array = NDArray[np.float64]
Progress = Callable[[float, str], None]

ACCELERATION_CUTOFF_HZ = 150.0
CUTOFF_HZ = 300.0
"""The latter leaves the ripple to the averaging over bins, whose effect is known exactly."""

DRAWS = 1000
FEWEST_CONTACT_BINS = 60
FELT = 5.0
"""Torque counts as contact from this many standard deviations of the empty sweeps' noise."""


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
    every = condition(recordings, CUTOFF_HZ, ACCELERATION_CUTOFF_HZ)
    data = CutData(every, recipe, friction)
    _refuse_no_contact(data, recordings)
    climbed = climb_cut_ladder(
        data, recipe, lambda done, sentence: tell(0.5 * done, f"cut: {sentence}")
    )
    chosen = choose(climbed)
    tell(0.5, f"cut: inferring {chosen.rung.name}")
    posterior = infer(
        chosen.rung.problem(data.bins.series),
        "draft" if effort == "draft" else "standard",
        rng,
        count=DRAWS,
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
        rng=rng,
        critic=recipe.fit.cut.critic,
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
