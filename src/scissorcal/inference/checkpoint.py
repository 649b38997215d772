"""Walks of ensembles in a file, so that an interrupted run goes on as if it had never stopped."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.errors import InputError
from scissorcal.files import replacing
from scissorcal.foreign import first_line, open_foreign
from scissorcal.foreign.formats import CHECKPOINT

RandomState = tuple[str, NDArray[np.uint32], int, int, float]


class CheckpointError(InputError, ValueError):
    """A checkpoint that cannot be read, or is of another posterior."""


@dataclass(frozen=True)
class Walk:
    """One ensemble: its stored chain (stored, walkers, p) and all that its next step depends on.

    ``coords`` (walkers, p) and ``heights`` (walkers,) are where it stands, ``thin`` the steps
    between two stored ones, ``accepted`` the moves that were accepted, ``random_state`` that of
    numpy's Mersenne twister.
    """

    chain: Array
    accepted: float
    steps: int
    thin: int
    coords: Array
    heights: Array
    random_state: RandomState


def save_walks(path: Path, walks: list[Walk]) -> None:
    """Write walks of equal length; the file is replaced as a whole or not at all.

    Makes its folder where there is none yet.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as part, part.open("wb") as file:
        np.savez(
            file,
            chain=np.stack([walk.chain for walk in walks]),
            coords=np.stack([walk.coords for walk in walks]),
            heights=np.stack([walk.heights for walk in walks]),
            accepted=np.array([walk.accepted for walk in walks]),
            counts=np.array([walks[0].steps, walks[0].thin]),
            keys=np.stack([walk.random_state[1] for walk in walks]),
            positions=np.array([walk.random_state[2:4] for walk in walks]),
            gauss=np.array([walk.random_state[4] for walk in walks]),
        )


def load_walks(
    path: Path, log_posterior: Callable[[Array], float], shape: tuple[int, int]
) -> list[Walk]:
    """Read walks over ``shape`` (walkers, p), after a check that they are of this posterior.

    Raises CheckpointError (a ValueError), naming the file, where it cannot be read or belongs to
    another posterior.
    """
    walks = _read(path)
    first = walks[0]
    own = first.coords.shape == first.chain.shape[1:] == shape
    own = own and first.heights.shape == shape[:1]
    heights = [log_posterior(point) for point in first.coords] if own else []
    if not own or not np.allclose(heights, first.heights, rtol=1e-6, atol=1e-3):
        raise CheckpointError(
            f"{path}: this checkpoint is of another posterior (data, settings or model have "
            "changed since); move it away, or name another file, to start afresh."
        )
    return walks


def _read(path: Path) -> list[Walk]:
    try:
        with open_foreign(path, CHECKPOINT) as raw, np.load(raw, allow_pickle=False) as file:
            steps, thin = (int(count) for count in file["counts"])
            positions = file["positions"]
            return [
                Walk(
                    chain=chain,
                    accepted=float(accepted),
                    steps=steps,
                    thin=thin,
                    coords=coords,
                    heights=heights,
                    random_state=("MT19937", keys, int(at[0]), int(at[1]), float(gauss)),
                )
                for chain, accepted, coords, heights, keys, at, gauss in zip(
                    file["chain"],
                    file["accepted"],
                    file["coords"],
                    file["heights"],
                    file["keys"],
                    positions,
                    file["gauss"],
                    strict=True,
                )
            ]
    except Exception as error:
        raise CheckpointError(
            f"{path}: not a readable checkpoint ({first_line(error)}); move it away, or name "
            "another file, to start afresh."
        ) from error
