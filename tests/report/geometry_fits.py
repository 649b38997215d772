"""Made-up fits of photographs, with pictures of noise: nothing here is fitted."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from scissorcal.calibration import (
    Band,
    BladeFit,
    BladeResult,
    CameraFit,
    CrossValidation,
    EdgeCandidate,
    FoundNick,
    PhotographRow,
    PixelMap,
    PlateFit,
    PoseHalves,
    PoseView,
    ViewError,
)
from scissorcal.model import Edge, EdgeDistribution
from scissorcal.report import Geometry
from scissorcal.verdicts import Verdict
from scissorcal.vision import Camera, Pose

CAMERA_SD = np.array([0.5, 0.5, 0.4, 0.4, 1e-3, 3e-3, 1e-4, 1e-4, 0.0])


def camera_fit() -> CameraFit:
    """Three views, the second of which stands out."""
    x, y = np.linspace(0.0, 1279.0, 7), np.linspace(0.0, 719.0, 5)
    off = np.hypot(x[None, :] - 640.0, y[:, None] - 360.0) / 700.0
    inside = off < 0.6
    return CameraFit(
        camera=Camera(
            1200.0,
            1201.0,
            640.2,
            359.1,
            (-0.1, 0.02, 1e-4, -2e-4, 0.0),
            1280,
            720,
            np.diag(CAMERA_SD**2),
        ),
        origin="fitted",
        board="camera board",
        candidate="k1, k2, p1, p2",
        candidates=(_candidate("k1", behind=9.0), _candidate("k1, k2, p1, p2", chosen=True)),
        draws=np.zeros((4, 9)),
        views=(_view("board-1.jpg", 0.11), _view("board-2.jpg", 0.52), _view("board-3.jpg", 0.09)),
        bulge_mm=(0.2, 0.0),
        noise_px=0.08,
        stretch=1.3,
        region=np.array([[200.0, 100.0], [1000.0, 110.0], [990.0, 600.0], [210.0, 610.0]]),
        region_share=0.43,
        pixel_map=PixelMap(x, y, 0.02 + off**2, inside, np.where(off < 1.0, off, np.nan)),
        cross=CrossValidation(0.2, 0.17, 0.31),
        verdicts=(
            Verdict("fit.camera", "corners", "fail", 190.0, 200.0, "190 corners; 200 are wanted."),
        ),
        inputs_hash="c0ffee",
        sources=("board-1.jpg", "board-2.jpg", "board-3.jpg"),
    )


def imported_camera() -> CameraFit:
    """A camera of eight distortion numbers, of which nobody says how well it is known."""
    fit = camera_fit()
    camera = replace(fit.camera, distortion=(0.1,) * 8, covariance=None)
    nan = float("nan")
    return replace(
        fit,
        camera=camera,
        origin="imported",
        candidates=(),
        views=(),
        noise_px=nan,
        stretch=nan,
        region=np.empty((0, 2)),
        pixel_map=None,
        cross=None,
    )


def blade_result(*, metric: bool = True, nicked: bool = True) -> BladeResult:
    """One arc with a nick, as two photographs show it."""
    edge = Edge("arc", -0.008, 0.035, 0.075, curvature_per_m=-0.4)
    names = ("offset_m", "taper_rad", "curvature_per_m")
    sd = np.array([2e-5, 3e-4, 0.02])
    station = np.linspace(0.01, 0.07, 21)
    offset = edge.offset_at(station)
    fit = BladeFit(
        name="blade",
        edge_posterior=EdgeDistribution(edge, names, np.diag(sd**2)),
        draws=np.zeros((4, 3)),
        candidates=(
            EdgeCandidate("line", 90.0, False, 1.4, 9e-6, 1e-3, 2e-6),
            EdgeCandidate("arc", 104.0, True, 1.2, 1e-6, 1e-3, 2e-6),
        ),
        station=station,
        offset=_band(offset, 2e-5),
        taper=_band(np.arctan(edge.slope_at(station)), 3e-4),
        nicks=(FoundNick(0.0421, 0.0012, 0.00031, "blade-1.jpg, blade-2.jpg"),) if nicked else (),
        photographs=(
            _photograph("blade-1.jpg", 3e-6, station),
            _photograph("blade-2.jpg", -9e-6, station),
        ),
        length_sd=4e-5,
        pivot_sd=2e-6,
        metric=metric,
        opening=np.array([0.2, 0.5]) if metric else np.empty(0),
        contact=np.array([0.02, 0.04, 0.06]) if metric else np.empty(0),
        height=_band(np.arange(6.0).reshape(2, 3) * 1e-3, 2.5e-5) if metric else None,
        verdicts=(Verdict("fit.blade", "clear edge", "pass", 0.01, 0.15, "The edge is clear."),),
        notes=("The mat was seen.", "The centreline halves the blade."),
    )
    return BladeResult((fit,), (), "b1ade", ("blade-1.jpg", "blade-2.jpg"))


def plate_fit() -> PlateFit:
    """Two photographs, in the rig's frame too; a second pose at odds of forty to one."""
    sd = np.array([1e-3, 1e-3, 2e-3, 1e-4, 1e-4, 4e-4])
    pose = Pose.from_rotation_vector([2.6, 0.1, 0.0], [0.01, -0.02, 0.4], np.diag(sd**2))
    return PlateFit(
        target="plate board",
        camera_plate=pose,
        other=Pose.from_rotation_vector([-2.6, 0.1, 0.0], [0.01, -0.02, 0.41]),
        odds=40.0,
        ambiguity=3.2,
        rig_plate=Pose.from_rotation_vector([0.0, 0.0, 0.1], [0.08, 0.0, 0.001], np.diag(sd**2)),
        views=(
            PoseView("plate-1.jpg", 24, 24, 0.06, 0.055, 60.0, 0.41, 40.0, 3.1, 0.01, 0.02),
            PoseView("plate-2.jpg", 24, 20, 0.30, 0.06, 60.0, 0.41, 40.0, float("inf"), 0.4, 0.9),
        ),
        halves=PoseHalves(0.05, 0.07, 6.1),
        rms_px=0.07,
        noise_px=0.05,
        verdicts=(Verdict("fit.plate", "at rest", "not_evaluated", None, 3.0, "Take several."),),
        inputs_hash="97a7e",
        sources=("plate-1.jpg", "plate-2.jpg"),
    )


def geometry(folder: Path, size: tuple[int, int] = (320, 240)) -> Geometry:
    """All three fits, with pictures of noise below ``folder``."""
    names = {
        "camera": ("residuals", "uncertainty", "worst-1-001-board-2", "worst-2-002-board-1"),
        "blade": ("001-blade-1", "002-blade-2"),
        "plate": ("001-plate-1", "002-plate-2"),
    }
    drawn = {
        kind: tuple(noise(folder / kind / f"{stem}.png", size) for stem in stems)
        for kind, stems in names.items()
    }
    return Geometry(
        camera_fit(),
        blade_result(),
        plate_fit(),
        {"camera": drawn["camera"], "blade": drawn["blade"], "plate": drawn["plate"]},
        {"camera": "11", "blade": "22", "plate": "33"},
    )


def noise(path: Path, size: tuple[int, int]) -> Path:
    """A picture that no compression makes small."""
    path.parent.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(len(path.stem))
    image = rng.integers(0, 255, (size[1], size[0], 3), dtype=np.uint8)
    path.write_bytes(cv2.imencode(".png", image, [cv2.IMWRITE_PNG_COMPRESSION, 0])[1].tobytes())
    return path


def _candidate(name: str, *, behind: float = 0.0, chosen: bool = False) -> dict[str, object]:
    return {
        "name": name,
        "free": 6,
        "unseen_px": 0.1,
        "behind": behind,
        "behind_se": 0.4 * behind,
        "equivalent": chosen,
        "chosen": chosen,
    }


def _view(name: str, rms: float) -> ViewError:
    return ViewError(name, 48, rms, 3 * rms, 55.0, 0.4, 22.0, rms > 0.3, (0.0,) * 6)


def _photograph(name: str, away: float, station: np.ndarray) -> PhotographRow:
    points = tuple(station.tolist())
    left = tuple((away + 4e-6 * np.sin(400.0 * station)).tolist())
    seen = "The mat was seen."
    return PhotographRow(name, 300, 0.8, 0.98, 0.02, 0.075, away, 5e-6, seen, points, left)


def _band(mean: np.ndarray, sd: float) -> Band:
    return Band(mean, np.full_like(mean, sd), mean - 1.645 * sd, mean + 1.645 * sd)
