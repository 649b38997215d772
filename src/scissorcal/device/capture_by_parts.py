"""Capture strokes that are chosen while it runs, each from all that was recorded before it."""

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager

import numpy as np
from numpy.typing import NDArray

from scissorcal.device.capture import (
    CLEAR_REQUEST,
    CaptureReport,
    finish,
    gains_for,
    motion_for,
)
from scissorcal.device.coverage import CoverageGrid, coverage_of
from scissorcal.device.drive import Drive
from scissorcal.device.link import Link
from scissorcal.device.loading import Loader
from scissorcal.device.lockstep_motion import Exchanging
from scissorcal.device.motion import Motion
from scissorcal.device.parts import Part
from scissorcal.device.recorder import Recorder
from scissorcal.device.rig_record import rig_facts
from scissorcal.device.session import RigSession
from scissorcal.device.trajectory import friction_plan
from scissorcal.recipe.requirements import DesignedKind
from scissorcal.recording import Joint, Recording, RecordingWriter, Stroke
from scissorcal.recording.recording import UNLOADED_MARK

NextPart = Callable[[Recording, float], Part | None]
"""Chooses what comes next from what was recorded so far and where the carriage stands (m); None
ends the capture. It runs in a second thread while the rig idles, in virtual time between
two ticks."""

CHOOSING_S = 1.0
"""Least time with the motors off between two parts: the zeros of the sensors are measured anew. In
virtual time the choice takes exactly so long."""
CHOOSING = "motors off, the fit is brought up to date"


def capture_by_parts(
    session: RigSession,
    kind: DesignedKind,
    writer: RecordingWriter,
    next_part: NextPart,
    *,
    longest_s: float,
    chosen: Callable[[], None] | None = None,
) -> CaptureReport:
    """Drive one part after the other until ``next_part`` has none.

    Between two parts the motors are off, the blades rest open, and samples are recorded while
    ``next_part`` works; the material stays where it is unless the next part asks for a fresh piece.
    ``chosen`` is called after each choice, in this thread, between the samples before and after.
    ``longest_s`` bounds the capture, for the faults that it may clear. ``writer`` was opened
    without strokes. Raises as `capture` does, and what ``next_part`` raises; whatever was
    recorded stays in the writer.
    """
    recipe, identity, operator = session.recipe, session.identity, session.operator
    recorder = _KeepingRecorder(writer, coverage_of(recipe, identity, kind))
    gains = gains_for(session, kind, writer)
    plan = friction_plan(recipe, identity)
    with motion_for(session, plan, gains, duration_s=longest_s) as motion:
        loader = Loader(motion, recorder, operator.confirm)
        if not session.cleared:
            loader.clear(CLEAR_REQUEST if kind == "cut" else plan.segments[0].request)
        strokes: list[Stroke] = []
        drive = Drive(motion, recorder, strokes, operator.progress, 1, cuts=kind == "cut")
        facts = rig_facts(identity, recipe.rig.motor_sign, session.probe)

        def recorded() -> Recording:
            return Recording(
                kind=kind,
                samples=recorder.samples,
                strokes=tuple(strokes),
                joint=Joint(recipe.rig.joint),
                handle_radius_m=identity.handle_radius,
                device=facts,
                source=str(writer.path),
                marks=tuple((UNLOADED_MARK, str(stroke.index)) for stroke in recorder.empty),
            )

        drive.idle()
        notify = chosen or (lambda: None)
        with _chooser(session.link, motion, drive) as choose:
            while True:
                part = choose(next_part, recorded())
                notify()
                if part is None:
                    break
                strokes += part.strokes
                writer.state_strokes(tuple(strokes))
                drive.expect(len(part.segment.reference) + round(part.then_s / motion.tick_s))
                if part.fresh:
                    loader.retract()
                    drive.go_to_start(part.segment)
                    loader.load(drive.warning() + part.segment.request)
                drive.follow(part.segment)
        drive.idle()
        return finish(recorder, motion)


class _KeepingRecorder(Recorder):
    """A recorder that keeps the samples, so that they can be fitted while the capture runs."""

    def __init__(self, writer: RecordingWriter, coverage: CoverageGrid) -> None:
        super().__init__(writer, coverage)
        self._blocks: list[NDArray[np.void]] = []

    def take(self, samples: NDArray[np.void], garbled: int = 0) -> None:
        super().take(samples, garbled)
        if len(samples):
            self._blocks.append(samples.copy())

    @property
    def samples(self) -> NDArray[np.void]:
        """All samples so far, (N,)."""
        return np.concatenate(self._blocks)


_Choose = Callable[[NextPart, Recording], Part | None]


@contextmanager
def _chooser(link: Link, motion: Motion, drive: Drive) -> Iterator[_Choose]:
    """How the next part is chosen while the rig idles; a choice that is not over is left behind."""
    if isinstance(link, Exchanging):

        def at_once(next_part: NextPart, recording: Recording) -> Part | None:
            part = next_part(recording, motion.position[1])
            drive.idle(CHOOSING_S, CHOOSING)
            return part

        yield at_once
        return
    pool = ThreadPoolExecutor(1)

    def meanwhile(next_part: NextPart, recording: Recording) -> Part | None:
        chosen = pool.submit(next_part, recording, motion.position[1])
        drive.idle(CHOOSING_S, CHOOSING)
        while not chosen.done():
            drive.idle(0.1, CHOOSING)
        return chosen.result()

    try:
        yield meanwhile
    finally:
        pool.shutdown(wait=False, cancel_futures=True)
