"""What `bench trade` starts from in a workspace: its case, knobs, and the identity of both."""

import os
import platform
from collections.abc import Sequence
from dataclasses import fields, replace
from pathlib import Path

from scissorcal.bench.trade import knob as knobs
from scissorcal.bench.trade.case import Case, Photographed
from scissorcal.bench.trade.knob import make_knob, scene_knobs
from scissorcal.bench.trade.models import held_law, nothing_rendered
from scissorcal.calibration.store import load
from scissorcal.calibration.verify.result import VerifyResult
from scissorcal.errors import InputError
from scissorcal.identity import VERSION, digest
from scissorcal.kernel import Capability
from scissorcal.recipe.friction import as_first_named
from scissorcal.recording import Recording
from scissorcal.workday.engine import Engine
from scissorcal.workday.envelope import plain
from scissorcal.workday.photographs import BladeSetup, photo_captures
from scissorcal.workday.recordings import used_recordings
from scissorcal.workday.runs.cut import edge_of_photographs
from scissorcal.workday.runs.fit import available, load_result
from scissorcal.workday.workspace import FitKind

ALGORITHM = 4
"""Raised whenever a measurement of the same inputs would mean something else."""

LOCAL_KNOBS = ("photographs", "plate")
"""Knobs whose measurements read files of this computer."""

ON_A_CLUSTER = (
    "It is left out with --cluster: photographs are read from files of this computer, which the "
    "cluster's workers may not have. Run 'scissorcal bench trade' without --cluster to measure it."
)


def load_case(engine: Engine, seed: int = 0) -> Case:
    """What a workspace gives to a benchmark: recipe, used recordings and current fits.

    Raises MissingError with the command that must come first.
    """
    kinds: tuple[FitKind, ...] = ("friction", "cut")
    needed = [kind for kind in kinds if engine.needed(f"fit {kind}")]
    if not needed:
        raise InputError(
            f"{engine.workspace.recipe_path}: this scene needs no fit of friction or a cut, so "
            "there is nothing to measure."
        )
    fits = {kind: load_result(engine, kind) for kind in needed}
    recordings = {
        kind: used_recordings(engine.workspace, engine.recipe, kind, engine.index)
        for kind in needed
    }
    edge, verdicts = edge_of_photographs(engine)
    case = Case(
        recipe=engine.recipe,
        friction=recordings.get("friction", ()),
        cut=recordings.get("cut", ()),
        edge=edge,
        edge_verdicts=verdicts,
        friction_fit=fits.get("friction"),
        cut_fit=fits.get("cut"),
        effort=next(fit.effort for fit in reversed(fits.values())),
        seed=seed,
        number_format=engine.recipe.scene.number_format,
        simulated=any(_virtual(one) for own in recordings.values() for one in own),
    )
    if case.cut_fit is not None and not nothing_rendered(case):
        case = replace(case, held=held_law(case, case.cut_fit, case.friction_fit))
    return _with_photographs(case, engine)


def wanted_knobs(case: Case, wanted: Sequence[str], *, on_cluster: bool = False) -> tuple[str, ...]:
    """The knobs to measure, less `LOCAL_KNOBS` on a cluster.

    InputError for one that is unknown, that the scene does not have, or that no cluster measures.
    """
    for name in wanted:
        if name not in knobs.KNOBS:
            raise InputError(f"--knob {name} is no knob; choose from {', '.join(knobs.KNOBS)}.")
        if why := make_knob(name).missing(case):
            raise InputError(f"--knob {name}: this scene does not have it. {why}")
        if on_cluster and name in LOCAL_KNOBS:
            raise InputError(f"--knob {name}: {ON_A_CLUSTER}")
    there = [one for one in scene_knobs(case) if not (on_cluster and one in LOCAL_KNOBS)]
    return tuple(name for name in there if not wanted or name in wanted)


def coverage_notes(engine: Engine) -> list[str]:
    """What verifications of this workspace found of the intervals' coverage, if there are any."""
    found = []
    for name in ("verify friction", "verify cut"):
        if engine.needed(name) and engine.state(name).state in ("done", "failed"):
            check = load(engine.file(name), VerifyResult)
            if check.calibration:
                shares = [quantity.coverage[1].share for quantity in check.calibration.quantities]
                found.append(
                    f"The verification of {check.what} ({check.effort} effort, "
                    f"{check.calibration.fits} simulated fits) found the truth in {min(shares):.0%}"
                    f" to {max(shares):.0%} of its 90 % intervals, by quantity."
                )
    return found or [
        "How often intervals hold the truth was not measured here: 'scissorcal verify' measures it."
    ]


def machine() -> str:
    """The computer in words: processor, cores, system."""
    name = platform.processor() or platform.machine()
    cpu = Path("/proc/cpuinfo")
    if cpu.is_file():
        lines = cpu.read_text(encoding="utf-8", errors="replace").splitlines()
        named = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
        name = named[0] if named else name
    return f"{name}, {os.cpu_count()} cores, {platform.system()}"


def inputs_hash(engine: Engine, case: Case) -> str:
    """Identity of all that a measurement depends on, this computer among it.

    Recordings, fits and photographs count by their content, wherever their files stand.
    """

    def taken(one: Photographed) -> object:
        return plain(replace(one, paths=())), [engine.index.digest(path) for path in one.paths]

    by_content = {
        "recipe": as_first_named(case.recipe.model_dump(mode="json")),
        "friction": [one.content_hash for one in case.friction],
        "cut": [one.content_hash for one in case.cut],
        **{
            f"{kind}_fit": fit and engine.index.digest(engine.file(f"fit {kind}"))
            for kind, fit in (("friction", case.friction_fit), ("cut", case.cut_fit))
        },
        "held": None,  # follows from the fits, the recipe and the seed
        "photographs": [taken(one) for one in case.photographs],
        "plate": case.plate and taken(case.plate),
    }
    others = [one.name for one in fields(case) if one.name not in by_content]
    return digest(
        {
            "algorithm": ALGORITHM,
            "version": VERSION,
            "case": {**by_content, **{name: plain(getattr(case, name)) for name in others}},
            "machine": machine(),
        }
    )


def _virtual(recording: Recording) -> bool:
    return bool(int(recording.device.get("capabilities", 0)) & Capability.SIMULATOR)


def _with_photographs(case: Case, engine: Engine) -> Case:
    """The case with the workspace's photographs of the blade and the plate, and its camera.

    Of the plate only the newest capture counts, as in its fit. A camera counts where its fit is
    current. Raises InputError where a capture's index is damaged.
    """
    blades = []
    for capture in photo_captures(engine.workspace, "blade"):
        setup = capture.index.blade or BladeSetup()
        paths = tuple(capture.path(photograph) for photograph in capture.index.photographs)
        blades.append(Photographed(paths, case.simulated, **setup.model_dump()))
    plate = None
    for capture in photo_captures(engine.workspace, "plate")[-1:]:
        paths = tuple(capture.path(photograph) for photograph in capture.index.photographs)
        plate = Photographed(paths, case.simulated)
    camera = load_result(engine, "camera").camera if available(engine, ["camera"]) else None
    return replace(case, photographs=tuple(blades), camera=camera, plate=plate)
