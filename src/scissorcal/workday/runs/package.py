"""Build a workspace's model package from its fits, only where something changed."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scissorcal.calibration.store import load
from scissorcal.calibration.verify.result import VerifyResult
from scissorcal.errors import InputError, MissingError, VerdictError
from scissorcal.verdicts import Check, Verdict
from scissorcal.workday.engine import Engine
from scissorcal.workday.runs.fit import load_result
from scissorcal.workday.runs.sign import standing_review
from scissorcal.workday.states import WAITING
from scissorcal.workday.steps import BY_NAME

if TYPE_CHECKING:
    from scissorcal.package import Manifest
    from scissorcal.package.manifest import RigRecord
    from scissorcal.package.signature import Sign
    from scissorcal.package.simplest.choice import SceneChoice
    from scissorcal.workday.workspace import Workspace

CURRENT = Check(
    "package current",
    "what is rendered: 1 if it was built from the workspace's fits as they are now",
    at_least=1.0,
)
UNSIGNED = (
    "The package's signature was left out, as it was given with another review: sign it again "
    "with 'scissorcal package build --key'."
)


@dataclass(frozen=True)
class Built:
    """A package and what is known of it; ``cached`` where it was already there as it should be.

    ``choice`` says what of the fitted laws the scene needs, and what leaving the rest out saves.
    """

    path: Path
    manifest: "Manifest"
    verdicts: tuple[Verdict, ...]
    warnings: tuple[str, ...]
    cached: bool
    choice: "SceneChoice | None" = None


def build_workspace_package(
    engine: Engine,
    *,
    seed: int = 0,
    force: bool = False,
    allow_failed: bool = False,
    sign: "Sign | None" = None,
) -> Built:
    """Compile the fits of a workspace into package/<recipe>.zip.

    The package carries the signature under the report, where there is one that stands. Nothing is
    done where the package there was built from the same fits, recipe and signature, unless
    ``force``. ``sign`` signs content and review (`scissorcal.package.keys.signer`).

    Raises VerdictError where a fit failed, unless ``allow_failed``, MissingError where a fit is
    missing or stale, and what `scissorcal.package.build_package` raises.
    """
    import numpy as np

    from scissorcal.package import PackageOptions, build_package, open_package, put_review
    from scissorcal.package.check import check_built
    from scissorcal.package.signature import signed_text
    from scissorcal.recipe.plate_layers import plate_pieces
    from scissorcal.workday.runs.simplest import store_scene_choice, workspace_scene_choice

    if not engine.needed("package build"):
        raise InputError(
            f"{engine.workspace.recipe_path}: a linear joint carries no blades (rig.joint), so "
            "there is no package to build; 'scissorcal report' shows its fit."
        )
    fits = _fits(engine)
    if not allow_failed:
        _refuse_failed(engine)
    review, path = standing_review(engine), engine.file("package build")
    if path.is_file() and not force:
        try:
            package = open_package(path, warn=False)
        except InputError:
            package = None
        if package and package.manifest.provenance.inputs_hash == engine.identity("package build"):
            before = package.manifest
            cached = before.review == review
            if sign is not None:
                cached = cached and before.signature == sign(signed_text(before))
            if not cached:
                package = put_review(package, review, path, sign)
            warnings = _void(engine) + package.warnings
            if before.signature and not package.manifest.signature:
                warnings += (UNSIGNED,)
            engine.refresh()
            choice = workspace_scene_choice(engine)
            verdicts = check_built(package)
            return Built(path, package.manifest, verdicts, warnings, cached, choice)
    summary = build_package(
        engine.recipe,
        fits["friction"],
        fits["cut"],
        path,
        np.random.default_rng(seed),
        options=PackageOptions(
            review=review,
            plate=fits["plate"],
            drawn=plate_pieces(engine.recipe.plate, engine.workspace.root),
            rig=recorded_rig(engine.workspace.captures_dir, fits),
            inputs_hash=engine.identity("package build"),
            allow_failed=allow_failed,
            sign=sign,
        ),
    )
    engine.refresh()
    warnings = _void(engine) + summary.warnings
    choice = store_scene_choice(engine, summary.simplified, fits)
    return Built(path, summary.manifest, summary.verdicts, warnings, False, choice)


def built_package(workspace: "Workspace", purpose: str) -> Path:
    """The workspace's package; MissingError, with the command that leads to one, without it.

    ``purpose`` is what it is wanted for, as a verb.
    """
    path = workspace.package_path(workspace.recipe())
    if not path.is_file():
        command = Engine.of(workspace).leads_to("package build")
        raise MissingError(f"There is no package to {purpose} yet: run '{command}' first.")
    return path


def current_verdict(engine: Engine) -> Verdict:
    """Whether the workspace's package is of its fits; not evaluated where one of them is gone."""
    fits = [item for item in BY_NAME["package build"].inputs if engine.needed(item)]
    gone = [item for item in fits if not engine.file(item).is_file()]
    if gone:
        return CURRENT.not_evaluated(
            f"{' and '.join(gone)} of the workspace {'is' if len(gone) == 1 else 'are'} missing, "
            "so whether the package is of its fits is not known: run "
            f"'{engine.leads_to('package build')}', or 'scissorcal fit restore' if it was kept."
        )
    same = engine.facts("package build")["inputs"] == engine.identity("package build")
    current = same and not any(engine.state(item).state in WAITING for item in fits)
    stale = (
        "The package was built from other fits or settings than there are now. Run "
        f"'{engine.leads_to('package build')}'."
    )
    why = "The package was built from the workspace's fits as they are now."
    return CURRENT.judge(float(current), why, stale)


def _fits(engine: Engine) -> dict[str, Any]:
    """The fits that the package is compiled from; None where the scene does not need one.

    What their verifications failed is among their verdicts, so that the package lists it.
    """
    found: dict[str, Any] = {}
    for item in BY_NAME["package build"].inputs:
        step = BY_NAME[item]
        fit = load_result(engine, step.what) if engine.needed(item) else None
        if fit and step.verified_by and engine.state(step.verified_by).state == "failed":
            check = load(engine.file(step.verified_by), VerifyResult)
            fit = replace(fit, verdicts=(*fit.verdicts, *check.rejected))
        found[step.what] = fit
    return found


def recorded_rig(captures: Path, fits: Mapping[str, Any]) -> "RigRecord | None":
    """The rig of the recordings: of friction, which is the rig's own, else of the cut.

    None where no recording is there that states one.
    """
    from scissorcal.device.session import identity_of
    from scissorcal.package.manifest import RigRecord
    from scissorcal.recording.header_reader import read_header

    sources = [name for what in ("friction", "cut") if fits[what] for name in fits[what].sources]
    for source in sources:
        path = captures / Path(source.rpartition(" sha256:")[0]).name
        device = read_header(path).device if path.is_file() else {}
        if "schema_hash" in device:
            stated = identity_of(device, path.name)
            return RigRecord(
                name=stated.name,
                serial=stated.serial,
                torque_limit_Nm=stated.torque_limit,
                force_limit_N=stated.force_limit,
            )
    return None


def _refuse_failed(engine: Engine) -> None:
    for item in BY_NAME["package build"].inputs:
        state = engine.state(item)
        if state.state == "damaged":
            raise InputError(f"No package was built: {state.found}.")
        if state.state == "failed":
            raise VerdictError(
                f"No package was built: the {item.replace('fit', 'fit of')} failed "
                f"({', '.join(state.failed) or state.found}). Run '{state.command}'. "
                "'scissorcal package build --allow-failed' builds one all the same, which reports "
                "it wherever it is used."
            )


def _void(engine: Engine) -> tuple[str, ...]:
    state = engine.state("report sign")
    if state.state != "stale":
        return ()
    return (f"The signature under the report is void and was left out: {state.found}.",)
