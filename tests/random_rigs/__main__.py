"""Probe many random rigs and count what was said of them.

python -m tests.random_rigs --healthy 1000 --wrong 200 --from 10000
"""

import argparse
import json
from collections import Counter
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor

import numpy as np

from .rigs import WRONG, falls, healthy, wrong
from .trial import Trial, trial_of


def main() -> None:
    """Print a table of outcomes, and what was said where it was not the right thing."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--healthy", type=int, default=100)
    parser.add_argument("--wrong", type=int, default=0, help="of each kind")
    parser.add_argument("--from", dest="first", type=int, default=10_000, help="the first seed")
    parser.add_argument("--workers", type=int, default=2)
    asked = parser.parse_args()
    seeds = range(asked.first, asked.first + asked.healthy)
    with ProcessPoolExecutor(asked.workers) as pool:
        _healthy(list(pool.map(_of_healthy, seeds, chunksize=4)))
        for kind in WRONG if asked.wrong else ():
            first = asked.first + asked.healthy
            some = [(kind, first + index) for index in range(asked.wrong)]
            found = list(pool.map(_of_wrong, some, chunksize=4))
            print(json.dumps({"wrong": kind, **Counter(one.outcome for one in found)}))
            for sentence, count in Counter(one.said[:90] for one in found).most_common(4):
                print(f"    {count} {sentence}")


def _of_healthy(seed: int) -> Trial:
    return trial_of(healthy(seed))


def _of_wrong(asked: tuple[str, int]) -> Trial:
    return trial_of(wrong(*asked))


def _healthy(found: list[Trial]) -> None:
    groups: dict[str, Iterable[Trial]] = {
        "all": found,
        "blades stay where they are left": [one for one in found if not falls(healthy(one.seed))],
        "blades fall": [one for one in found if falls(healthy(one.seed))],
        "stay, the host never stalls": [
            one for one in found if not falls(healthy(one.seed)) and not one.stalls
        ],
    }
    for name, group in groups.items():
        some = list(group)
        known = [one for one in some if np.isfinite(one.z)]
        rates = [one.largest_rate for one in some]
        print(
            json.dumps(
                {
                    "healthy": name,
                    "rigs": len(some),
                    **Counter(one.outcome for one in some),
                    "inertia inside 90 %": round(float(np.mean([o.inside for o in known])), 3)
                    if known
                    else None,
                    "median error of inertia": round(
                        float(np.median([abs(o.error) for o in known])), 4
                    )
                    if known
                    else None,
                    "largest rate": round(max(rates), 2) if rates else None,
                    "above 1.5 rad/s": sum(rate > 1.5 for rate in rates),
                }
            )
        )
    for one in found:
        if one.outcome != "right":
            print(f"    {one.seed} {one.outcome}: {one.said[:150]}")


if __name__ == "__main__":
    main()
