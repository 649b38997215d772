"""Take a capture into a workspace: rig, recording, and what is kept when something goes wrong."""

import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from scissorcal.aliases import Say
from scissorcal.errors import InputError
from scissorcal.recipe.load import parse_recipe, read_text
from scissorcal.recipe.pace import CaptureKind, capture_cost, refuse_long
from scissorcal.recipe.requirements import DesignedKind, requirements
from scissorcal.recipe.show import with_designed_captures
from scissorcal.workday.rigs import line_of, open_rig
from scissorcal.workday.runs.design import designed_for
from scissorcal.workday.runs.probe import ensure_probed, last_probe
from scissorcal.workday.runs.sweep_speeds import (
    sliding_below_encoder,
    sweep_bounds,
    with_usable_sweeps,
)
from scissorcal.workday.workspace import Workspace

if TYPE_CHECKING:
    from scissorcal.device.capture import CaptureReport
    from scissorcal.device.drive import CaptureProgress
    from scissorcal.device.link import Link
    from scissorcal.device.loading import Confirm
    from scissorcal.recipe.schema import Recipe
    from scissorcal.recording import Recording
    from scissorcal.recording.probe import ProbeResult
    from scissorcal.recording.until import UntilMark
    from scissorcal.workday.engine import Engine
    from scissorcal.workday.until import Earlier


@dataclass(frozen=True)
class Until:
    """What bounds a capture until the tolerance, and who follows it.

    At least ``at_least`` strokes (pairs of sweeps), at most ``max_minutes`` planned minutes after
    the first part, which always runs: None for those that the recipe's list takes. ``tell`` is
    called after each update of the fit.
    """

    at_least: int = 0
    max_minutes: float | None = None
    tell: "Callable[[UntilMark], None] | None" = None


ADVANCE: Literal["friction-advance"] = "friction-advance"

THEN = (
    "The capture follows at once: keep clear, as the motors move the blades and the sledge along "
    "the whole of its path."
)


@dataclass(frozen=True)
class Captured:
    """A finished capture: its file, its report, and the rig it was taken from.

    ``until`` says how far a capture until the tolerance got.
    """

    path: Path
    report: "CaptureReport"
    rig: str
    until: "UntilMark | None" = None


def capture_into(
    workspace: Workspace,
    kind: DesignedKind,
    device: str,
    *,
    hand: bool = False,
    designed: bool | None = None,
    until: Until | None = None,
    seed: int = 0,
    baud: int | None = None,
    realtime: bool = False,
    long: bool = False,
    progress: "CaptureProgress | None" = None,
    confirm: "Confirm | None" = None,
    say: "Say | None" = None,
) -> Captured:
    """Record friction or cuts from ``device`` into captures/<kind>-<stamp>.mcap.

    ``device`` is a port, or "sim" for a virtual rig with the recipe's specimen, in virtual time
    unless ``realtime``; each of its recordings of one ``seed`` has another noise. ``baud`` takes
    the place of the recipe's rate. ``hand`` (cuts only): motors off, a person or the virtual hand
    moves the handles. ``designed`` takes the list that is worth most now (True) or the recipe's
    (False); by default as the recipe's capture.plan says. ``until`` chooses each stroke by what was
    recorded before it, until the scene's tolerance is reached. ``confirm`` asks a person to load
    material; a virtual rig loads by itself. A rig without a probe that counts is probed first
    (`ensure_probed`), and ``say`` tells so; the blades are then cleared once for both. A hand's
    capture needs none. Whatever was recorded
    before an error stays in the file.

    Raises InputError where the scene needs no such capture or it would take longer than 4 hours (24
    where ``long`` says that this is meant), MissingError where one until the
    tolerance lacks a fit that it builds on, and what the capture itself raises.
    """
    from scissorcal.device.capture import capture_cut, capture_friction, open_writer
    from scissorcal.workday.engine import Engine

    recipe = workspace.recipe()
    if not requirements(recipe).needs_capture(kind):
        raise InputError(f"{workspace.recipe_path}: this scene needs no capture of {kind}.")
    if until is not None and hand:
        raise InputError(
            "--until-tolerance drives the strokes that are worth most: a hand cannot be told so. "
            "Leave out --hand."
        )
    earlier = _earlier(Engine.of(workspace), kind) if until is not None else None
    if not hand:
        _refuse_long(workspace, recipe, kind, long)
    text = read_text(workspace.recipe_path)
    design = not hand and (recipe.capture.designed(kind) if designed is None else designed)
    line = line_of(recipe, baud)
    run = len(workspace.recordings(kind))
    with open_rig(device, recipe.specimen, seed, run=run, realtime=realtime, line=line) as link:
        cleared = False
        if hand:
            probe = last_probe(workspace, link)
        else:
            once = _Once(confirm) if confirm else None
            probe = ensure_probed(workspace, link, recipe, confirm=once, then=THEN, say=say)
            cleared = once is not None and once.asked
        if until is not None and earlier is not None:
            return _capture_until(
                workspace,
                kind,
                link,
                until,
                earlier,
                progress=progress,
                confirm=confirm,
                probe=probe,
                cleared=cleared,
            )
        if design:
            recipe, sentence = designed_for(workspace, kind, link.identity)
            text = with_designed_captures(recipe, text)
            recipe = parse_recipe(text, str(workspace.recipe_path), judged=False)
            if say is not None:
                say(sentence)
        if kind == "friction":
            usable, too_slow = with_usable_sweeps(recipe, link.identity, probe)
            if too_slow:
                text = with_designed_captures(usable, text)
                recipe = parse_recipe(text, str(workspace.recipe_path), judged=False)
                if say is not None:
                    say(too_slow)
        path = workspace.new_recording(kind)
        with open_writer(path, kind, link, recipe, text, hand=hand, probe=probe) as writer:
            if kind == "friction":
                report = capture_friction(
                    link, recipe, writer, progress, confirm=confirm, probe=probe, cleared=cleared
                )
            else:
                report = capture_cut(link, recipe, writer, hand, progress, confirm, probe, cleared)
        return Captured(path, report, f"{link.identity.name} {link.identity.serial}")


def capture_advance_into(
    workspace: Workspace,
    device: str,
    *,
    seed: int = 0,
    baud: int | None = None,
    realtime: bool = False,
    long: bool = False,
    progress: "CaptureProgress | None" = None,
    confirm: "Confirm | None" = None,
    say: "Say | None" = None,
) -> Captured:
    """Record empty motion of the sledge into captures/friction-advance-<stamp>.mcap.

    As `capture_into`; it may be done for any scene. Raises InputError for a rig without an advance
    motor or without travel, before anything moves.
    """
    from scissorcal.device.advance_trajectory import advance_plan, refuse_without_motor
    from scissorcal.device.capture import capture_friction_advance, open_writer

    recipe = workspace.recipe()
    _refuse_long(workspace, recipe, ADVANCE, long)
    text = read_text(workspace.recipe_path)
    line = line_of(recipe, baud)
    run = len(workspace.recordings(ADVANCE))
    with open_rig(device, recipe.specimen, seed, run=run, realtime=realtime, line=line) as link:
        refuse_without_motor(link.identity)
        advance_plan(recipe, link.identity)
        once = _Once(confirm) if confirm else None
        probe = ensure_probed(workspace, link, recipe, confirm=once, then=THEN, say=say)
        too_slow = sliding_below_encoder(recipe, link.identity)
        if too_slow and say is not None:
            say(too_slow)
        path = workspace.new_recording(ADVANCE)
        with open_writer(path, ADVANCE, link, recipe, text, probe=probe) as writer:
            report = capture_friction_advance(
                link,
                recipe,
                writer,
                progress,
                confirm=confirm,
                probe=probe,
                cleared=once is not None and once.asked,
            )
    return Captured(path, report, f"{link.identity.name} {link.identity.serial}")


def _refuse_long(workspace: Workspace, recipe: "Recipe", kind: CaptureKind, meant: bool) -> None:
    """Raise InputError before anything moves where a capture costs more than anybody means."""
    refuse_long(capture_cost(recipe, kind), shutil.disk_usage(workspace.root).free, meant=meant)


def _capture_until(
    workspace: Workspace,
    kind: DesignedKind,
    link: "Link",
    until: Until,
    earlier: "Earlier",
    *,
    progress: "CaptureProgress | None",
    confirm: "Confirm | None",
    probe: "ProbeResult | None",
    cleared: bool,
) -> Captured:
    """Record strokes until the band of the torque is within the scene's tolerance.

    After each stroke the recording gets a mark with how far it is: the last one of an interrupted
    capture shows that the tolerance was not reached.
    """
    from scissorcal.device.capture import open_writer
    from scissorcal.device.capture_by_parts import capture_by_parts
    from scissorcal.device.cut_trajectory import cut_plan
    from scissorcal.device.trajectory import friction_plan
    from scissorcal.recording.until import UNTIL_MARK
    from scissorcal.workday.stock import seconds_at_rig
    from scissorcal.workday.until import Limits, UntilTolerance

    recipe = workspace.recipe()
    plan = (friction_plan if kind == "friction" else cut_plan)(recipe, link.identity)
    listed_min = seconds_at_rig(recipe, plan) / 60.0
    minutes = listed_min if until.max_minutes is None else until.max_minutes
    limits = Limits(minutes, until.at_least)
    slowest = sweep_bounds(recipe, link.identity, probe)[1] if kind == "friction" else 0.0
    choice = UntilTolerance(kind, recipe, link.identity, earlier, limits, slowest_sweep=slowest)
    path = workspace.new_recording(kind)
    text = read_text(workspace.recipe_path)
    with open_writer(path, kind, link, recipe, text, by_parts=True, probe=probe) as writer:

        def chosen() -> None:
            if choice.marks:
                writer.mark(UNTIL_MARK, choice.marks[-1].as_text())
                if until.tell is not None:
                    until.tell(choice.marks[-1])

        report = capture_by_parts(
            link,
            choice.recipe,
            kind,
            writer,
            choice,
            longest_s=60.0 * minutes,
            chosen=chosen,
            progress=progress,
            confirm=confirm,
            probe=probe,
            cleared=cleared,
        )
        writer.note(choice.marks[-1].sentence)
    rig = f"{link.identity.name} {link.identity.serial}"
    return Captured(path, report, rig, choice.marks[-1])


def _earlier(engine: "Engine", kind: DesignedKind) -> "Earlier":
    """The fits that are current and their recordings; a cut needs the fit of friction."""
    from scissorcal.calibration.design.state import fitted_cut
    from scissorcal.workday.recordings import used_recordings
    from scissorcal.workday.runs.cut import edge_of_photographs
    from scissorcal.workday.runs.fit import available, load_result
    from scissorcal.workday.until import Earlier

    def used(what: DesignedKind) -> "tuple[Recording, ...]":
        there = any(row.use == "used" for row in engine.recordings(what))
        found = used_recordings(engine.workspace, engine.recipe, what, engine.index)
        return found if there else ()

    there = available(engine, ("friction", "cut", "blade"))
    edge = edge_of_photographs(engine)[0] if kind == "cut" or "blade" in there else None
    swept = used("friction")
    if kind == "cut":
        friction = load_result(engine, "friction")
        law = load_result(engine, "cut").rung if "cut" in there else None
        return Earlier(swept, used("cut"), friction, edge=edge, last_law=law)
    friction = load_result(engine, "friction") if "friction" in there else None
    cut = None
    if friction is not None and "cut" in there:
        cuts = used("cut")
        cut = fitted_cut(cuts, engine.recipe, friction, load_result(engine, "cut"), edge)
    return Earlier(swept, (), friction, cut, edge)


class _Once:
    """Asks a person to clear the blades before a probe, and for the capture that follows."""

    def __init__(self, confirm: "Confirm") -> None:
        self._confirm = confirm
        self.asked = False

    def __call__(self, request: str) -> None:
        self._confirm(request)
        self.asked = True
