"""Captures by hand: the motors are off, a person (or the virtual hand) moves the blades."""

from itertools import cycle

import numpy as np
from numpy.typing import NDArray

from scissorcal.device.cut_trajectory import cut_plan, hand_requests, press_openings
from scissorcal.device.motion import Motion, Samples
from scissorcal.device.recorder import Recorder
from scissorcal.device.session import Loader, ShowProgress
from scissorcal.device.trajectory import opening_range
from scissorcal.errors import DeviceError
from scissorcal.kernel import Capability, ConfigKey, Identity
from scissorcal.recipe.schema import Recipe
from scissorcal.recording import label_strokes

CUT_TRAVEL_SHARE = 0.2
PRESS_TRAVEL_SHARE = 0.4

LOOK_EVERY_S = 0.2
THINNED_S = 0.01
SETTLED_S = 0.4
GIVE_UP_S = 60.0
GIVE_UP_SIMULATED_S = 4.0


def hand_strokes(
    motion: Motion, recipe: Recipe, recorder: Recorder, loader: Loader, tell: ShowProgress
) -> None:
    """Record the strokes that a hand makes through each sheet.

    A sheet is finished once its strokes are made and the blades are open again, or after a minute
    without motion (which becomes a note). Raises DeviceError where the rig fails, or has no
    sensor for the force of the hand.
    """
    if not motion.identity.capabilities & Capability.HANDLE_FORCE_SENSOR:
        raise DeviceError(
            f"The device {motion.identity.name} does not measure the force on its handles, so a "
            "capture by hand cannot measure what drives the blades: capture without --hand."
        )
    watch = _Watch(motion, recipe, recorder, tell)
    speeds = cycle(recipe.capture.cut.speeds_rad_per_s)
    for sheet, request in enumerate(hand_requests(recipe)):
        if loader.simulated:
            _bring_back(motion, recipe, recorder, loader)
        loader.load(request)
        recorder.writer.mark_sheet(sheet)
        watch.begin(sheet)
        if not loader.simulated:
            watch.until(recipe.capture.cut.strokes_per_sheet, GIVE_UP_S)
            continue
        for number in range(recipe.capture.cut.strokes_per_sheet):
            speed = next(speeds)
            motion.configure(ConfigKey.HAND_STROKES, 1.0)
            motion.configure(ConfigKey.HAND_SPEED_rad_per_s, speed)
            if not watch.until(number + 1, GIVE_UP_SIMULATED_S + watch.travel / speed):
                break
        motion.configure(ConfigKey.HAND_SPEED_rad_per_s, 0.0)


def hand_travel(recipe: Recipe, identity: Identity) -> float:
    """Least travel (rad) that counts as a stroke by hand: well above tremor, below a stroke."""
    low, high = opening_range(recipe, identity)
    if recipe.scene.cut:
        return CUT_TRAVEL_SHARE * (high - low)
    openings = press_openings(recipe, identity)
    return PRESS_TRAVEL_SHARE * min(top - bottom for bottom, top in openings)


class _Watch:
    """Records samples and counts the strokes of the current sheet."""

    def __init__(
        self, motion: Motion, recipe: Recipe, recorder: Recorder, tell: ShowProgress
    ) -> None:
        self._motion = motion
        self._recorder = recorder
        self._tell = tell
        self.travel = hand_travel(recipe, motion.identity)
        self._wanted = recipe.capture.cut.strokes_per_sheet
        self._sheets = recipe.capture.cut.sheets
        self._sheet = 0
        self._time: list[NDArray[np.float64]] = []
        self._opening: list[NDArray[np.float64]] = []

    def begin(self, sheet: int) -> None:
        """Restart the count: a fresh sheet is between the blades."""
        self._sheet = sheet
        self._time, self._opening = [], []

    def until(self, strokes: int, give_up_s: float) -> bool:
        """Record until ``strokes`` of this sheet are made; False if nothing moved for too long."""
        stride = max(1, round(THINNED_S / self._motion.tick_s))
        while True:
            for samples in self._motion.idle(LOOK_EVERY_S):
                self._take(samples, stride)
            time, opening = np.concatenate(self._time), np.concatenate(self._opening)
            made = self._made(time, opening)
            done = (self._sheet + min(made / self._wanted, 1.0)) / self._sheets
            sentence = f"{made} of {self._wanted} strokes, piece {self._sheet + 1}"
            self._tell(done, sentence, self._recorder)
            rest = _rest_s(time, opening, 0.1 * self.travel)
            if made >= strokes and rest >= SETTLED_S and not self._closed(opening):
                return True
            if rest >= give_up_s:
                self._recorder.writer.note(
                    f"Piece {self._sheet + 1} was left after {made} of {self._wanted} strokes: "
                    f"no motion for {give_up_s:g} s."
                )
                return False

    def _take(self, samples: Samples, stride: int) -> None:
        self._recorder.take(samples, self._motion.garbled, self._motion.fault_cause)
        self._time.append(samples["device_time_us"][::stride] * 1e-6)
        self._opening.append(samples["opening"][::stride])

    def _made(self, time: NDArray[np.float64], opening: NDArray[np.float64]) -> int:
        """Closing strokes so far, including the current one."""
        if len(time) == 0:
            return 0
        strokes = label_strokes(opening, time, self.travel).strokes
        return sum(stroke.kind == "closing" for stroke in strokes)

    def _closed(self, opening: NDArray[np.float64]) -> bool:
        """Whether the blades are still closed."""
        return float(opening[-1]) < float(opening.min()) + 0.5 * self.travel


def _bring_back(motion: Motion, recipe: Recipe, recorder: Recorder, loader: Loader) -> None:
    """Move a simulator back to where the next sheet is loaded, as a person would."""
    motion.configure(ConfigKey.HAND_SPEED_rad_per_s, 0.0)
    loader.retract()
    recorder.writer.mark_sheet(-1)
    start = cut_plan(recipe, motion.identity).segments[0].reference.head()
    for samples in motion.track(start):
        recorder.take(samples, motion.garbled, motion.fault_cause)


def _rest_s(time: NDArray[np.float64], opening: NDArray[np.float64], within: float) -> float:
    """Seconds for which the opening has stayed within a band around its last value."""
    if len(time) == 0:
        return 0.0
    away = np.flatnonzero(np.abs(opening - opening[-1]) > within)
    since = away[-1] if len(away) else 0
    return float(time[-1] - time[since])
