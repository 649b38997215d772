"""What a package's tables hold of a friction law, and what they cannot hold."""

import math
from functools import partial
from typing import Any

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration import FitResult
from scissorcal.calibration.parameters import FittedParameter
from scissorcal.errors import InputError
from scissorcal.model import FrictionLaw, friction_torque
from scissorcal.model.curvature import cubic_curvature, level_curvature
from scissorcal.model.friction import angle_factor, angle_slope, friction_level
from scissorcal.model.terms import Role
from scissorcal.package.tables import Function
from scissorcal.recipe.schema import Recipe

PLACES = 201

LOAD_SHARE = "load_share"
SIGNS = {"friction_opening": 1.0, "friction_closing": -1.0}
"""Direction of motion of each table of levels."""


def friction_tables(law: FrictionLaw, recipe: Recipe) -> dict[str, dict[str, Any]]:
    """Level of friction against speed for both directions, and the factor over the opening.

    Rows of the table of terms that depend on the rate alone go into the levels, those of the place
    into the factor; :func:`left_out` names the rest. Raises InputError where friction would drive
    the motion, or where an adopted term depends on the place: the tables are a product of rate and
    place, which no such term is.
    """
    unfit = [term.name for term in law.terms if term.adoptable and term.role is Role.PLAIN]
    if unfit:
        raise InputError(
            f'The friction fit adopted "{unfit[0]}", which a package cannot carry: its friction is '
            "a level over the rate times a factor over the opening. Remove it from "
            "fit.friction.adopt and fit again, or set scene.render_friction = false."
        )
    fastest = recipe.scene.opening_rate_rad_per_s[1]
    low, high = recipe.scene.opening_rad
    places, factors = _factors(law, recipe)
    if factors.min() <= 0:
        raise InputError(
            "The friction fit says that friction drives the motion at "
            f"{np.degrees(places[int(np.argmin(factors))]):.0f} degrees of "
            "opening, which no friction does: capture friction over the whole of "
            "scene.opening_deg, or choose a law without angle in fit.friction.law."
        )
    laws: dict[str, dict[str, Any]] = {}
    functions = friction_functions(law)
    for name, sign in SIGNS.items():
        _refuse_driving(law, sign, fastest)
        laws[name] = {
            **dict(zip(("law", "derivative"), functions[name], strict=True)),
            "low": 0.0,
            "high": fastest,
            "curvature": partial(level_curvature, law, sign),
        }
    laws["friction_angle"] = {
        **dict(zip(("law", "derivative"), functions["friction_angle"], strict=True)),
        "low": low,
        "high": high,
        "curvature": partial(cubic_curvature, partial(angle_slope, law)),
    }
    return laws


def friction_functions(law: FrictionLaw) -> dict[str, tuple[Function, Function]]:
    """The laws of the friction tables and their derivatives, by table."""
    functions = {name: _level(law, sign) for name, sign in SIGNS.items()}
    return functions | {"friction_angle": (partial(angle_factor, law), partial(angle_slope, law))}


def _level(law: FrictionLaw, sign: float) -> tuple[Function, Function]:
    return (
        lambda speed: friction_level(law, sign, speed)[0],
        lambda speed: friction_level(law, sign, speed)[1],
    )


def least_factor(law: FrictionLaw, recipe: Recipe) -> float:
    """The least factor of friction over the openings of a scene."""
    return float(_factors(law, recipe)[1].min())


def left_out(law: FrictionLaw, scene_torque: float) -> tuple[str, ...]:
    """Sentences on what of a law the tables leave out, and what that costs in torque.

    ``scene_torque`` (N m) is the largest that the scene renders. Cogging is the rig's own and is
    left out without a sentence: the friction fit's notes report it.
    """
    said = []
    loaded = [term for term in law.terms if term.needs_load and term.role is not Role.PLAIN]
    if loaded:
        without = {n: v for n, v in law.values.items() if n not in {t.name for t in loaded}}
        empty = FrictionLaw(without, law.angle_center)
        by_load = [
            friction_torque(one, law.angle_center, [-1.0, 1.0], [[-scene_torque], [scene_torque]])
            for one in (law, empty)
        ]
        most = float(np.abs(by_load[0] - by_load[1]).max())
        said.append(
            f"fit.friction, load: friction grows by {most / scene_torque:.2g} of the load, and the "
            f"package renders that of an empty joint: up to {most:.2g} N m less than there is, at "
            f"the scene's {scene_torque:.2g} N m."
        )
    sudden = float(np.asarray(law["presliding_share"]))
    if sudden:
        length = float(np.asarray(law["presliding_length"]))
        dry = float(max(np.asarray(law["coulomb_pos"]), np.asarray(law["coulomb_neg"])))
        dry += float(np.asarray(law["stribeck"]))
        said.append(
            f"fit.friction, presliding: after a reversal friction builds up over {length:.2g} rad, "
            f"and the package renders it built up at once: {2 * sudden * dry:.2g} N m too much "
            f"right after one, {2 * sudden * dry / math.e:.2g} N m {length:.2g} rad later."
        )
    return tuple(said)


def share_of(cut: FitResult) -> FittedParameter | None:
    """The share of the cut's torque that friction adds, None where the law has none."""
    return next((p for p in cut.nuisance if p.name == LOAD_SHARE), None)


def cut_left_out(
    cut: FitResult, scene_torque: float, allowed: float, *, rendered: bool
) -> tuple[str, ...]:
    """Sentences on what of a cut's law the tables leave out, and what that costs in torque.

    Friction that grows with the cut's torque is the rig's, so the fit keeps it apart from the
    material; ``rendered`` says that the package has it with the material's torque
    (:mod:`~scissorcal.package.by_load`). ``scene_torque`` (N m) is the largest that the scene
    renders; a share that is certainly below ``allowed``, what the tables may be off by, is not
    reported.
    """
    share = share_of(cut)
    if share is None:
        return ()
    most = abs(share.mean) + 2.0 * share.sd
    if most < allowed:
        return ()
    if rendered:
        return (
            "fit.cut, load_share: friction of the pivot that grows with the cut's torque, by "
            f"{share.words} of it, is rendered with the material's torque, "
            "as closing blades feel it. Opening blades, over cracks at rest, feel up to "
            f"{2.0 * most / (1.0 + most) * scene_torque:.2g} N m too much.",
        )
    return (
        f"fit.cut, load_share: up to {most * scene_torque:.2g} N m at the scene's "
        f"{scene_torque:.2g} N m are not rendered: friction of the pivot that grows with the cut's "
        f"torque, by {share.words} of it. Compare rendered torque with the "
        "material's own, not with the motor's.",
    )


def _factors(law: FrictionLaw, recipe: Recipe) -> tuple[Array, Array]:
    """Openings of the scene (rad) and the factor of friction at each."""
    places = np.linspace(*recipe.scene.opening_rad, PLACES)
    return places, angle_factor(law, places)


def _refuse_driving(law: FrictionLaw, sign: float, fastest: float) -> None:
    speeds = np.linspace(0.0, fastest, PLACES)
    levels = friction_level(law, sign, speeds)[0]
    if levels.min() < 0:
        where = speeds[int(np.argmin(levels))]
        adopted = ", ".join(term.name for term in law.terms if term.adoptable)
        raise InputError(
            f"The friction fit says that friction drives the motion at {sign * where:.2g} rad/s, "
            "which no friction does: capture friction over the whole of "
            "scene.opening_rate_rad_per_s, or remove the term "
            f"{adopted or 'that falls with the speed'} from the fit."
        )
