"""Fit what a workspace's scene requires, in order, and only where something changed."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scissorcal.aliases import Progress
from scissorcal.calibration.caveats import NEXT_RECORDING, ON_RECORD, STEP_VERSION
from scissorcal.calibration.result import Effort, FitResult
from scissorcal.calibration.store import load
from scissorcal.errors import InputError, MissingError, check_known
from scissorcal.verdicts import Verdict
from scissorcal.workday.engine import Engine, refuse_other_fit
from scissorcal.workday.options import FitOptions
from scissorcal.workday.states import WAITING, StepState
from scissorcal.workday.steps import BY_NAME, Step, steps_of
from scissorcal.workday.workspace import Workspace

if TYPE_CHECKING:
    from scissorcal.calibration.fit_model import FitRun

Stop = Callable[[], bool]


@dataclass(frozen=True)
class Request:
    """How a fit is to be made: effort, seed, identity of its inputs, and who follows its ``run``.

    ``critic`` asks for the critic of friction at any effort.
    """

    effort: Effort
    seed: int
    inputs_hash: str
    run: "FitRun"
    critic: bool = False


@dataclass(frozen=True)
class Made:
    """A result, and how to draw its pictures into a folder; None where the report draws it.

    ``notes`` say what this computer could not do beside the fit.
    """

    result: Any
    draw: Callable[[Path], None] | None = None
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class FitOutcome:
    """One fit of a workspace: its result, file, pictures and state, and whether it was cached.

    ``notes`` are those of `Made`.
    """

    what: str
    result: Any
    path: Path
    pictures: tuple[Path, ...]
    cached: bool
    state: StepState
    notes: tuple[str, ...] = ()

    @property
    def verdicts(self) -> tuple[Verdict, ...]:
        return tuple(self.result.verdicts)


def fit_workspace(
    workspace: Workspace,
    wanted: Sequence[str] = (),
    options: FitOptions | None = None,
    *,
    progress: Progress | None = None,
    stop: Stop | None = None,
) -> tuple[FitOutcome, ...]:
    """Run the fits in ``wanted`` ("camera", "blade", "friction-advance", ...), or all required.

    A fit whose identity equals that of the stored one is read back; ``options.force`` does those in
    ``wanted`` again all the same. Fits that a wanted one builds on are run first where they are
    missing or stale. The result that was there is kept (`workday.history`).

    Raises UnknownNameError for a fit that there is not, InputError where the scene does not require
    what is wanted, MissingError where nothing was captured, and what the fits themselves raise.
    """
    for what in wanted:
        check_known("fit", what, [step.what for step in steps_of("fit")])
    engine = Engine.of(workspace)
    steps = steps_to_fit(engine, wanted)
    return tuple(
        fit_step(
            engine,
            step,
            for_step(options, step, wanted),
            progress=share_of(progress, index, len(steps)),
            stop=stop,
        )
        for index, step in enumerate(steps)
    )


def steps_to_fit(engine: Engine, wanted: Sequence[str] = ()) -> list[Step]:
    """The fits to run, in order: those wanted, or all required, and stale ones they build on.

    Raises InputError where the scene does not require what is wanted.
    """
    needed = [step for step in steps_of("fit") if engine.needed(step.name)]
    for what in wanted:
        step = BY_NAME[f"fit {what}"]
        of_rig = BY_NAME[step.inputs[0]].kind == "recordings"
        if step not in needed and of_rig and not step.on_request:
            listed = " and ".join(step.what for step in needed)
            raise InputError(
                f"{engine.workspace.recipe_path}: this scene requires no fit of {what}. It "
                f"requires: {listed}."
            )
    names = {f"fit {what}" for what in wanted} or {step.name for step in needed}
    for step in reversed(steps_of("fit")):
        if step.name in names:
            names |= {item for item in step.inputs if _must_run_first(engine, item)}
    return [step for step in steps_of("fit") if step.name in names]


def for_step(options: FitOptions | None, step: Step, wanted: Sequence[str]) -> FitOptions | None:
    """The options of one fit: it is forced, and its critic asked, only where it is wanted."""
    if options is None:
        return None
    is_wanted = step.what in wanted or not wanted
    return replace(options, force=options.force and is_wanted, critic=options.critic and is_wanted)


def fit_step(
    engine: Engine,
    step: Step,
    options: FitOptions | None = None,
    *,
    progress: Progress | None = None,
    stop: Stop | None = None,
) -> FitOutcome:
    """Run one fit, or read it back where its identity is the stored one's, unless forced."""
    from scissorcal.calibration.fit_model import FitRun
    from scissorcal.workday.history import refuse_unwritable, save_anywhere

    options = options or FitOptions()
    chosen: Effort = options.effort or engine.recipe.fit.effort
    identity = engine.identity(step.name, chosen)
    path = engine.file(step.name)
    stored = _stored(engine, step)
    current = stored.get("inputs") == identity or stored.get("imported")
    if stored and current and not options.force and engine.state(step.name).state != "stale":
        state, result = engine.state(step.name), _load(step, path)
        if not (options.critic and not stored.get("imported") and _unasked(result)):
            return FitOutcome(step.what, result, path, pictures_beside(path), True, state)
    _refuse_without_data(engine, BY_NAME[step.inputs[0]])
    refuse_unwritable(engine, options.save_to)
    checkpoint = path.with_name(f"{step.what}-{identity[:12]}.chains")
    run = FitRun(progress, checkpoint, str(stored.get("model", "")) or None, stop)
    module, _, name = step.run.partition(":")
    fit: Callable[[Engine, Request], Made] = getattr(import_module(module), name)
    made = fit(engine, Request(chosen, options.seed, identity, run, options.critic))
    result = _on_record(engine, step, made.result)
    save_anywhere(engine, step, result, made.draw, options.save_to)
    state = engine.state(step.name)
    if state.state != "incomplete":
        checkpoint.unlink(missing_ok=True)
    drawn = pictures_beside(path)
    return FitOutcome(step.what, result, path, drawn, False, state, made.notes)


def load_result(engine: Engine, what: str) -> Any:
    """Load a fit that is current: its state is neither missing nor stale.

    Raises MissingError naming the command where it is, InputError where it cannot be read.
    """
    step = BY_NAME[f"fit {what}"]
    state = engine.state(step.name)
    if not engine.file(step.name).exists():
        raise MissingError(
            f"There is no fit of {what} yet: run '{engine.leads_to(step.name)}' first."
        )
    if state.state == "stale":
        raise MissingError(
            f"{engine.workspace.relative(engine.file(step.name))} is stale ({state.found}): run "
            f"'{engine.leads_to(step.name)}' first."
        )
    return _load(step, engine.file(step.name))


def available(engine: Engine, names: Sequence[str] = ()) -> tuple[str, ...]:
    """The fits that the scene requires and that are neither missing nor stale nor unreadable."""
    steps = [step for step in steps_of("fit") if not names or step.what in names]
    return tuple(step.what for step in steps if _usable(engine, step))


def share_of(progress: Progress | None, index: int, count: int) -> Progress:
    """Give the part of a progress that one of several steps may fill."""

    def tell(done: float, sentence: str) -> None:
        if progress is not None:
            progress((index + done) / count, sentence)

    return tell


def pictures_beside(path: Path) -> tuple[Path, ...]:
    """Pictures that were drawn for a result: those in the folder of its name."""
    return tuple(sorted(path.with_suffix("").glob("*.png")))


def _on_record(engine: Engine, step: Step, result: Any) -> Any:
    """A law's fit with its step's version, and with how much recordings differ by earlier fits.

    The latter is for a fit of one recording.
    """
    from scissorcal.workday.history import scatter_on_record

    if not isinstance(result, FitResult):
        return result
    known = {**result.diagnostics, STEP_VERSION: step.version}
    if not known.get(NEXT_RECORDING) and (found := scatter_on_record(engine, step)):
        known[ON_RECORD] = found
    return replace(result, diagnostics=known)


def _usable(engine: Engine, step: Step) -> bool:
    state = engine.state(step.name)
    current = state.state not in ("missing", "stale", "excluded") and bool(state.content)
    return current and engine.shown(step.name)


def _must_run_first(engine: Engine, item: str) -> bool:
    step = BY_NAME[item.rstrip("?")]
    return (
        step.kind == "fit"
        and not item.endswith("?")
        and engine.shown(step.name)
        and engine.state(step.name).state in WAITING
    )


def _stored(engine: Engine, step: Step) -> dict[str, Any]:
    """Facts of the stored result; one that cannot be read counts as none, and is made again."""
    if not engine.file(step.name).is_file():
        return {}
    try:
        return engine.facts(step.name)
    except InputError:
        return {}


def _refuse_without_data(engine: Engine, capture: Step) -> None:
    state = engine.state(capture.name)
    if state.content:
        return
    if state.state == "failed":
        raise InputError(
            " ".join((f"{capture.name}: {state.found.removesuffix('.')}.", *state.notes))
        )
    notes = "".join(f" {sentence}" for sentence in state.notes)
    sim = " (or --device sim)" if capture.kind == "recordings" else ""
    raise MissingError(
        f"Nothing to fit ({capture.name}: {state.found}).{notes} Run '{capture.command}'{sim} "
        "first."
    )


def _unasked(result: Any) -> bool:
    """Whether the critic was not asked in a fit."""
    from scissorcal.calibration.critic import NOT_ASKED

    return bool(getattr(result, "diagnostics", {}).get("critic") == NOT_ASKED)


def _load(step: Step, path: Path) -> Any:
    module, _, name = step.holds.partition(":")
    found = load(path, getattr(import_module(module), name))
    refuse_other_fit(step, path, found.what)
    return found
