"""The expected band of the torque over a scene, from what is known of friction and of a cut."""

from dataclasses import dataclass, replace

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.design.information import Information, Knowledge

REACHED_SHARE = 0.95
"""Share of the places that can be felt from which a scene's tolerance counts as reached. Where the
material's torque and friction nearly cancel, a band is wide for its torque whatever is captured."""


@dataclass(frozen=True)
class SceneSlopes:
    """Torque at the places of a scene that can be felt, and its slopes by the parameters.

    ``torque`` (n,) in N m; ``by_friction`` (n, pf) and ``by_cut`` (n, pc) are derivatives by the
    unconstrained parameters of the two fits. ``reach`` is how many standard deviations the scene's
    confidence spans to one side, ``tolerance`` the scene's, as a share.
    """

    torque: Array
    by_friction: Array
    by_cut: Array
    reach: float
    tolerance: float


@dataclass(frozen=True)
class Sharing:
    """How a fit of a cut depends on that of friction: by the priors of its two offsets.

    ``slopes`` (2, pf) are derivatives of friction's torque while closing and opening by friction's
    parameters, ``places`` where the offsets stand among the cut's, ``floor_sd`` (N m) the least
    that the fit takes, ``zero_sd`` (2,) what errors of the sensors' zeros add.
    """

    slopes: Array
    places: tuple[int, int]
    floor_sd: float
    zero_sd: Array


@dataclass(frozen=True)
class Band:
    """Half of the band over the torque at each place that can be felt (n,), and the tolerance."""

    share: Array
    tolerance: float

    @property
    def within(self) -> float:
        """Share of the places whose band is within the tolerance."""
        return float(np.mean(self.share <= self.tolerance))

    @property
    def typical(self) -> float:
        """The median over places, as a share of the torque."""
        return float(np.median(self.share))

    @property
    def worst(self) -> float:
        """The widest band for its torque."""
        return float(self.share.max())

    @property
    def reached(self) -> bool:
        """Whether the tolerance counts as reached: see :data:`REACHED_SHARE`."""
        return self.within >= REACHED_SHARE

    def wider(self, share: float) -> "Band":
        """The band wider by a share of itself."""
        return Band((1.0 + share) * self.share, self.tolerance)

    @property
    def excess(self) -> float:
        """Mean over places of how many e-folds a band is wider than the tolerance.

        It falls wherever a band beyond the tolerance shrinks, also where none gets within it yet.
        """
        return float(np.mean(np.maximum(np.log(np.maximum(self.share / self.tolerance, 1e-12)), 0)))


@dataclass(frozen=True)
class TorqueKnowledge:
    """What is known of the torque of a scene: friction, cut, and what they share."""

    friction: Knowledge
    cut: Knowledge
    sharing: Sharing
    scene: SceneSlopes

    def plus(
        self,
        friction: Information | None = None,
        cut: Information | None = None,
        *,
        new_recording: bool = False,
    ) -> "TorqueKnowledge":
        """Knowledge after strokes of friction and of a cut that tell so much."""
        more = self
        if friction is not None:
            combined = self.friction.plus(friction, new_recording=new_recording)
            more = replace(more, friction=combined)
        if cut is not None:
            more = replace(more, cut=self.cut.plus(cut, new_recording=new_recording))
        return more

    @property
    def cut_given_friction(self) -> Knowledge:
        """Knowledge of the cut, its offsets' priors as wide as friction is known."""
        sharing = self.sharing
        variance = quadratic_form(sharing.slopes, self.friction.covariance)
        variance = np.maximum(variance, sharing.floor_sd**2) + sharing.zero_sd**2
        prior = self.cut.prior.copy()
        prior[sharing.places, sharing.places] = 1.0 / variance
        return replace(self.cut, prior=prior)


def expected_band(known: TorqueKnowledge) -> Band:
    """The band of the torque that fits of such data are expected to state.

    To first order: the variance of a place's torque is the slopes' quadratic form in both
    covariances, and the band reaches as many standard deviations as the scene's confidence asks
    for. Minimising it over places is I-optimal design (Chaloner and Verdinelli 1995,
    doi:10.1214/ss/1177009939): of predictions, not of parameters.
    """
    scene = known.scene
    variance = quadratic_form(scene.by_cut, known.cut_given_friction.covariance)
    if scene.by_friction.any():
        variance = variance + quadratic_form(scene.by_friction, known.friction.covariance)
    half = scene.reach * np.sqrt(np.maximum(variance, 0.0))
    return Band(half / np.abs(scene.torque), scene.tolerance)


def quadratic_form(slopes: Array, covariance: Array) -> Array:
    """Variances (n,) of values with slopes (n, p) by parameters of a covariance (p, p)."""
    return np.asarray(np.einsum("ni,ij,nj->n", slopes, covariance, slopes))
