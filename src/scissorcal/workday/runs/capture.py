"""Take a capture into a workspace: rig, recording, and what is kept when something goes wrong."""

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Literal, NamedTuple

from scissorcal.calibration.design.state import fitted_cut
from scissorcal.device.capture import CaptureReport, capture, capture_by_parts, open_writer, planned
from scissorcal.device.session import Operator, RigSession
from scissorcal.device.trajectory import refuse_without_motor
from scissorcal.errors import InputError
from scissorcal.recipe.load import parse_recipe, read_text, with_designed_captures
from scissorcal.recipe.requirements import (
    CaptureKind,
    DesignedKind,
    capture_cost,
    refuse_long,
    requirements,
)
from scissorcal.recipe.schema import Recipe
from scissorcal.recording import Recording
from scissorcal.recording.header import UNTIL_MARK, UntilMark
from scissorcal.workday.engine import Engine
from scissorcal.workday.options import CaptureOptions, RigOptions
from scissorcal.workday.recordings import used_recordings
from scissorcal.workday.rigs import open_session
from scissorcal.workday.runs.cut import edge_of_photographs
from scissorcal.workday.runs.design import designed_for
from scissorcal.workday.runs.fit import available, load_result
from scissorcal.workday.runs.probe import ensure_probed, last_probe
from scissorcal.workday.runs.sweep_speeds import (
    sliding_below_encoder,
    sweep_bounds,
    with_usable_sweeps,
)
from scissorcal.workday.stock import seconds_at_rig
from scissorcal.workday.until import Earlier, Limits, UntilTolerance
from scissorcal.workday.workspace import Workspace

ADVANCE: Literal["friction-advance"] = "friction-advance"

THEN = (
    "The capture follows at once: keep clear, as the motors move the blades and the carriage along "
    "the whole of its path."
)


class Captured(NamedTuple):
    """A finished capture: its file, its report, and the rig it was taken from.

    ``until`` says how far a capture until the tolerance got.
    """

    path: Path
    report: CaptureReport
    rig: str
    until: UntilMark | None = None


def capture_into(
    workspace: Workspace,
    kind: CaptureKind,
    rig: RigOptions,
    options: CaptureOptions = CaptureOptions(),
    operator: Operator | None = None,
) -> Captured:
    """Record friction or cuts from a rig into captures/<kind>-<stamp>.mcap.

    Each recording of one seed of a virtual rig has another noise. The operator is asked to load
    material; a virtual rig loads by itself. A rig without a probe that counts is probed first
    (`ensure_probed`); the blades are then cleared once for both. A hand's capture needs none.
    Friction of the carriage may be captured for any scene. Whatever was recorded before an error
    stays in the file.

    Raises InputError where options are at odds, where the scene needs no such capture, where it
    would take longer than 4 hours (24 where the options say that this is meant), or for a carriage
    without an advance motor or without travel, before anything moves; MissingError where one until
    the tolerance lacks a fit that it builds on; and what the capture itself raises.
    """
    _refuse_at_odds(kind, options)
    recipe = workspace.recipe()
    if kind != ADVANCE and not requirements(recipe).needs_capture(kind):
        raise InputError(f"{workspace.recipe_path}: this scene needs no capture of {kind}.")
    earlier = None
    if options.until_tolerance and kind != ADVANCE:
        earlier = _earlier(Engine.of(workspace), kind)
    if not options.hand:
        free = shutil.disk_usage(workspace.root).free
        refuse_long(capture_cost(recipe, kind), free, meant=options.long)
    text, run = read_text(workspace.recipe_path), len(workspace.recordings(kind))
    with open_session(recipe, rig, operator, recipe_toml=text, run=run) as session:
        if kind == ADVANCE:
            refuse_without_motor(session.identity)
            planned(recipe, session.identity, kind)
        if options.hand:
            session = replace(session, probe=last_probe(workspace, session.link))
        else:
            session = ensure_probed(workspace, session, THEN)
        path, mark = workspace.new_recording(kind), None
        if earlier is not None and kind != ADVANCE:
            report, mark = _capture_until(session, kind, path, options, earlier)
        else:
            session = _with_captures(workspace, session, kind, options)
            with open_writer(session, kind, path, hand=options.hand) as writer:
                report = capture(session, kind, writer, hand=options.hand)
        return Captured(path, report, session.name, mark)


def _refuse_at_odds(kind: CaptureKind, options: CaptureOptions) -> None:
    """Raise InputError where options of a capture contradict each other or its kind."""
    if options.hand and kind != "cut":
        raise InputError("Only cuts are captured by hand: leave out --hand.")
    bounded = options.at_least or options.max_minutes is not None
    if kind == ADVANCE:
        if options.designed is not None or options.until_tolerance or bounded:
            raise InputError(
                "The carriage's capture takes the speeds that capture.friction_advance lists: "
                "leave out --designed, --as-in-recipe, --until-tolerance and its options."
            )
    elif not options.until_tolerance:
        if bounded:
            raise InputError(
                "--at-least and --max-minutes bound a capture until the tolerance: add "
                "--until-tolerance, or leave them out."
            )
    elif options.designed is not None:
        raise InputError(
            "--until-tolerance chooses each stroke while it captures: leave out --designed and "
            "--as-in-recipe."
        )
    elif options.hand:
        raise InputError(
            "--until-tolerance drives the strokes that are worth most: a hand cannot be told so. "
            "Leave out --hand."
        )


def _with_captures(
    workspace: Workspace, session: RigSession, kind: CaptureKind, options: CaptureOptions
) -> RigSession:
    """The session whose recipe lists what is captured now: as designed, and as the rig can."""
    recipe, say = session.recipe, session.operator.say
    if kind == ADVANCE:
        warning = sliding_below_encoder(recipe, session.identity)
        if warning:
            say(warning)
        return session
    design = recipe.capture.designed(kind) if options.designed is None else options.designed
    if design and not options.hand:
        designed, sentence = designed_for(workspace, kind, session.identity)
        session = _with_list(workspace, session, designed)
        say(sentence)
    if kind == "friction":
        usable, why = with_usable_sweeps(session.recipe, session.identity, session.probe)
        if why:
            session = _with_list(workspace, session, usable)
            say(why)
    return session


def _with_list(workspace: Workspace, session: RigSession, recipe: Recipe) -> RigSession:
    """The session with another list of captures in its recipe, and in the recipe's text."""
    text = with_designed_captures(recipe, session.recipe_toml)
    parsed = parse_recipe(text, str(workspace.recipe_path), judged=False)
    return replace(session, recipe=parsed, recipe_toml=text)


def _capture_until(
    session: RigSession,
    kind: DesignedKind,
    path: Path,
    options: CaptureOptions,
    earlier: Earlier,
) -> tuple[CaptureReport, UntilMark]:
    """Record strokes until the band of the torque is within the scene's tolerance.

    After each stroke the recording gets a mark with how far it is: the last one of an interrupted
    capture shows that the tolerance was not reached.
    """
    recipe, identity = session.recipe, session.identity
    minutes = options.max_minutes
    if minutes is None:
        minutes = seconds_at_rig(recipe, planned(recipe, identity, kind)) / 60.0
    limits = Limits(minutes, options.at_least)
    if kind == "friction":
        slowest = sweep_bounds(recipe, identity, session.probe)[1]
        limits = limits._replace(slowest_sweep=slowest)
    choice = UntilTolerance(kind, recipe, identity, earlier, limits)
    with open_writer(session, kind, path, by_parts=True) as writer:

        def chosen() -> None:
            if choice.marks:
                writer.mark(UNTIL_MARK, choice.marks[-1].as_text())
                session.operator.approach(choice.marks[-1])

        offered = replace(session, recipe=choice.recipe)
        report = capture_by_parts(
            offered, kind, writer, choice, longest_s=60.0 * minutes, chosen=chosen
        )
        writer.note(choice.marks[-1].sentence)
    return report, choice.marks[-1]


def _earlier(engine: Engine, kind: DesignedKind) -> Earlier:
    """The fits that are current and their recordings; a cut needs the fit of friction."""

    def used(what: DesignedKind) -> tuple[Recording, ...]:
        there = any(row.use == "used" for row in engine.recordings(what))
        recordings = used_recordings(engine.workspace, engine.recipe, what, engine.index)
        return recordings if there else ()

    there = available(engine, ("friction", "cut", "blade"))
    edge = edge_of_photographs(engine)[0] if kind == "cut" or "blade" in there else None
    swept = used("friction")
    if kind == "cut":
        friction = load_result(engine, "friction")
        law = load_result(engine, "cut").candidate if "cut" in there else None
        return Earlier(swept, used("cut"), friction, edge=edge, last_law=law)
    friction = load_result(engine, "friction") if "friction" in there else None
    cut = None
    if friction is not None and "cut" in there:
        cuts = used("cut")
        cut = fitted_cut(cuts, engine.recipe, friction, load_result(engine, "cut"), edge)
    return Earlier(swept, (), friction, cut, edge)
