"""Fit what a workspace's scene requires, in order, and only where something changed."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from scissorcal.errors import InputError, MissingError
from scissorcal.recipe.requirements import requirements
from scissorcal.recipe.schema import Recipe
from scissorcal.workday.recordings import usable_recordings
from scissorcal.workday.workspace import FitKind, Workspace

if TYPE_CHECKING:
    from scissorcal.calibration import FitResult
    from scissorcal.calibration.result import Effort

Progress = Callable[[float, str], None]
Stop = Callable[[], bool]

FIT_ORDER: tuple[FitKind, ...] = ("friction", "cut")
"""Fits in the order in which they build on one another."""


@dataclass(frozen=True)
class FitOutcome:
    """One fit of a workspace: its result, its file, and whether it had to be done at all.

    ``verified`` says that there is a trust check of this very fit.
    """

    what: FitKind
    result: "FitResult"
    path: Path
    cached: bool
    verified: bool = False


def fit_workspace(
    workspace: Workspace,
    wanted: Sequence[FitKind] = (),
    *,
    effort: "Effort | None" = None,
    seed: int = 0,
    force: bool = False,
    progress: Progress | None = None,
    stop: Stop | None = None,
) -> tuple[FitOutcome, ...]:
    """Run the fits that the scene requires, each only where its inputs changed.

    ``wanted`` names fits; none means all that the scene requires. A cut's fit builds on that of
    friction, which is run first where it is missing or its inputs changed. ``effort`` is the
    recipe's where not given. A fit whose inputs hash (recordings, settings, effort, fits it builds
    on) equals that of the stored one is read back instead; ``force`` does it again all the same.
    Draft fits one law: the recipe's, else the one that the stored fit chose. ``stop`` says whether
    the time allowed is used up; a fit that this ended is stored as one that is not current.

    Raises InputError where the scene does not require what is wanted, MissingError where nothing
    was captured, and what the fits themselves raise.
    """
    recipe = workspace.recipe()
    needed = [item.name for item in requirements(recipe).fits]
    order: list[FitKind] = [kind for kind in FIT_ORDER if kind in (wanted or needed)]
    _refuse_unneeded(workspace, order, needed)
    if "cut" in order and "friction" not in order and not _friction_is_current(workspace, recipe):
        order.insert(0, "friction")
    outcomes: list[FitOutcome] = []
    for index, kind in enumerate(order):
        share = progress_share(progress, index, len(order))
        outcomes.append(_fit(workspace, recipe, kind, effort, seed, force, share, stop))
    return tuple(outcomes)


def current_fits(
    workspace: Workspace,
    recipe: Recipe,
    *,
    partial: bool = False,
    wanted: Sequence[FitKind] = (),
) -> "dict[FitKind, FitResult]":
    """Load the fits that the scene requires, as far as they are of what is there now.

    Raises MissingError naming the command where one is missing or its inputs changed since; with
    ``partial`` it is enough that one is there. ``wanted`` names those that must be there; others
    are left out, but for friction, which a cut builds on.
    """
    from scissorcal.calibration import load_fit

    fits: dict[FitKind, FitResult] = {}
    needed = [item.name for item in requirements(recipe).fits]
    if wanted:
        _refuse_unneeded(workspace, wanted, needed)
        needed = [kind for kind in needed if kind in wanted or kind == "friction"]
    for what in (kind for kind in FIT_ORDER if kind in needed):
        path = workspace.fit_path(what)
        if not path.is_file():
            if partial and fits and what not in wanted:
                continue
            raise MissingError(f"There is no fit of {what} yet: run 'scissorcal fit' first.")
        fits[what] = load_fit(path)
        if fits[what].what != what:
            raise InputError(
                f"{path} holds a fit of {fits[what].what}: remove it and run 'scissorcal fit'."
            )
        if not is_current(workspace, recipe, fits[what], fits.get("friction")):
            raise MissingError(
                f"{path} was made from other recordings or settings than there are now: run "
                "'scissorcal fit' first."
            )
    return fits


def is_current(
    workspace: Workspace, recipe: Recipe, fit: "FitResult", friction: "FitResult | None"
) -> bool:
    """Whether a fit's inputs are still what they were, at the fit's own effort.

    ``friction`` is the friction fit as it is now, which a fit of a cut builds on.
    """
    upstream = _upstream(workspace, recipe, friction) if fit.what == "cut" else ""
    return fit.inputs_hash == expected_hash(workspace, recipe, fit.what, fit.effort, upstream)


def expected_hash(
    workspace: Workspace, recipe: Recipe, what: FitKind, effort: str, upstream: str = ""
) -> str:
    """Return the inputs hash that a fit of the workspace would have now."""
    from scissorcal.calibration import fit_inputs_hash
    from scissorcal.calibration.cut import settings_of

    settings = recipe.fit.friction.model_dump_json() if what == "friction" else settings_of(recipe)
    recordings = usable_recordings(workspace, recipe, what).recordings
    return fit_inputs_hash(what, recordings, settings, effort, upstream)


def _upstream(workspace: Workspace, recipe: Recipe, friction: "FitResult | None") -> str:
    """What a fit of a cut builds on now; what is missing or of no use gives a hash no fit has."""
    from scissorcal.calibration.hashing import cut_upstream
    from scissorcal.workday.geometry import edge_belief

    try:
        edge = edge_belief(workspace, recipe)
    except (MissingError, InputError):
        return "no fit of the blade"
    return cut_upstream(friction.inputs_hash if friction else "", edge)


def _fit(
    workspace: Workspace,
    recipe: Recipe,
    what: FitKind,
    effort: "Effort | None",
    seed: int,
    force: bool,
    progress: Progress,
    stop: Stop | None,
) -> FitOutcome:
    import numpy as np

    from scissorcal.calibration import fit_cut, fit_friction, load_fit, read_header, save
    from scissorcal.calibration.hashing import cut_upstream
    from scissorcal.workday.geometry import edge_belief, edge_verdicts

    chosen: Effort = effort or recipe.fit.effort
    progress(0.0, f"{what}: reading recordings")
    usable = usable_recordings(workspace, recipe, what)
    if not usable.recordings:
        raise MissingError(_nothing_captured(workspace, what, usable.left_out))
    friction = load_fit(workspace.fit_path("friction")) if what == "cut" else None
    if friction is not None and friction.position_unit != "rad":
        raise InputError(
            f"{workspace.fit_path('friction')} is of a linear joint, which carries no blades: the "
            "fit of a cut needs friction of the rig that cuts."
        )
    path = workspace.fit_path(what)
    edge = edge_belief(workspace, recipe) if friction else None
    upstream = cut_upstream(friction.inputs_hash, edge) if friction else ""
    expected = expected_hash(workspace, recipe, what, chosen, upstream)
    if path.is_file() and not force and read_header(path).inputs_hash == expected:
        stored = load_fit(path)
        return FitOutcome(what, stored, path, cached=True, verified=is_verified(workspace, stored))
    rng = np.random.default_rng([seed, FIT_ORDER.index(what)])
    checkpoint = workspace.checkpoint_path(what, expected)
    before = last_chosen(workspace, what)
    if friction is None:
        result = fit_friction(
            usable.recordings,
            recipe.fit.friction,
            effort=chosen,
            rng=rng,
            progress=progress,
            checkpoint=checkpoint,
            last_chosen=before,
            stop=stop,
        )
    else:
        result = fit_cut(
            usable.recordings,
            recipe,
            friction,
            effort=chosen,
            rng=rng,
            progress=progress,
            edge=edge,
            edge_verdicts=edge_verdicts(workspace, recipe),
            checkpoint=checkpoint,
            last_chosen=before,
            stop=stop,
        )
    if result.rejected and stop is not None and stop():
        result = _unfinished(result)
    save(result, path)
    if not result.rejected:
        checkpoint.unlink(missing_ok=True)
    return FitOutcome(what, result, path, cached=False, verified=is_verified(workspace, result))


def last_chosen(workspace: Workspace, what: FitKind) -> str | None:
    """Name of the law that the stored fit chose, whatever its inputs; None where there is none."""
    from scissorcal.calibration import read_header

    path = workspace.fit_path(what)
    try:
        return read_header(path).model if path.is_file() else None
    except InputError:
        return None


def _unfinished(result: "FitResult") -> "FitResult":
    """A fit that ran out of time, marked so that the next run does it again."""
    note = (
        "The time allowed was used up before the fit was finished; the next 'scissorcal fit' does "
        "it again, with --max-minutes for as long as it needs."
    )
    return replace(
        result, inputs_hash=f"unfinished:{result.inputs_hash}", notes=(*result.notes, note)
    )


def _refuse_unneeded(
    workspace: Workspace, wanted: Sequence[FitKind], needed: Sequence[str]
) -> None:
    for kind in wanted:
        if kind not in needed:
            raise InputError(
                f"{workspace.recipe_path}: this scene requires no fit of {kind}; it requires "
                f"{' and '.join(needed)}."
            )


def _friction_is_current(workspace: Workspace, recipe: Recipe) -> bool:
    from scissorcal.calibration import load_fit

    path = workspace.fit_path("friction")
    return path.is_file() and is_current(workspace, recipe, load_fit(path), None)


def _nothing_captured(workspace: Workspace, what: str, left_out: Sequence[str]) -> str:
    because = "".join(f" {sentence}" for sentence in left_out)
    return (
        f"Nothing to fit: {workspace.captures_dir} has no {what} recording for this recipe."
        f"{because} Take one with 'scissorcal capture {what} --device PORT' (or --device sim)."
    )


def progress_share(progress: Progress | None, index: int, count: int) -> Progress:
    """Give the part of a progress that one of several steps may fill."""

    def tell(done: float, sentence: str) -> None:
        if progress is not None:
            progress((index + done) / count, sentence)

    return tell


def is_verified(workspace: Workspace, fit: "FitResult") -> bool:
    """Whether there is a trust check of this very fit."""
    from scissorcal.calibration import load
    from scissorcal.calibration.verify import VerifyResult

    path = workspace.verify_path(fit.what)
    try:
        return path.is_file() and load(path, VerifyResult).fit_hash == fit.inputs_hash
    except InputError:
        return False
