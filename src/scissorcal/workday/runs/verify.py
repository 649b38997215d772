"""The verification of a workspace's fits: in parallel, resumable, kept beside the fit."""

import pickle
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from scissorcal.aliases import Progress
from scissorcal.calibration import FitResult
from scissorcal.calibration.friction.advance import actuation_of, sliding_joints
from scissorcal.calibration.store import load, save
from scissorcal.calibration.verify.check import StudySettings, assess, tasks_of
from scissorcal.calibration.verify.of_fit import Known, known_cut, known_friction
from scissorcal.calibration.verify.result import VerifyResult
from scissorcal.calibration.verify.study import Study, Task, run
from scissorcal.errors import InputError, MissingError
from scissorcal.identity import digest
from scissorcal.workday.engine import Engine
from scissorcal.workday.options import Processes, VerifySettings
from scissorcal.workday.pool import Pool, open_pool, unpacked
from scissorcal.workday.recordings import used_recordings
from scissorcal.workday.records import Record, RecordFile
from scissorcal.workday.runs.cut import edge_of_photographs
from scissorcal.workday.runs.fit import available, load_result, share_of
from scissorcal.workday.workspace import FitKind, Workspace

ALGORITHM = 7
"""Raised whenever a fit of the same inputs would give other numbers."""


@dataclass(frozen=True)
class VerifyOutcome:
    """The check of one fit, its file, how many fits it took now, and what to say on the side."""

    what: FitKind
    result: VerifyResult
    path: Path
    fitted: int
    notes: tuple[str, ...]


def verify_workspace(
    workspace: Workspace,
    wanted: Sequence[FitKind] = (),
    settings: VerifySettings = VerifySettings(),
    processes: Processes = Processes(),
    progress: Progress | None = None,
) -> tuple[VerifyOutcome, ...]:
    """Check the fits of a workspace, those in ``wanted`` or all that there are.

    Every single fit is kept in fits/<what>.verify.partial.jsonl as soon as it is done, so that a
    killed run goes on where it was, and one that asks for more fits takes those that are there.
    Their random numbers depend on seed and index alone: the result is the same in all
    ``processes``. The whole stands in fits/<what>.verify.json at the end.

    Raises MissingError where a fit is missing or not of what is there now, InputError where the
    cluster cannot be used or another run holds the file.
    """
    engine = Engine.of(workspace)
    kinds = _kinds(engine, wanted)
    outcomes = []
    with open_pool(processes) as pool:
        for index, kind in enumerate(kinds):
            tell = share_of(progress, index, len(kinds))
            tell(0.0, f"{kind}: making ready")
            known = _known(engine, kind)
            study = known.study(StudySettings(settings.seed, settings.prior, settings.spread))
            tasks = tasks_of(study, settings.checks, settings.fits)
            partial = workspace.verify_partial_path(kind)
            with RecordFile(partial, _inputs_hash(engine, kind, settings)) as file:
                fitted = _run(pool, study, tasks, file, kind, tell)
                wanted_tasks = {(task.kind, task.index) for task in tasks}
                records = [r for r in file.records if (r["kind"], r["index"]) in wanted_tasks]
                result = assess(study, known.fit, settings.checks, records)
                result = replace(result, fit_content=engine.identity(f"verify {kind}"))
                path = engine.file(f"verify {kind}")
                if not _holds(path, result):
                    save(result, path)
                engine.refresh()
            notes = (file.note,) if file.note else ()
            outcomes.append(VerifyOutcome(kind, result, path, fitted, notes))
    return tuple(outcomes)


def _holds(path: Path, result: VerifyResult) -> bool:
    """Whether the file holds this result: then it stays, an earlier version's too, as signed."""
    try:
        return load(path, VerifyResult) == result
    except InputError:  # missing or damaged
        return False


def _kinds(engine: Engine, wanted: Sequence[FitKind]) -> list[FitKind]:
    """What is checked: the wanted fits, or those of the rig that are current."""
    if wanted:
        return list(wanted)
    kinds: tuple[FitKind, ...] = ("friction", "friction-advance", "cut")
    there = available(engine, kinds)
    if not there:
        raise MissingError("There is no fit to check yet: run 'scissorcal fit' first.")
    return [kind for kind in kinds if kind in there]


def _known(engine: Engine, kind: FitKind) -> Known:
    """A current fit with its design, its simulator, and the sheets of its strokes."""
    fit: FitResult = load_result(engine, kind)
    recipe = engine.recipe
    recordings = used_recordings(engine.workspace, recipe, kind, engine.index)
    if kind == "friction":
        return known_friction(recordings, recipe.fit.friction, fit)
    if kind == "friction-advance":
        own = recipe.fit.advance
        slid = sliding_joints(recordings, actuation_of(fit), own.lack_of_fit)
        return known_friction(slid, own, fit)
    edge, _ = edge_of_photographs(engine)
    friction: FitResult = load_result(engine, "friction")
    return known_cut(recordings, recipe, friction, fit, edge)


def _run(
    pool: Pool,
    study: Study,
    tasks: Sequence[Task],
    file: RecordFile,
    kind: FitKind,
    tell: Progress,
) -> int:
    """Do the tasks that have no record yet, and record each; return how many those were."""
    done = {(record["kind"], record["index"]) for record in file.records}
    left = [task for task in tasks if (task.kind, task.index) not in done]
    blob = pickle.dumps(study)
    began, finished = time.monotonic(), 0
    if len(left) < len(tasks):
        tell(1 - len(left) / len(tasks), f"{kind}: {len(tasks) - len(left)} fits are there already")

    def keep(record: Record) -> None:
        nonlocal finished
        file.append(record)
        finished += 1
        seconds = (time.monotonic() - began) / finished * (len(left) - finished)
        tell(
            1 - (len(left) - finished) / len(tasks),
            f"{kind}: {len(tasks) - len(left) + finished} of {len(tasks)} fits, "
            f"{_duration(seconds)} left",
        )

    pool.work(_do, [(blob, task) for task in left], keep, dict[str, Any])
    return finished


def _do(job: tuple[bytes, Task]) -> Record:
    blob, task = job
    return run(unpacked(blob), task)


def _inputs_hash(engine: Engine, kind: FitKind, settings: VerifySettings) -> str:
    """Identity of all that single fits depend on; not of how many there are."""
    return digest(
        {
            "algorithm": ALGORITHM,
            "fit": engine.identity(f"verify {kind}"),
            "prior": settings.prior,
            "spread": settings.spread,
            "seed": settings.seed,
        }
    )


def _duration(seconds: float) -> str:
    """Say how long, roughly.

    >>> _duration(42), _duration(400), _duration(9000)
    ('42 s', '7 min', '2.5 h')
    """
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"
