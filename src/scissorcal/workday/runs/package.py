"""Build a workspace's model package from its fits, only where something changed."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from scissorcal.errors import InputError
from scissorcal.recipe.requirements import requirements
from scissorcal.verdicts import Verdict
from scissorcal.workday.geometry import expected_package_hash, scene_plate
from scissorcal.workday.runs.fit import current_fits
from scissorcal.workday.runs.sign import ReviewState, review_state
from scissorcal.workday.workspace import Workspace

if TYPE_CHECKING:
    from scissorcal.package import Manifest


@dataclass(frozen=True)
class Built:
    """A package and what is known of it; ``cached`` where it was already there as it should be."""

    path: Path
    manifest: "Manifest"
    verdicts: tuple[Verdict, ...]
    warnings: tuple[str, ...]
    cached: bool


def build_workspace_package(
    workspace: Workspace, *, seed: int = 0, force: bool = False, allow_failed: bool = False
) -> Built:
    """Compile the fits of a workspace into package/<recipe>.zip.

    The package carries the signature under the report, where there is one that stands. Nothing is
    done where the package there was built from the same fits, recipe and signature, unless
    ``force``. Raises MissingError where a fit is missing or has fallen behind, and what
    `scissorcal.package.build_package` raises.
    """
    import numpy as np

    from scissorcal.package import (
        build_package,
        check_package,
        open_package,
        put_review,
    )

    recipe = workspace.recipe()
    if not requirements(recipe).tables:
        raise InputError(
            f"{workspace.recipe_path}: a linear joint carries no blades (rig.joint), so there is "
            "no package to build; 'scissorcal report' shows its fit."
        )
    fits = current_fits(workspace, recipe)
    friction, cut = fits.get("friction"), fits.get("cut")
    plate = scene_plate(workspace, recipe)
    path = workspace.package_path(recipe)
    state = review_state(workspace, recipe, fits)
    if path.is_file() and not force:
        try:
            package = open_package(path, warn=False)
        except InputError:
            package = None
        expected = expected_package_hash(workspace, recipe, fits)
        if package and package.manifest.provenance.inputs_hash == expected:
            cached = package.manifest.review == state.valid
            if not cached:
                package = put_review(package, state.valid, path)
            warnings = _void(state) + package.warnings
            return Built(path, package.manifest, check_package(path), warnings, cached)
    summary = build_package(
        recipe,
        friction,
        cut,
        path,
        np.random.default_rng(seed),
        review=state.valid,
        plate=plate,
        allow_failed=allow_failed,
    )
    warnings = _void(state) + summary.warnings
    return Built(path, summary.manifest, summary.verdicts, warnings, cached=False)


def _void(state: ReviewState) -> tuple[str, ...]:
    if not state.why:
        return ()
    return (f"The signature under the report was not taken along: {state.why}.",)
