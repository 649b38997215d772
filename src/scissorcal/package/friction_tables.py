"""What a package's tables hold of a friction law, and what they cannot hold."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration import FitResult
from scissorcal.errors import InputError
from scissorcal.model import FrictionLaw, friction_torque
from scissorcal.model.friction import angle_factor
from scissorcal.model.terms import TERMS, Motion
from scissorcal.recipe.schema import Recipe

Array = NDArray[np.float64]

PLACES = 201
STEP = 1e-4
"""Half a difference, as a share of the fastest rate, by which terms are differentiated."""


def friction_tables(law: FrictionLaw, recipe: Recipe) -> dict[str, dict[str, Any]]:
    """Level of friction against speed for both directions, and the factor over the opening.

    Adopted terms of the rate alone go into the levels. Raises InputError where friction would
    drive the motion, or where an adopted term depends on the place: the tables are a product of
    rate and place, which no such term is.
    """
    unfit = [name for name in law.terms if not TERMS[name].of_rate_only]
    if unfit:
        raise InputError(
            f'The friction fit adopted "{unfit[0]}", which a package cannot carry: its friction is '
            "a level over the rate times a factor over the opening. Remove it from "
            "fit.friction.adopt and fit again, or set scene.render_friction = false."
        )
    fastest = recipe.scene.opening_rate_rad_per_s[1]
    low, high = recipe.scene.opening_rad
    places = np.linspace(low, high, PLACES)
    factors = angle_factor(law, places)
    if factors.min() <= 0:
        raise InputError(
            "The friction fit says that friction drives the motion at "
            f"{np.degrees(places[int(np.argmin(factors))]):.0f} degrees of "
            "opening, which no friction does: capture friction over the whole of "
            "scene.opening_deg, or choose a rung without angle in fit.friction.rung."
        )
    laws: dict[str, dict[str, Any]] = {}
    for name, sign in (("friction_opening", 1.0), ("friction_closing", -1.0)):
        _refuse_driving(law, sign, fastest)
        laws[name] = {
            "law": lambda speed, sign=sign: _level(law, sign, speed),
            "derivative": lambda speed, sign=sign: _level_slope(law, sign, speed, fastest),
            "low": 0.0,
            "high": fastest,
        }
    laws["friction_angle"] = {
        "law": lambda opening: angle_factor(law, opening),
        "derivative": lambda opening: (
            law.angle_slope + 2.0 * law.angle_curvature * (opening - law.angle_center)
        ),
        "low": low,
        "high": high,
    }
    return laws


def left_out(law: FrictionLaw, scene_torque: float) -> tuple[str, ...]:
    """Sentences on what of a law the tables leave out, and what that costs in torque.

    ``scene_torque`` (N m) is the largest that the scene renders. Cogging is the rig's own and is
    left out without a word: the friction fit's notes tell of it.
    """
    said = []
    share = float(np.asarray(law.load_share))
    if share:
        said.append(
            f"fit.friction, load: friction grows by {share:.2g} of the load, and the package "
            f"renders that of an empty joint: up to {share * scene_torque:.2g} N m less than there "
            f"is, at the scene's {scene_torque:.2g} N m."
        )
    sudden = float(np.asarray(law.presliding_share))
    if sudden:
        length = float(np.asarray(law.presliding_length))
        dry = float(max(np.asarray(law.coulomb_pos), np.asarray(law.coulomb_neg)))
        dry += float(np.asarray(law.stribeck))
        said.append(
            f"fit.friction, presliding: after a reversal friction builds up over {length:.2g} rad, "
            f"and the package renders it built up at once: {2 * sudden * dry:.2g} N m too much "
            f"right after one, {2 * sudden * dry / math.e:.2g} N m {length:.2g} rad later."
        )
    return tuple(said)


def cut_left_out(cut: FitResult, scene_torque: float, allowed: float) -> tuple[str, ...]:
    """Sentences on what of a cut's law the tables leave out, and what that costs in torque.

    Friction that grows with the cut's torque is the rig's, so the fit keeps it apart from the
    material. ``scene_torque`` (N m) is the largest that the scene renders; a share that is
    certainly below ``allowed``, what the tables may be off by, is not told.
    """
    share = next((p for p in cut.nuisance if p.name == "load_share"), None)
    if share is None:
        return ()
    most = abs(share.mean) + 2.0 * share.sd
    if most < allowed:
        return ()
    return (
        f"fit.cut, load_share: up to {most * scene_torque:.2g} N m at the scene's "
        f"{scene_torque:.2g} N m are not rendered: friction of the pivot that grows with the cut's "
        f"torque, by {share.mean:.2g} (sd {share.sd:.1g}) of it. Compare rendered torque with the "
        "material's own, not with the motor's.",
    )


def _level(law: FrictionLaw, sign: float, speed: Array) -> Array:
    """Friction's magnitude at the law's centre; at rest its limit from that side."""
    moving = np.maximum(speed, np.finfo(np.float64).tiny)
    return np.asarray(sign * friction_torque(law, law.angle_center, sign * moving))


def _level_slope(law: FrictionLaw, sign: float, speed: Array, fastest: float) -> Array:
    viscous = law.viscous_pos if sign > 0 else law.viscous_neg
    relative = speed / law.stribeck_rate
    fall = 2.0 * law.stribeck * relative / law.stribeck_rate * np.exp(-(relative**2))
    return np.asarray(viscous - fall + _term_slope(law, sign, np.asarray(speed), STEP * fastest))


def _term_slope(law: FrictionLaw, sign: float, speed: Array, step: float) -> Array:
    """Slope of the adopted terms' level by central differences."""
    middle = np.maximum(speed, step)
    total = np.zeros_like(middle)
    for name, coefficient in zip(law.terms, law.coefficients, strict=True):
        above, below = (
            TERMS[name].value(Motion(np.zeros_like(w), sign * w, np.zeros_like(w)))
            for w in (middle + step, middle - step)
        )
        total = total + sign * coefficient * (above - below) / (2.0 * step)
    return total


def _refuse_driving(law: FrictionLaw, sign: float, fastest: float) -> None:
    speeds = np.linspace(0.0, fastest, PLACES)
    levels = _level(law, sign, speeds)
    if levels.min() < 0:
        where = speeds[int(np.argmin(levels))]
        raise InputError(
            f"The friction fit says that friction drives the motion at {sign * where:.2g} rad/s, "
            "which no friction does: capture friction over the whole of "
            "scene.opening_rate_rad_per_s, or remove the term "
            f"{', '.join(law.terms) or 'that falls with the speed'} from the fit."
        )
