"""What a blade fit results in: the edge with its covariance, bands along it, nicks, verdicts."""

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.result import Result, Stored, by_name
from scissorcal.errors import InputError
from scissorcal.model import EdgeDistribution
from scissorcal.verdicts import Verdict


@dataclass(frozen=True)
class FoundNick:
    """Metal missing from the edge, as one photograph shows it: metres from the pivot."""

    station_m: float
    width_m: float
    depth_m: float
    source: str


@dataclass(frozen=True)
class Band:
    """A quantity along the blade or over the scene: mean, sd and the 5 % and 95 % points."""

    mean: Array
    sd: Array
    q05: Array
    q95: Array


@dataclass(frozen=True)
class EdgeCandidate:
    """One family of edges in the model comparison.

    ``evidence`` is the logarithm of the marginal likelihood. ``roughness_m`` is the standard
    deviation of the edge about its family and ``roughness_length_m`` its correlation length,
    ``noise_factor`` the noise of points over that expected from the picture's light, ``between_m``
    the standard deviation between photographs.
    """

    family: str
    evidence: float
    chosen: bool
    noise_factor: float
    roughness_m: float
    roughness_length_m: float
    between_m: float


@dataclass(frozen=True)
class PhotographRow:
    """One photograph: its points, its blur, and its distance from the joint fit.

    ``away`` is its mean residual, ``away_sd`` the standard deviation of that from its own pivot,
    centreline and mapping. ``station`` and ``residual`` are its points, averaged over short cells,
    and their residuals.
    """

    source: str
    points: int
    blur_px: float
    clear_share: float
    spoilt_share: float
    length: float
    away: float
    away_sd: float
    seen: str
    station: tuple[float, ...] = ()
    residual: tuple[float, ...] = ()


_STATION = Stored(("station",))


@dataclass(frozen=True)
class BladeFit:
    """One blade fitted to all its photographs.

    ``edge_posterior`` is the prior of a cut's fit, ``draws`` (n, k) are of its parameters. Lengths
    are metres where ``metric``, else blade lengths. ``station`` (n,) are places along the edge with
    the bands ``offset`` (e) and ``taper`` (alpha, rad). ``opening`` (i,) and ``contact`` (j,) span
    the scene, ``height`` (i, j) is phi there; None without a scale. ``length_sd`` is the standard
    deviation of the length over the photographs, ``pivot_sd`` that of the edge from the pivot's
    uncertainty.
    """

    name: str
    edge_posterior: EdgeDistribution
    draws: Annotated[Array, by_name("posterior", "edge_posterior.names")]
    candidates: tuple[EdgeCandidate, ...]
    station: Annotated[Array, _STATION]
    offset: Annotated[Band, _STATION]
    taper: Annotated[Band, _STATION]
    nicks: tuple[FoundNick, ...]
    photographs: tuple[PhotographRow, ...]
    length_sd: float
    pivot_sd: float
    metric: bool
    opening: Annotated[Array, Stored(("opening",))]
    contact: Annotated[Array, Stored(("contact",))]
    height: Annotated[Band | None, Stored(("opening", "contact"))]
    verdicts: tuple[Verdict, ...]
    notes: tuple[str, ...]

    @property
    def family(self) -> str:
        """The chosen family of edges."""
        return next(candidate.family for candidate in self.candidates if candidate.chosen)


@dataclass(frozen=True)
class SeenPair:
    """What one photograph shows of a pair as a whole.

    ``opening_rad`` is the angle between both blades' centrelines, 0 where they are closed.
    ``length_log_ratio`` is the logarithm of the ratio of their lengths as seen, with the standard
    deviation that a pair of one length has (0 where it was not measured), ``tilt_deg`` the least
    tilt of the camera that would explain it. ``lamp_deg`` is where the shadow falls, counted from
    between the tips, None where none is seen.
    """

    source: str
    opening_rad: float
    length_log_ratio: float = 0.0
    length_ratio_sd: float = 0.0
    tilt_deg: float = 0.0
    lamp_deg: float | None = None


@dataclass(frozen=True, repr=False)
class BladeResult(Result):
    """The fit of photographs of blades: one for a blade that lay alone, or one for each blade of a
    pair ("left" and "right" as seen from the handles)."""

    title = "blade fit"
    command = "scissorcal fit blade"
    what = "blade"

    blades: tuple[BladeFit, ...]
    openings: tuple[SeenPair, ...]
    inputs_hash: str
    sources: tuple[str, ...]
    pictures: tuple[str, ...] = ()
    shared_verdicts: tuple[Verdict, ...] = ()

    @property
    def edge_posterior(self) -> EdgeDistribution:
        """The edge for a cut's fit, which assumes that both blades are alike: the first one's.

        Raises InputError where no photograph had a scale.
        """
        for blade in self.blades:
            if blade.metric:
                return blade.edge_posterior
        raise InputError(
            "The photographs of the blade have no scale, so its edge is known up to its size only: "
            "photograph it on the mat, or give its length with --length-mm."
        )

    @property
    def model(self) -> str:
        """The chosen family of each blade's edge."""
        return ", ".join(blade.family for blade in self.blades)

    @property
    def verdicts(self) -> tuple[Verdict, ...]:
        """The verdicts on each blade, then those on all together and on the camera."""
        own = (verdict for blade in self.blades for verdict in blade.verdicts)
        return (*own, *self.shared_verdicts)


def blade_facts(fit: BladeFit) -> dict[str, Any]:
    """The results of a fit as plain numbers, units in the names."""
    unit = "mm" if fit.metric else "per_length"
    size = 1e3 if fit.metric else 1.0
    middle = len(fit.station) // 2
    return {
        "name": fit.name,
        "family": fit.family,
        f"offset_at_middle_{unit}": float(fit.offset.mean[middle]) * size,
        f"offset_at_middle_sd_{unit}": float(fit.offset.sd[middle]) * size,
        "taper_at_middle_deg": float(np.degrees(fit.taper.mean[middle])),
        "taper_at_middle_sd_deg": float(np.degrees(fit.taper.sd[middle])),
        f"length_{unit}": fit.edge_posterior.edge.length_m * size,
        "candidates": [
            {"name": candidate.family, "evidence": candidate.evidence, "chosen": candidate.chosen}
            for candidate in fit.candidates
        ],
        "nicks": [
            {
                f"station_{unit}": nick.station_m * size,
                f"width_{unit}": nick.width_m * size,
                f"depth_{unit}": nick.depth_m * size,
                "source": nick.source,
            }
            for nick in fit.nicks
        ],
    }
