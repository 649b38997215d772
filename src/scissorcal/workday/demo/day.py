"""The whole day on a virtual rig in virtual time, ending in truth against estimate."""

from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from scissorcal.aliases import Progress
from scissorcal.calibration import FitResult
from scissorcal.calibration.result import Effort
from scissorcal.calibration.verify.result import VerifyResult
from scissorcal.device import capture as rig_capture
from scissorcal.device.lockstep import LockstepLink
from scissorcal.device.session import RigSession
from scissorcal.device.sim.specimen import Specimen, load_specimen
from scissorcal.device.sim.truth import average_torque, true_parameters, varied
from scissorcal.errors import InputError, ScissorcalError
from scissorcal.package import ModelPackage, open_package
from scissorcal.recipe.load import read_text
from scissorcal.recipe.schema import Recipe
from scissorcal.render import Rendering, RenderResult, open_writer, render
from scissorcal.render.rig_facts import rig_facts, with_probe
from scissorcal.verdicts import Verdict
from scissorcal.workday.demo.photographs import (
    Judged,
    fit_photographs,
    judge_photographs,
    photograph,
)
from scissorcal.workday.engine import Engine
from scissorcal.workday.options import FitOptions, Processes, VerifySettings
from scissorcal.workday.pool import open_pool, usable_cores
from scissorcal.workday.runs.fit import FitOutcome, fit_workspace
from scissorcal.workday.runs.package import build_workspace_package
from scissorcal.workday.runs.probe import ensure_probed
from scissorcal.workday.runs.report import write_workspace_report
from scissorcal.workday.runs.verify import VerifyOutcome, verify_workspace
from scissorcal.workday.workspace import Workspace, create_workspace

RENDER_S = 30.0
RIG_FITS = {"rotary": ("friction", "cut"), "linear": ("friction",)}
STROKE_RATES = 3
PRESS_CONTACTS = 3
OPENING_BINS = 25
BIN_PLACES = 8


@dataclass(frozen=True)
class DemoResult:
    """What a demo ends in: estimates beside the truth, the torque's error, what was rendered.

    ``torque_error`` is the rms of rendered minus true average torque over closing strokes that
    cover the scene, relative to the rms of the true one.
    """

    workspace: Path
    specimen: str
    judged: tuple[Judged, ...]
    torque_error: float
    candidates: tuple[str, ...]
    rendering: RenderResult
    verified: tuple[VerifyResult, ...]
    verdicts: tuple[Verdict, ...]
    files: tuple[Path, ...]

    @property
    def share_inside(self) -> float:
        """Share of the 90 % intervals that hold the truth, photographs' among them."""
        known = [row.inside for row in self.judged if row.inside is not None]
        return sum(known) / len(known)


def run_demo(
    folder: Path,
    *,
    recipe_name: str = "paper-photographed",
    seed: int = 0,
    effort: Effort | None = None,
    fits: int,
    progress: Progress | None = None,
) -> DemoResult:
    """Capture, fit, verify, report, package and render on a virtual rig; judge it by the truth.

    Makes a workspace in ``folder``. The specimen is drawn anew for each ``seed`` around the
    recipe's own, so that nothing of it can be known beforehand; the fits see recordings only.
    Time is virtual: equal seeds give equal numbers on every machine. Where two cores are free a
    second process captures, so a script that calls this needs the usual guard on ``__main__``.
    ``fits`` to simulated data verify each fit, 0 for none; thorough ones are left to the command.
    Raises InputError where the recipe has no specimen or the folder is a workspace already.
    """
    tell = progress or (lambda done, sentence: None)
    workspace = create_workspace(folder, recipe_name)
    recipe = workspace.recipe()
    geometry, outcomes = make_day(
        workspace, seed=seed, effort=effort, progress=_part(tell, 0.0, 0.4)
    )
    fits_made = [outcome.result for outcome in outcomes]
    verified: tuple[VerifyOutcome, ...] = ()
    if fits and all(fit.effort != "thorough" for fit in fits_made):
        settings = VerifySettings(fits=fits, seed=seed)
        verified = verify_workspace(workspace, (), settings, progress=_part(tell, 0.4, 0.92))
    specimen, streams = _drawn(recipe, seed)
    engine = Engine.of(workspace)
    tell(0.92, "building the package")
    built = build_workspace_package(engine, seed=seed, allow_failed=True)
    tell(0.94, "writing the report")
    reported = write_workspace_report(engine)
    tell(0.96, "rendering")
    package, rendering, recording = _render(workspace, recipe, LockstepLink(specimen, streams[1]))
    tell(0.98, "judging")
    verdicts = [verdict for outcome in geometry for verdict in outcome.verdicts]
    verdicts += [verdict for fit in fits_made for verdict in fit.verdicts]
    verdicts += [verdict for check in verified for verdict in check.result.verdicts]
    files = [outcome.path for outcome in (*geometry, *outcomes)] + [
        check.path for check in verified
    ]
    return DemoResult(
        workspace=workspace.root,
        specimen=specimen.name,
        judged=(
            *(row for fit in fits_made for row in judge(fit, specimen)),
            *judge_photographs(workspace, recipe, specimen, seed),
        ),
        torque_error=torque_error(package, specimen, recipe),
        candidates=tuple(f"{fit.what}: {fit.candidate}" for fit in fits_made),
        rendering=rendering,
        verified=tuple(check.result for check in verified),
        verdicts=(*verdicts, *built.verdicts, *rendering.verdicts),
        files=(*files, built.path, reported.html, reported.json, recording),
    )


def make_day(
    workspace: Workspace,
    *,
    seed: int = 0,
    capture: int = 0,
    effort: Effort | None = None,
    progress: Progress | None = None,
) -> tuple[tuple[FitOutcome, ...], tuple[FitOutcome, ...]]:
    """Capture and fit all that a new workspace's scene needs, on a virtual rig.

    Gives the fits of photographs and those of recordings. What is drawn for a ``seed``, and the
    second process, are as in `run_demo`; another ``capture`` of the same specimen has other noise
    and other sheets.
    """
    tell = progress or (lambda done, sentence: None)
    recipe = workspace.recipe()
    with open_pool(Processes(min(2, usable_cores()))) as pool:
        tell(0.0, "capturing friction and cuts, beside the photographs where a second core is free")
        captured = pool.executor.submit(_capture, workspace.root, seed, capture)
        photograph(workspace, recipe, seed, _part(tell, 0.05, 0.3))
        geometry = fit_photographs(workspace, recipe, seed, _part(tell, 0.3, 0.47))
        tell(0.47, "waiting for the captures")
        try:
            captured.result()
        except BrokenProcessPool as error:
            raise ScissorcalError(
                "The process that captured was killed, most likely for want of memory: free some, "
                f"remove {workspace.root} and start again."
            ) from error
    what = RIG_FITS[recipe.rig.joint]
    part = _part(tell, 0.47, 1.0)
    return geometry, fit_workspace(workspace, what, FitOptions(effort, seed=seed), progress=part)


def judge(fit: FitResult, specimen: Specimen) -> tuple[Judged, ...]:
    """Put each parameter of a fit beside the specimen's truth.

    The truth is expressed in the fit's own terms: friction expanded at its centre; the force at
    its reference indentation; an offset that an asymmetric law cannot hold, in its Coulomb
    levels; the mean fracture energy where a smooth law was fitted to a ripple. A response of
    another family than the truth's has a true force at the reference, but no true exponent.
    """
    truth = _truth_for(fit, specimen)
    return tuple(
        Judged(
            parameter.name,
            parameter.unit,
            truth.get(parameter.name),
            parameter.moments[0] if parameter.moments else parameter.q50,
            parameter.q05,
            parameter.q95,
        )
        for parameter in fit.parameters
    )


def torque_error(package: ModelPackage, specimen: Specimen, recipe: Recipe) -> float:
    """Relative rms of rendered against true average torque over the scene.

    The kernel closes the blades over the scene's openings at three of its rates, step by step as
    the loop does: on a sheet whose near edge stands at the scene's nearest contact, through which
    a cut then runs; or, where nothing is cut and so the contact stays, at three contacts of the
    scene. Rendered and true average torque are both averaged over 25 ranges of opening, which
    takes the ripple out. Ranges where the true torque exceeds the recipe's limit do not count: no
    model is rendered there, but the limit. Raises InputError where that leaves no place.
    """
    low, high = recipe.scene.opening_rad
    slow, fast = recipe.scene.opening_rate_rad_per_s
    nearest, farthest = recipe.scene.contact_m
    contacts = [nearest]
    if not recipe.scene.cut:
        contacts = np.linspace(nearest, farthest, PRESS_CONTACTS).tolist()
    edges = np.linspace(high, low, OPENING_BINS * BIN_PLACES + 1)
    places = (0.5 * (edges[1:] + edges[:-1])).reshape(OPENING_BINS, BIN_PLACES)
    rendered, true = [], []
    for rate in np.geomspace(2.0 * slow, 0.9 * fast, STROKE_RATES):
        count = int((high - low) / rate * recipe.scene.loop_rate_Hz)
        opening, rates = np.linspace(high, low, count), np.full(count, -rate)
        whole = (np.arange(count) * OPENING_BINS) // count
        for contact in contacts:
            stepped = package.kernel().step_many(opening, rates, np.full(count, -contact))
            rendered.append(np.bincount(whole, stepped["torque"]) / np.bincount(whole))
            friction = recipe.scene.render_friction
            true.append(average_torque(specimen, places, -rate, contact, friction))
    within = np.concatenate(true)
    size = within.mean(axis=1)
    counts = np.abs(within).max(axis=1) <= recipe.limits.torque_Nm
    if not counts.any():
        raise InputError(
            f"{recipe.name}: the torque exceeds limits.torque_Nm = {recipe.limits.torque_Nm:g} all "
            "over the scene, so there is nothing to compare: raise the limit, or render a scene "
            "that stays within it."
        )
    difference = (np.concatenate(rendered) - size)[counts]
    return float(np.sqrt(np.mean(difference**2) / np.mean(size[counts] ** 2)))


def specimen_of(recipe: Recipe, seed: int) -> Specimen:
    """The specimen that a day of a seed captures."""
    return _drawn(recipe, seed)[0]


def _drawn(
    recipe: Recipe, seed: int, capture: int = 0
) -> tuple[Specimen, list[np.random.Generator]]:
    """The specimen of a seed, and streams of noise for one of its captures and for rendering."""
    rng = np.random.default_rng(seed)
    specimen = varied(load_specimen(recipe.specimen or recipe.name), rng)
    return specimen, rng.spawn(2 * capture + 2)[-2:]


def _capture(root: Path, seed: int, capture: int = 0) -> None:
    """Capture friction and cuts of a seed's specimen; another process may do it."""
    workspace = Workspace(root)
    recipe, text = workspace.recipe(), read_text(workspace.recipe_path)
    specimen, streams = _drawn(recipe, seed, capture)
    with LockstepLink(specimen, streams[0]) as link:
        session = ensure_probed(workspace, RigSession(link, recipe, recipe_toml=text))
        for kind in ("friction", "cut"):
            with rig_capture.open_writer(session, kind, workspace.new_recording(kind)) as writer:
                rig_capture.capture(session, kind, writer)


def _truth_for(fit: FitResult, specimen: Specimen) -> dict[str, float]:
    if fit.what == "friction":
        center = fit.structure["angle_center"]
        sides = true_parameters(specimen, angle_center=center)
        if not fit.structure["symmetric"]:
            sides["coulomb_pos"] += sides["offset"]
            sides["coulomb_neg"] -= sides["offset"]
            sides["offset"] = 0.0
            return sides
        truth = true_parameters(specimen, angle_center=center, symmetric=True)
        truth["offset"] += 0.5 * (sides["coulomb_pos"] - sides["coulomb_neg"])
        return truth
    truth = true_parameters(
        specimen, reference_indentation_m=fit.structure["reference_indentation_m"]
    )
    if fit.structure["response"] != specimen.material.response:
        del truth["response_exponent"]
    if fit.structure["fracture"] == "smooth" and "kappa" in truth:
        truth["fracture_energy"] *= _mean_share(truth)
    return truth


def _mean_share(truth: dict[str, float]) -> float:
    """Mean over a ripple of a power response, as a share of its peak.

    With g = g_c u^n, u even between kappa^(1/n) and 1: (1 - kappa^(1 + 1/n)) / ((n + 1) (1 - u_0)).
    """
    exponent, kappa = truth["response_exponent"], truth["kappa"]
    lowest = float(kappa ** (1.0 / exponent))
    if lowest >= 1.0:
        return 1.0
    return float((1.0 - lowest ** (exponent + 1.0)) / ((exponent + 1.0) * (1.0 - lowest)))


def _render(
    workspace: Workspace, recipe: Recipe, link: LockstepLink
) -> tuple[ModelPackage, RenderResult, Path]:
    package = open_package(workspace.package_path(recipe), warn=False)
    text = read_text(workspace.recipe_path)
    session = ensure_probed(workspace, RigSession(link, recipe, recipe_toml=text))
    path = workspace.new_recording("render")
    with open_writer(session, package, path) as writer:
        facts = with_probe(rig_facts(package), session.probe)
        result = render(session, package, Rendering(RENDER_S), writer=writer, rig=facts)
    return package, result, path


def _part(tell: Progress, low: float, high: float) -> Progress:
    return lambda done, sentence: tell(low + (high - low) * done, sentence)
