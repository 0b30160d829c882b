"""Random numbers that depend on a seed and a key alone."""

import numpy as np


def generator(seed: int, *key: int) -> np.random.Generator:
    """The random numbers of one trajectory, whatever the order in which trajectories are made."""
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(entropy=seed, spawn_key=key)))
