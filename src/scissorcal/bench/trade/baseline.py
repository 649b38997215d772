"""The baseline step: fixed work that is timed beside every measurement of a run."""

import time

import numpy as np

SIZE, ROUNDS = 160, 24


def baseline_s() -> float:
    """Processor seconds that the baseline step takes here and now.

    Fixed work of some 20 ms: linear solves of 160 equations, sines and a cumulative sum. Costs in
    multiples of it compare between machines better than seconds do.
    """
    rng = np.random.default_rng(0)
    matrix = rng.normal(size=(SIZE, SIZE)) + SIZE * np.eye(SIZE)
    vector = rng.normal(size=SIZE)
    began = time.process_time()
    for _ in range(ROUNDS):
        vector = np.asarray(np.linalg.solve(matrix, vector))
        vector += 1e-6 * np.cumsum(np.sin(matrix), axis=None)[:SIZE]
    return time.process_time() - began
