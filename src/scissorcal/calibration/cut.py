"""Fit the material's response and fracture to strokes through it."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.assemble import assemble
from scissorcal.calibration.cut_data import FrictionPrior, edge_of
from scissorcal.calibration.cut_expected import ACCELERATION_CUTOFF_HZ
from scissorcal.calibration.cut_experiment import CutExperiment
from scissorcal.calibration.cut_ladder import climb_cut_ladder, cut_design, cut_designs
from scissorcal.calibration.cut_layout import CutLaw
from scissorcal.calibration.cut_motion import CutMotion, cut_motion
from scissorcal.calibration.cut_toughness import with_toughness
from scissorcal.calibration.hashing import cut_upstream, fit_inputs_hash
from scissorcal.calibration.ladder import choose
from scissorcal.calibration.result import Effort, FitResult
from scissorcal.calibration.signals.filtering import condition
from scissorcal.errors import InputError
from scissorcal.inference import infer
from scissorcal.model import EdgeBelief
from scissorcal.recipe.schema import Recipe
from scissorcal.recording.recording import Recording
from scissorcal.verdicts import Verdict, failed

Array = NDArray[np.float64]
Progress = Callable[[float, str], None]

CUTOFF_HZ = 300.0
"""The latter leaves the ripple to the averaging over bins, whose effect is known exactly."""

DRAWS = 2000
STANDARD_BUDGET = 60_000
"""Evaluations of the likelihood, of some milliseconds each, that standard effort may take."""
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
    edge: EdgeBelief | None = None,
    edge_verdicts: tuple[Verdict, ...] = (),
    checkpoint: Path | None = None,
) -> FitResult:
    """Identify response, fracture energy and ripple from cuts (or presses).

    measured = inertia * acceleration + F(opening, rate) + offset - drive
    = tau(opening, crack; parameters) + noise, where friction's posterior enters as a prior, so that
    what the empty sweeps left open widens what is said of the material. The crack starts at the
    sheet's edge and runs as the model says. A rippling fracture shows as variance: its bins have
    the variance that a saw-tooth between kappa g_c and g_c keeps after averaging over a bin.

    ``edge_verdicts`` are those on the fit that gave ``edge``: where one of them failed, or one on
    friction, this fit fails too. ``checkpoint`` is a file from which a thorough fit that was
    interrupted goes on. Raises InputError where the blades hardly touched the material.
    """
    tell = progress or (lambda done, sentence: None)
    belief = edge or edge_of(recipe)
    prior = FrictionPrior.of(friction)
    motion = _motion(recordings, recipe, belief)
    _refuse_no_contact(motion, prior, recordings)
    designs = cut_designs(motion, prior, recipe, belief)
    climbed = climb_cut_ladder(designs, lambda done, sentence: tell(0.5 * done, f"cut: {sentence}"))
    chosen = choose(climbed)
    design = next(one for one in designs if one.name == chosen.rung.name)
    tell(0.5, f"cut: inferring {chosen.rung.name}")
    posterior = infer(
        chosen.rung.problem(motion.bins.series),
        effort,
        rng,
        count=DRAWS,
        optimum=chosen.optimum,
        budget=STANDARD_BUDGET if effort == "standard" else None,
        checkpoint=checkpoint,
        progress=lambda done, sentence: tell(0.5 + 0.5 * done, f"cut: {sentence}"),
    )
    u = chosen.optimum.point
    fit = assemble(
        what="cut",
        effort=effort,
        posterior=posterior,
        climbed=climbed,
        chosen=chosen,
        structure=design.structure,
        bins=motion.bins,
        strokes=motion.strokes,
        measured=design.empty_drive(u) - motion.bins.drive,
        contact=design.expected(u).contact,
        recordings=recordings,
        joint=recordings[0].joint,
        inputs_hash=fit_inputs_hash(
            "cut",
            recordings,
            settings_of(recipe),
            effort,
            cut_upstream(friction.inputs_hash, edge),
        ),
        nuisance=design.nuisance,
        rng=rng,
        critic=recipe.fit.cut.critic,
        extra_verdicts=(_foundations(friction, edge_verdicts),),
    )
    return with_toughness(fit, recipe, rng)


def _foundations(friction: FitResult, edge_verdicts: tuple[Verdict, ...]) -> Verdict:
    """Whether what the fit builds on may be used at all."""
    wrong = [*friction.rejected, *failed(edge_verdicts)]
    if not wrong:
        why = "The fits that this one builds on passed their verdicts."
        return Verdict("fit.cut", "foundations", "pass", 0.0, 0.0, why)
    said = "; ".join(f"{verdict.scope}, {verdict.check}" for verdict in wrong)
    why = f"A fit that this one builds on is no calibration ({said}): mend that first."
    return Verdict("fit.cut", "foundations", "fail", float(len(wrong)), 0.0, why)


def cut_experiment(
    recordings: tuple[Recording, ...],
    recipe: Recipe,
    friction: FitResult,
    fit: FitResult,
    edge: EdgeBelief | None = None,
) -> CutExperiment:
    """Give the design of a finished fit: its law and priors over its own motion.

    All but ``fit`` are what the fit was made of; its law is taken from ``fit.structure``. A search
    over other outcomes begins where the fit ended.
    """
    belief = edge or edge_of(recipe)
    design = cut_design(
        _motion(recordings, recipe, belief),
        FrictionPrior.of(friction),
        recipe,
        belief,
        CutLaw.of(fit.structure),
    )
    return replace(design, begin=tuple(_where_it_ended(design, fit).tolist()))


def _where_it_ended(design: CutExperiment, fit: FitResult) -> Array:
    """The fit's best point; what it does not report starts at its prior's centre."""
    layout = design.layout
    centre = np.concatenate([design.material.mean, design.belief.mean, design.friction.mean])
    known = {p.name: v for p, v in zip(fit.parameters, fit.map_point.tolist(), strict=True)}
    known |= dict.fromkeys(("noise", "slow_noise"), float(fit.diagnostics["residual_rms"]))
    for index, parameter in enumerate(layout.parameters):
        if parameter.name in known:
            centre[index] = float(parameter.unconstrained(np.asarray(known[parameter.name])))
    return centre


def _motion(recordings: tuple[Recording, ...], recipe: Recipe, belief: EdgeBelief) -> CutMotion:
    return cut_motion(
        condition(recordings, CUTOFF_HZ, ACCELERATION_CUTOFF_HZ),
        belief.edge,
        recipe.rig.moving_blades,
        recipe.upper_face_m,
        recipe.fit.cut.reference_indentation_mm * 1e-3,
    )


def settings_of(recipe: Recipe) -> str:
    """The parts of a recipe that a cut fit depends on, as canonical JSON text."""
    return recipe.model_dump_json(
        include={
            "rig": {"joint", "moving", "handle_radius_mm", "edge"},
            "material": {"thickness_mm", "thickness_sd_mm"},
            "scene": {"cut", "closure"},
            "fit": {"cut", "friction"},
        }
    )


def _refuse_no_contact(
    motion: CutMotion, friction: FrictionPrior, recordings: tuple[Recording, ...]
) -> None:
    names = ", ".join(recording.source or "the recording" for recording in recordings)
    bins = motion.bins
    if len(bins.opening) == 0:
        raise InputError(
            f"{names}: no stroke through material is marked in it; capture cuts with "
            "'scissorcal capture cut', or mark strokes and sheets when importing."
        )
    torque = friction.empty_drive(friction.mean, bins) - bins.drive
    felt = int(np.sum(torque > FELT * friction.noise_Nm))
    if felt < FEWEST_CONTACT_BINS:
        raise InputError(
            f"{names}: the blades hardly touched the material (torque beyond friction in "
            f"{felt * bins.bin_s:.2g} s). Check that the sheet lay between the blades and "
            "that advance was zero at its near edge, then capture again."
        )
