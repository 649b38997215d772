"""A track in a recording: samples, pictures and estimates, as they come; and read back."""

import json
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.errors import InputError
from scissorcal.foreign import parse_json, reading
from scissorcal.foreign.formats import RECORDING
from scissorcal.recipe.priors import PlatePriors
from scissorcal.recording import (
    Joint,
    RecordingFacts,
    RecordingWriter,
    read_recording,
    read_telemetry,
)
from scissorcal.recording.layout import (
    FRAME,
    OUTCOMES,
    PICTURE,
    PICTURE_STATES,
    POSE,
    SOURCES,
    STATES,
    frame_rows,
)
from scissorcal.tracking.follow import FollowedRow
from scissorcal.vision.geometry.camera import Camera
from scissorcal.vision.geometry.pose import Pose
from scissorcal.vision.geometry.rig_frame import PicturePose, RigPose, locate_plate
from scissorcal.vision.live import Frame, LocatedFrame, State, located_frames
from scissorcal.vision.targets.boards import PLATE_BOARD, PLATE_STRIP

TARGETS = ("", PLATE_BOARD.name, PLATE_STRIP.name)
"""Names of targets, in the order of their numbers in a recording."""


@dataclass(frozen=True, eq=False)
class TrackPicture:
    """One picture: its number, times and state, and the plate's pose in it, if there is one.

    ``stamp_s`` is by the camera's clock, NaN where it states none; ``arrived_s`` by the host's;
    ``done`` is the share of all pictures that are passed, NaN where it is unknown.
    """

    number: int
    stamp_s: float
    arrived_s: float
    state: State
    corners: int
    target: str = ""
    odds: float = math.nan
    rms_px: float = math.nan
    seen: PicturePose | None = None
    done: float = math.nan


@dataclass(frozen=True, eq=False)
class PoseFinder:
    """What turns a camera's pictures into poses of the plate.

    ``plate_target`` is T_plate_target; ``rig`` takes poses into the rig's frame, None where that is
    not known.
    """

    camera: Camera
    plate_target: Pose
    rig: RigPose | None
    priors: PlatePriors

    def locate(self, frames: Iterable[Frame]) -> Iterator[LocatedFrame]:
        """Find the plate's target in every picture."""
        return located_frames(frames, (PLATE_BOARD, PLATE_STRIP), self.camera, self.priors)

    def picture(self, located: LocatedFrame) -> TrackPicture:
        """The picture as a track takes it; a video's arrives when it is stamped."""
        frame, pose, target = located.frame, located.pose, self.plate_target
        live = not math.isnan(frame.arrived_s)
        return TrackPicture(
            number=frame.number,
            stamp_s=frame.stamp_s if live else frame.time_s,
            arrived_s=frame.arrived_s if live else frame.time_s,
            state=located.state,
            corners=located.corners,
            target=located.board.name if located.board else "",
            odds=min(pose.odds, 1e12) if pose and pose.other else math.nan,
            rms_px=pose.rms_px if pose else math.nan,
            seen=locate_plate(pose, self.camera, target, self.rig) if pose else None,
            done=frame.number / frame.count if frame.count else math.nan,
        )


TRACK_MARK = "track"


@dataclass(frozen=True)
class TrackAbout:
    """What a track is of, as its recording states it in the mark "track".

    ``frame`` is the one that poses map the plate's frame into; ``shared`` (6, 6) the covariance of
    what all pictures share.
    """

    source: str
    frame: Literal["rig", "camera"]
    camera_inputs_hash: str
    width: int
    height: int
    camera_delay_ms: float
    shared: tuple[tuple[float, ...], ...] | None = None


class TrackChannels:
    """Writes what a camera showed and what the filter knew into a recording that others keep too.

    ``base_ns`` is the computer's clock at 0 s of the times that rows are given with.
    """

    def __init__(self, writer: RecordingWriter, base_ns: int) -> None:
        self._writer = writer
        self._base_ns = base_ns
        self._rows = 0
        self._frame = "camera"

    def about(self, facts: TrackAbout) -> None:
        """State what the track is of; before the first estimate."""
        self._frame = facts.frame
        self._writer.mark(TRACK_MARK, json.dumps(asdict(facts)))

    def samples(self, samples: NDArray[np.void]) -> None:
        """Samples of the rig are recorded by the run itself."""

    def picture(self, picture: TrackPicture, time_s: float) -> None:
        """Add a picture, exposed at ``time_s`` of the filter's clock."""
        row = np.zeros(1, dtype=PICTURE.dtype)
        row["sequence"], row["corners"] = picture.number, picture.corners
        row["state"] = PICTURE_STATES.index(picture.state)
        row["target"] = TARGETS.index(picture.target)
        row["camera_time_s"], row["time_s"] = picture.stamp_s, time_s
        row["odds"], row["rms_px"] = picture.odds, picture.rms_px
        for name in ("quaternion", "translation", "noise", "other_quaternion", "other_translation"):
            row[name] = np.nan
        if picture.seen is not None:
            pose = picture.seen
            row["quaternion"], row["translation"] = pose.pose.quaternion, pose.pose.translation_m
            row["noise"] = pose.noise.ravel()
            if pose.other is not None:
                row["other_quaternion"] = pose.other.quaternion
                row["other_translation"] = pose.other.translation_m
        self._writer.append_telemetry(PICTURE, row, self._times(picture.arrived_s))

    def estimate(self, followed: FollowedRow, host_s: float) -> None:
        """Add what the filter knows after a row that came at ``host_s``; nothing without a pose."""
        estimate = followed.estimate
        if estimate is None:
            return
        row = np.zeros(1, dtype=POSE.dtype)
        row["sequence"] = self._rows
        row["source"] = SOURCES.index(followed.source)
        row["outcome"] = OUTCOMES.index(followed.outcome.name.lower().replace("_", " "))
        row["state"] = STATES.index(followed.state)
        row["time_s"], row["row_time_s"] = estimate.time_s, followed.time_s
        pose = Pose.from_matrix(estimate.rotation, estimate.place_m)
        row["quaternion"], row["translation"] = pose.quaternion, pose.translation_m
        row["covariance"], row["rates"] = estimate.covariance.ravel(), estimate.rates
        row["nis"], row["contact_offset"] = followed.nis, estimate.contact_offset_m
        row["compliance"] = estimate.compliance_m_per_N
        row["compliance_sd"] = estimate.compliance_sd_m_per_N
        row["contact_point"], row["contact_force"] = np.nan, np.nan
        if followed.contact is not None:
            row["contact_point"] = followed.contact.point_m
            row["contact_force"] = followed.contact.force_N
        times = self._times(host_s)
        self._writer.append_telemetry(POSE, row, times)
        self._writer.append_telemetry(FRAME, frame_rows(self._frame, row, times), times)
        self._rows += 1

    def note(self, sentence: str) -> None:
        """Add a sentence."""
        self._writer.note(sentence)

    @property
    def estimates(self) -> int:
        """Rows of the pose so far."""
        return self._rows

    def _times(self, host_s: float) -> NDArray[np.int64]:
        return np.array([self._base_ns + round(1e9 * host_s)], dtype=np.int64)


class TrackRecorder(TrackChannels):
    """Writes what a track was given and what it found into captures/track-<stamp>.mcap."""

    def __init__(
        self, path: Path, recipe_toml: str, device: Mapping[str, Any], radius_m: float, base_ns: int
    ) -> None:
        self.path = path
        joint = Joint("rotary")
        writer = RecordingWriter(
            path,
            "track",
            joint,
            facts=RecordingFacts(recipe_toml=recipe_toml, device=device, handle_radius_m=radius_m),
        )
        super().__init__(writer, base_ns)

    def samples(self, samples: NDArray[np.void]) -> None:
        """Add samples of the rig."""
        self._writer.append(samples)

    def close(self, *, keep: bool, note: str = "") -> Path | None:
        """Finish the file, with a last sentence; with ``keep`` False it is removed."""
        if note:
            self._writer.note(note)
        path = self._writer.close()
        if keep:
            return path
        path.unlink()
        return None


@dataclass(frozen=True, eq=False)
class RecordedTrack:
    """What a track was given: its pictures, the rig's samples (none without a rig), and facts."""

    about: TrackAbout
    pictures: tuple[TrackPicture, ...]
    samples: NDArray[np.void]
    device: Mapping[str, Any]
    handle_radius_m: float
    base_ns: int


def read_track(path: Path) -> RecordedTrack:
    """Read what a track was given, to follow it again with other settings.

    A rendering's or control's recording has pictures too, but not the taps before it, and not when
    contacts counted. Raises InputError where the file is no track, and what `read_recording` does.
    """
    recording = read_recording(path)
    if recording.kind != "track":
        raise InputError(
            f"{path} is not the recording of a track but of '{recording.kind}', so it has not "
            "all that a pose followed from: name one that 'scissorcal track' wrote "
            "(captures/track-*.mcap)."
        )
    stated = [value for name, value in recording.marks if name == TRACK_MARK]
    rows = read_telemetry(path, PICTURE)
    if not stated:
        raise InputError(f"{path} ended before the track had a pose: name another track.")
    with reading(path, RECORDING):
        facts = parse_json(stated[-1], str(path), RECORDING.remedy)
        shared = facts["shared"]
        about = TrackAbout(**{**facts, "shared": tuple(map(tuple, shared)) if shared else None})
    times = [*rows["host_time_ns"][:1].tolist(), *recording.samples["host_time_ns"][:1].tolist()]
    base = min(times, default=0)
    common = np.zeros((6, 6)) if about.shared is None else np.array(about.shared)
    return RecordedTrack(
        about,
        tuple(_picture(row, base, common, len(rows)) for row in rows),
        recording.samples,
        recording.device,
        recording.handle_radius_m,
        base,
    )


def _picture(row: np.void, base_ns: int, shared: Array, count: int) -> TrackPicture:
    in_picture = None
    if np.isfinite(row["quaternion"]).all():
        noise = row["noise"].reshape(6, 6)
        pose = Pose(tuple(row["quaternion"].tolist()), tuple(row["translation"].tolist()))
        other = None
        if np.isfinite(row["other_quaternion"]).all():
            turned = tuple(row["other_quaternion"].tolist())
            other = Pose(turned, tuple(row["other_translation"].tolist()))
        in_picture = PicturePose(
            Pose(pose.quaternion, pose.translation_m, noise + shared), other, noise, shared
        )
    number = int(row["sequence"])
    return TrackPicture(
        number=number,
        stamp_s=float(row["camera_time_s"]),
        arrived_s=1e-9 * (int(row["host_time_ns"]) - base_ns),
        state=PICTURE_STATES[int(row["state"])],  # type: ignore[arg-type]
        corners=int(row["corners"]),
        target=TARGETS[int(row["target"])],
        odds=float(row["odds"]),
        rms_px=float(row["rms_px"]),
        seen=in_picture,
        done=number / max(count, 1),
    )
