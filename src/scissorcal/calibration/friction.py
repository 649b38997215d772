"""Fit friction, inertia and offset to empty motion."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.assemble import assemble
from scissorcal.calibration.conditioning import Bins, condition
from scissorcal.calibration.hashing import fit_inputs_hash
from scissorcal.calibration.ladder import Climbed, Likelihood, Rung, choose, climb
from scissorcal.calibration.layout import Layout, Parameter
from scissorcal.calibration.result import Effort, FitResult
from scissorcal.errors import InputError
from scissorcal.inference import infer
from scissorcal.model import FrictionLaw, friction_torque
from scissorcal.recipe.schema import FitFriction
from scissorcal.recording.recording import Joint, Recording

Array = NDArray[np.float64]
Progress = Callable[[float, str], None]

LAWS = ("coulomb", "coulomb+viscous", "stribeck", "stribeck+angle")
WIDE = 2.8
"""Prior standard deviation of a logarithm: 90 % within a factor of 100 of its centre."""

FEWEST_BINS = 200
LEAST_TRAVEL_SHARE = 20
"""Motion must span at least this many times the position that its slowest bin covers."""


def fit_friction(
    recordings: tuple[Recording, ...],
    settings: FitFriction,
    *,
    effort: Effort,
    rng: np.random.Generator,
    progress: Progress | None = None,
) -> FitResult:
    """Identify friction, inertia and offset from recordings of empty motion.

    drive = inertia * acceleration + F(opening, rate) + offset + noise, over the ladder coulomb,
    + viscous, + Stribeck, + angle, each symmetric or not. An asymmetric law has no offset of its
    own: an offset and unequal Coulomb levels cannot be told apart. Where both explain the data
    alike, a linear joint gets the offset, and scissors the unequal levels: those are felt through
    the handles, and an offset of a sensor is not. The rung that unseen strokes
    cannot tell from the best is taken, the cheapest first, unless ``settings`` name one. Works
    for a rotary joint and for a linear one; units follow the recordings' joint.

    Raises InputError where the recordings hold too little motion, and says what is missing.
    """
    tell = progress or (lambda done, sentence: None)
    joint = recordings[0].joint if recordings else Joint()
    every = condition(recordings, settings.cutoff_Hz)
    bins = every.where(every.moving)
    _refuse_poor_motion(bins, every, recordings, joint)
    strokes = _strokes(bins)
    ladder = _ladder(bins, settings, joint)
    climbed: list[Climbed] = []
    for index, rung in enumerate(ladder):
        tell(0.6 * index / len(ladder), f"friction: trying {rung.name}")
        climbed.append(climb(rung, bins.series, strokes))
    chosen = choose(climbed, float(np.sqrt(np.mean(bins.drive**2))))
    problem = chosen.rung.problem(bins.series)
    tell(0.6, f"friction: inferring {chosen.rung.name}")
    posterior = infer(
        problem,
        "draft" if effort == "draft" else "standard",
        rng,
        optimum=chosen.optimum,
        progress=lambda done, sentence: tell(0.6 + 0.4 * done, f"friction: {sentence}"),
    )
    return assemble(
        what="friction",
        effort=effort,
        posterior=posterior,
        climbed=climbed,
        chosen=chosen,
        structure={**chosen.rung.key, "joint": joint.kind},
        bins=bins,
        strokes=strokes,
        measured=bins.drive,
        contact=np.full(len(bins.drive), np.nan),
        recordings=recordings,
        joint=joint,
        inputs_hash=fit_inputs_hash("friction", recordings, settings.model_dump_json(), effort),
        nuisance=("noise",),
    )


def friction_law(values: dict[str, Array], angle_center: float) -> FrictionLaw:
    """Friction law from a fit's parameters by name; those a rung lacks are zero.

    ``values`` may hold scalars or arrays that broadcast (posterior draws).
    """
    coulomb = values.get("coulomb")
    viscous = values.get("viscous", np.asarray(0.0))
    return FrictionLaw(
        coulomb_pos=values["coulomb_pos"] if coulomb is None else coulomb,
        coulomb_neg=values["coulomb_neg"] if coulomb is None else coulomb,
        viscous_pos=values.get("viscous_pos", viscous),
        viscous_neg=values.get("viscous_neg", viscous),
        stribeck=values.get("stribeck", np.asarray(0.0)),
        stribeck_rate=values.get("stribeck_rate", np.asarray(1.0)),
        angle_slope=values.get("angle_slope", np.asarray(0.0)),
        angle_curvature=values.get("angle_curvature", np.asarray(0.0)),
        angle_center=angle_center,
    )


def _refuse_poor_motion(
    bins: Bins, every: Bins, recordings: tuple[Recording, ...], joint: Joint
) -> None:
    names = ", ".join(recording.source or "the recording" for recording in recordings)
    if len(bins.rate) < FEWEST_BINS:
        travel = float(np.ptp(every.opening)) if len(every.opening) else 0.0
        raise InputError(
            f"{names}: there is hardly any motion ({travel:.3g} {joint.position_unit} of travel, "
            f"{len(bins.rate) * bins.bin_s:.2g} s of it moving). Friction needs at least "
            f"{FEWEST_BINS * bins.bin_s:.1g} s of motion: capture sweeps in both directions at "
            "several speeds."
        )
    if not (np.any(bins.rate > 0) and np.any(bins.rate < 0)):
        missing = "negative (closing)" if np.all(bins.rate > 0) else "positive (opening)"
        raise InputError(
            f"{names}: the motion has one direction only; the {missing} one is missing. "
            "Friction cannot be told from an offset: capture sweeps in both directions."
        )
    if float(np.ptp(bins.drive)) <= 1e-9 * float(np.abs(bins.drive).max()):
        raise InputError(
            f"{names}: the drive torque is constant although the joint moves; check the "
            "motor_torque column or the sensor's connection."
        )


def _strokes(bins: Bins) -> NDArray[np.int64]:
    """Planned strokes where the recording has them, else runs of one direction."""
    if np.all(bins.stroke >= 0) and len(np.unique(bins.stroke)) > 1:
        return bins.stroke
    turns = (np.sign(bins.rate[1:]) != np.sign(bins.rate[:-1])) | (np.diff(bins.series) != 0)
    runs = np.concatenate([[0], np.cumsum(turns)])
    planned = bins.stroke.max(initial=-1) + 1
    return np.where(bins.stroke >= 0, bins.stroke, planned + runs).astype(np.int64)


def _ladder(bins: Bins, settings: FitFriction, joint: Joint) -> list[Rung]:
    laws = LAWS if settings.rung == "auto" else (settings.rung,)
    either = (True, False) if joint.kind == "linear" else (False, True)
    both = {"auto": either, "symmetric": (True,), "asymmetric": (False,)}
    return [
        _rung(bins, law, symmetric, joint) for law in laws for symmetric in both[settings.symmetry]
    ]


def _rung(bins: Bins, law: str, symmetric: bool, joint: Joint) -> Rung:
    layout = _layout(bins, law, symmetric, joint)
    center = float(np.round(np.mean([bins.opening.min(), bins.opening.max()]), 3))

    def residuals(u: Array) -> Array:
        values = layout.natural(u)
        predicted = friction_torque(friction_law(values, center), bins.opening, bins.rate)
        offset = values.get("offset", np.asarray(0.0))
        return bins.drive - values["inertia"] * bins.acceleration - offset - predicted

    def normal(u: Array) -> tuple[Array, Array]:
        return np.asarray(residuals(u) / np.exp(u[-1])), np.full(len(bins.drive), u[-1])

    return Rung(
        name=law.replace("+", " + ") + (", symmetric" if symmetric else ", asymmetric"),
        key={"law": law, "symmetric": symmetric, "angle_center": center},
        layout=layout,
        likelihood=Likelihood(residuals, normal),
        starts=_starts(bins, layout, residuals),
        prior_mean=layout.mean,
        prior_precision=np.diag(1 / layout.sd**2),
    )


def _layout(bins: Bins, law: str, symmetric: bool, joint: Joint) -> Layout:
    effort, rate = float(np.std(bins.drive)), float(np.sqrt(np.mean(bins.rate**2)))
    acceleration = float(np.sqrt(np.mean(bins.acceleration**2)))
    span = float(np.ptp(bins.opening))
    unit, rate_unit = joint.effort_unit, f"{joint.position_unit}/s"

    def level(name: str, unit: str, centre: float, meaning: str) -> Parameter:
        return Parameter(name, unit, "log", float(np.log(centre)), WIDE, meaning)

    rows = [
        level("inertia", joint.inertia_unit, effort / acceleration, "inertia of the moving joint")
    ]
    if symmetric:
        rows.append(Parameter("offset", unit, "identity", 0.0, effort, "constant offset"))
    sides = (("", ""),) if symmetric else (("_pos", ", positive rate"), ("_neg", ", negative rate"))
    for suffix, words in sides:
        rows.append(level("coulomb" + suffix, unit, effort, "Coulomb friction" + words))
    if law != "coulomb":
        viscous_unit = f"{unit} s/{joint.position_unit}"
        for suffix, words in sides:
            rows.append(
                level("viscous" + suffix, viscous_unit, effort / rate, "viscous friction" + words)
            )
    if law.startswith("stribeck"):
        slow = float(np.quantile(np.abs(bins.rate), 0.25))
        rows.append(level("stribeck", unit, 0.3 * effort, "static minus Coulomb friction"))
        rows.append(
            Parameter("stribeck_rate", rate_unit, "log", float(np.log(slow)), 1.0, "Stribeck speed")
        )
    if law.endswith("+angle"):
        position = joint.position_unit
        rows.append(
            Parameter(
                "angle_slope", f"1/{position}", "identity", 0.0, 1 / span, "change with angle"
            )
        )
        rows.append(
            Parameter(
                "angle_curvature",
                f"1/{position}^2",
                "identity",
                0.0,
                2 / span**2,
                "curvature of the change with angle",
            )
        )
    rows.append(level("noise", unit, 0.1 * effort, "standard deviation of what is left"))
    return Layout(tuple(rows))


def _starts(bins: Bins, layout: Layout, residuals: Callable[[Array], Array]) -> Array:
    """Starts from linear least squares of Coulomb, viscous, inertia and offset."""
    sign = np.sign(bins.rate)
    columns = np.stack([bins.acceleration, np.ones_like(sign), sign, bins.rate], axis=1)
    inertia, offset, coulomb, viscous = np.linalg.lstsq(columns, bins.drive, rcond=None)[0]
    effort = float(np.std(bins.drive))
    floor = {"inertia": 1e-3 * float(np.exp(layout.mean[0])), "coulomb": 1e-2 * effort}
    begin = {
        "inertia": max(inertia, floor["inertia"]),
        "offset": offset,
        "coulomb": max(coulomb, floor["coulomb"]),
        "viscous": max(viscous, 1e-2 * effort / float(np.sqrt(np.mean(bins.rate**2)))),
        "stribeck": 0.1 * effort,
        "angle_slope": 0.0,
        "angle_curvature": 0.0,
        "noise": 0.1 * effort,
    }
    rows = []
    rates = (0.4, 1.5) if "stribeck" in layout.names else (1.0,)
    for factor in rates:
        point = []
        for parameter in layout.parameters:
            stem = parameter.name.removesuffix("_pos").removesuffix("_neg")
            if stem == "stribeck_rate":
                point.append(parameter.mean + np.log(factor))
            else:
                point.append(float(parameter.unconstrained(np.asarray(begin[stem]))))
        u = np.array(point)
        u[-1] = np.log(max(float(np.std(residuals(u))), 1e-6 * effort))
        rows.append(u)
    return np.stack(rows)
